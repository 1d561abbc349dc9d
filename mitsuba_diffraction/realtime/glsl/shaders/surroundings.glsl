// What comes from a direction: the environment, and area lights that are flat, or what stands before
// them; see surroundings.py.

uniform vec3 sequence;            // of the frame: what is drawn, and which depth map is looked at
uniform float least_distance;     // of what a surface sees: it does not see itself

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

// Radiance from a direction, and with which density lights are drawn there.
vec4 arriving(vec3 position, vec3 direction)
{
    vec4 found = vec4(0.0);
#ifdef ENVIRONMENT
    found.rgb = environment_radiance(direction);
    found.w = density_of_environment(found.rgb);
#ifdef MIRROR
    if (dot(direction, sun.xyz) > sun.w) found.rgb += sun_radiance;
#endif
#endif
#if FLATS > 0
    float nearest = 1e30;
    for (int i = 0; i < FLATS; ++i) {
        vec4 place = vec4(position, 1.0);
        vec3 from = vec3(dot(flat_x[i], place), dot(flat_y[i], place), dot(flat_z[i], place));
        vec3 along = vec3(dot(flat_x[i].xyz, direction), dot(flat_y[i].xyz, direction),
                          dot(flat_z[i].xyz, direction));
        float t = -from.z / (abs(along.z) > 1e-12 ? along.z : 1e-12);
        vec2 at = from.xy + t * along.xy;
        float out_of_it = i < DISKS ? dot(at, at) : max(abs(at.x), abs(at.y));
        if (out_of_it <= 1.0 && t > least_distance && t < nearest) {
            nearest = t;
            found = vec4(flat_light[i].rgb, flat_light[i].w * t * t / max(-along.z, 1e-6));
            if (along.z > 0.0) found = vec4(0.0);
        }
    }
#endif
    return found;
}
#endif

#ifdef DEPTH_ROWS
uniform sampler2D depth_maps;     // tiles: rows over cosθ, columns around the z axis
uniform sampler2D depth_views;    // three rows of each tile's matrix
uniform float depth_bias;         // along the normal

// Whether the scene stands in the way; of the tiles around the direction one is drawn.
bool hidden(vec3 position, vec3 normal, vec3 direction, vec2 drawn)
{
    vec2 place = vec2(turn_of(direction.xy) * float(DEPTH_COLUMNS),
                      (0.5 * direction.z + 0.5) * float(DEPTH_ROWS)) + drawn - 0.5;
    ivec2 tile = ivec2(floor(place));
    tile.x = (tile.x + DEPTH_COLUMNS) % DEPTH_COLUMNS;
    tile.y = clamp(tile.y, 0, DEPTH_ROWS - 1);
    int first = 3 * (tile.y * DEPTH_COLUMNS + tile.x);
    vec4 moved = vec4(position + depth_bias * normal, 1.0);
    vec4 away = texelFetch(depth_views, ivec2(first + 2, 0), 0);
    vec3 at = vec3(dot(texelFetch(depth_views, ivec2(first, 0), 0), moved),
                   dot(texelFetch(depth_views, ivec2(first + 1, 0), 0), moved), dot(away, moved));
    // the tile may lie below the surface's own horizon, where the direction does not
    if (max(abs(at.x), abs(at.y)) >= 1.0 || dot(away.xyz, normal) >= 0.0) return false;
    ivec2 size = textureSize(depth_maps, 0) / ivec2(DEPTH_COLUMNS, DEPTH_ROWS);
    ivec2 texel = tile * size + ivec2((0.5 * at.xy + 0.5) * vec2(size));
    return 2.0 * texelFetch(depth_maps, texel, 0).r - 1.0 < at.z;
}
#endif

// Numbers from 0 to 1, other ones at every pixel (the integer hash of Jarzynski and Olano 2020).
vec3 drawn_numbers()
{
    uvec3 v = uvec3(uvec2(gl_FragCoord.xy), 7u) * 1664525u + 1013904223u;
    v += v.yzx * v.zxy;
    v ^= v >> 16u;
    v += v.yzx * v.zxy;
    return fract(vec3(v >> 8u) * (1.0 / 16777216.0) + sequence);
}
