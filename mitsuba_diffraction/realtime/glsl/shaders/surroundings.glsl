// Light from a direction: the environment, flat area lights, and flat shapes that obstruct them; see
// surroundings.py.

uniform vec2 sequence;            // numbers of the frame, from 0 to 1
uniform float least_distance;     // least distance from a plane: a surface does not see itself
uniform vec4 dome;                // direction upwards, and radiance from above of a page's own light

#ifdef ENVIRONMENT
uniform sampler2D environment;    // radiance, linear sRGB: angle around the z axis, angle from it
uniform float environment_density;  // probability density of drawn lights over the radiance
uniform vec4 sun;                 // direction, and cosine of the radius
uniform vec3 sun_radiance;

vec3 environment_radiance(vec3 direction)
{
    float rows = float(textureSize(environment, 0).y);
    float row = clamp(acos(clamp(direction.z, -1.0, 1.0)) / PI, 0.5 / rows, 1.0 - 0.5 / rows);
    return texture(environment, vec2(turn_of(direction.xy), row)).rgb;
}
#endif

#ifdef FLATS
#if FLATS > 0
uniform vec4 flat_x[FLATS];       // coordinate x on the unit square or disk
uniform vec4 flat_y[FLATS];       // coordinate y
uniform vec4 flat_z[FLATS];       // distance from the plane
uniform vec4 flat_light[FLATS];   // radiance, and density per area of drawn lights
#endif

// Radiance from a direction, density of lights drawn along it, and (`nearest`) distance.
vec4 arriving(vec3 position, vec3 direction, out float nearest)
{
    nearest = 1e30;
    vec4 found = vec4(0.0);
#ifdef ENVIRONMENT
    found.rgb = environment_radiance(direction);
    found.w = environment_density * dot(found.rgb, vec3(1.0));
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

// Numbers from 0 to 1 that differ by pixel (integer hash of Jarzynski and Olano 2020).
vec2 drawn_numbers()
{
    uvec3 v = uvec3(uvec2(gl_FragCoord.xy), 7u) * 1664525u + 1013904223u;
    v += v.yzx * v.zxy;
    v ^= v >> 16u;
    v += v.yzx * v.zxy;
    return fract(vec2(v.xy >> 8u) * (1.0 / 16777216.0) + sequence);
}
