// Background: the environment along a pixel's ray.

uniform mat4 from_clip;           // from clip space to the scene
uniform vec3 eye;
uniform vec2 picture_size;
uniform vec3 horizon;             // up direction, if half skies are mirrored below; else zero

const float HAZE = 0.03;          // sine of the lowest elevation of a mirrored half sky

out vec4 fragment;

void main()
{
    vec2 clip = 2.0 * gl_FragCoord.xy / picture_size - 1.0;
    vec4 far = from_clip * vec4(clip, 1.0, 1.0);
    vec3 direction = normalize(far.xyz / far.w - eye);
    float up = dot(direction, horizon);
    vec3 shown = direction;
    if (horizon != vec3(0.0) && up < HAZE && environment_radiance(-horizon) == vec3(0.0))
        shown = normalize(direction + (max(-up, HAZE) - up) * horizon);
    fragment = vec4(environment_radiance(shown), 0.0);
    if (dot(direction, sun.xyz) > sun.w) fragment.rgb += sun_radiance;
}
