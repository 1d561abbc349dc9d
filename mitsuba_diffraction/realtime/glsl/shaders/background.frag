// What lies behind the scene: the environment along a pixel's ray.

uniform mat4 from_clip;           // the view's, inverted
uniform vec3 eye;
uniform vec2 picture_size;

out vec4 fragment;

void main()
{
    vec2 clip = 2.0 * gl_FragCoord.xy / picture_size - 1.0;
    vec4 far = from_clip * vec4(clip, 1.0, 1.0);
    vec3 direction = normalize(far.xyz / far.w - eye);
    fragment = vec4(environment_radiance(direction), 0.0);
    if (dot(direction, sun.xyz) > sun.w) fragment.rgb += sun_radiance;
}
