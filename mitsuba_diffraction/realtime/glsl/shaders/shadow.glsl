// One light and the shadows that it casts: what it emits towards a place, and whether it gets there.

uniform vec3 light_axis;          // of a light that shines along it; zero otherwise
uniform vec2 light_cone;          // cutoff (rad) and 1/(cutoff − beam) of a spot; zero of a plane

uniform sampler2D shadow_map;     // depth from the light
uniform mat4 shadow_matrix;       // from the scene to the map's clip space
uniform mat4 shadow_planes;       // the same for planes: its inverse, transposed
uniform float shadow_bias;        // in the map's depth; of a perspective at the distance 1
uniform float shadow_steepest;    // largest change of depth within a texel, likewise

float emitted(vec3 towards_light)
{
    if (dot(light_axis, light_axis) == 0.0) return 1.0;
    float cosine = clamp(-dot(light_axis, towards_light), -1.0, 1.0);
    if (light_cone.y == 0.0) return max(cosine, 0.0);
    return clamp((light_cone.x - acos(cosine)) * light_cone.y, 0.0, 1.0);
}

// A texel holds the depth in its middle. So that a surface does not shade itself there, its own
// depth is taken in the texel's middle, too: on the plane of its triangle, which has this normal.
float reached(vec3 position, vec3 normal)
{
    vec4 clip = shadow_matrix * vec4(position, 1.0);
    if (clip.w <= 0.0) return 1.0;
    vec3 place = clip.xyz / clip.w;
    if (max(abs(place.x), abs(place.y)) >= 1.0) return 1.0;
    vec2 size = vec2(textureSize(shadow_map, 0));
    vec2 texel = floor((0.5 * place.xy + 0.5) * size);
    vec2 middle = 2.0 * (texel + 0.5) / size - 1.0;
    vec4 plane = shadow_planes * vec4(normal, -dot(normal, position));
    float depth = abs(plane.z) < 1e-20 ? place.z
        : -(plane.x * middle.x + plane.y * middle.y + plane.w) / plane.z;
    // edge-on a plane is steeper than any texel can tell
    depth = clamp(depth, place.z - shadow_steepest / clip.w, place.z + shadow_steepest / clip.w);
    float seen = 2.0 * texelFetch(shadow_map, ivec2(texel), 0).r - 1.0;
    return seen < depth - shadow_bias / clip.w ? 0.0 : 1.0;
}
