// A light with shadows: the light emitted towards a point, and whether it reaches the point.

uniform vec3 light_axis;          // axis of a spot or normal of an area light; otherwise zero
uniform vec2 light_cone;          // cutoff (rad) and 1/(cutoff − beam) of a spot; otherwise zero

uniform sampler2D shadow_map;     // depth from the light
uniform mat4 shadow_matrix;       // from the scene to the map's clip space
uniform mat4 shadow_planes;       // inverse transpose of that matrix, for planes
uniform float shadow_bias;        // bias in the map's depth; in perspective at the distance 1
uniform float shadow_steepest;    // largest change of depth within a texel; in perspective at 1

float emitted(vec3 towards_light)
{
    if (dot(light_axis, light_axis) == 0.0) return 1.0;
    float cosine = clamp(-dot(light_axis, towards_light), -1.0, 1.0);
    if (light_cone.y == 0.0) return max(cosine, 0.0);
    return clamp((light_cone.x - acos(cosine)) * light_cone.y, 0.0, 1.0);
}

// A texel stores the depth in its middle. The surface's depth is computed in the texel's middle,
// too, on the plane of its triangle with this normal, so that a surface does not shade itself.
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
    // limit the slope of planes that are seen edge-on
    depth = clamp(depth, place.z - shadow_steepest / clip.w, place.z + shadow_steepest / clip.w);
    float seen = 2.0 * texelFetch(shadow_map, ivec2(texel), 0).r - 1.0;
    return seen < depth - shadow_bias / clip.w ? 0.0 : 1.0;
}
