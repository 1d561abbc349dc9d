// What comes from a direction: the environment, and area lights that are flat, or what stands before
// them; see surroundings.py.

uniform vec2 sequence;            // of the frame: what is drawn
uniform float least_distance;     // from a plane: a surface does not see itself

#ifdef ENVIRONMENT
uniform sampler2D environment;    // radiance, linear sRGB: around the z axis, and from it
uniform float environment_density;  // with which lights are drawn from it, over the radiance
uniform vec4 sun;                 // its direction, and the cosine of its radius
uniform vec3 sun_radiance;

vec3 environment_radiance(vec3 direction)
{
    float rows = float(textureSize(environment, 0).y);
    float row = clamp(acos(clamp(direction.z, -1.0, 1.0)) / PI, 0.5 / rows, 1.0 - 0.5 / rows);
    return texture(environment, vec2(turn_of(direction.xy), row)).rgb;
}

float density_of_environment(vec3 radiance) { return environment_density * dot(radiance, vec3(1.0)); }
#endif

#ifdef FLATS
#if FLATS > 0
uniform vec4 flat_x[FLATS];       // to the square or disk: local places ...
uniform vec4 flat_y[FLATS];
uniform vec4 flat_z[FLATS];       // ... and the distance from its plane
uniform vec4 flat_light[FLATS];   // radiance, and the density per area with which lights are drawn
#endif

// Radiance from a direction, with which density lights are drawn there, and from how far it comes.
vec4 arriving(vec3 position, vec3 direction, out float nearest)
{
    nearest = 1e30;
    vec4 found = vec4(0.0);
#ifdef ENVIRONMENT
    found.rgb = environment_radiance(direction);
    found.w = density_of_environment(found.rgb);
#ifdef MIRROR
    if (dot(direction, sun.xyz) > sun.w) found.rgb += sun_radiance;
#endif
#endif
#if FLATS > 0
    for (int i = 0; i < FLATS; ++i) {
        vec4 place = vec4(position, 1.0);
        vec3 from = vec3(dot(flat_x[i], place), dot(flat_y[i], place), dot(flat_z[i], place));
        vec3 along = vec3(dot(flat_x[i].xyz, direction), dot(flat_y[i].xyz, direction),
                          dot(flat_z[i].xyz, direction));
        float t = -from.z / (abs(along.z) > 1e-12 ? along.z : 1e-12);
        vec2 at = from.xy + t * along.xy;
        float out_of_it = i < DISKS ? dot(at, at) : max(abs(at.x), abs(at.y));
        if (out_of_it <= 1.0 && abs(from.z) > least_distance && t > 0.0 && t < nearest) {
            nearest = t;
            found = vec4(flat_light[i].rgb, flat_light[i].w * t * t / max(-along.z, 1e-6));
            if (along.z > 0.0) found = vec4(0.0);
        }
    }
#endif
    return found;
}
#endif

// Numbers from 0 to 1, other ones at every pixel (the integer hash of Jarzynski and Olano 2020).
vec2 drawn_numbers()
{
    uvec3 v = uvec3(uvec2(gl_FragCoord.xy), 7u) * 1664525u + 1013904223u;
    v += v.yzx * v.zxy;
    v ^= v >> 16u;
    v += v.yzx * v.zxy;
    return fract(vec2(v.xy >> 8u) * (1.0 / 16777216.0) + sequence);
}
