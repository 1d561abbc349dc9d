// The patch's frame at a point of the surface, and whether a surface of a mix is drawn there.

in vec3 v_position;
in vec3 v_normal;
in vec3 v_tangent;
in vec2 v_texcoord;
in vec3 v_colour;
in vec3 v_axis;

uniform sampler2D axis_map;       // (cos, sin) of the patch's x axis, and its stretch
uniform mat3 axis_uv;
uniform sampler2D mask_map;       // interval of [0, 1) that the surface's weight takes
uniform mat3 mask_uv;
uniform mat4 view_projection;
uniform vec2 patch_turn;          // (cos, sin) of the page's control, by which all patches are turned

// Look up a picture. clamped: at its edges, else it repeats; nearest: without interpolation.
vec3 looked_up(sampler2D map, mat3 to_uv, vec2 texcoord, bool clamped, bool nearest)
{
    vec2 place = (to_uv * vec3(texcoord, 1.0)).xy, size = vec2(textureSize(map, 0));
    if (nearest) place = (floor(place * size) + 0.5) / size;
    return texture(map, clamped ? clamp(place, 0.5 / size, 1.0 - 0.5 / size) : place).rgb;
}

// Rotation to the patch's axes times its stretch. axis: (cos, sin) and stretch of the vertex.
vec2 patch_frame(vec2 texcoord, vec3 axis)
{
#ifdef AXIS_MAPPED
    axis = looked_up(axis_map, axis_uv, texcoord, AXIS_CLAMPED, AXIS_NEAREST);
#endif
    float turned = length(axis.xy);
    vec2 unit = turned > 1e-6 ? axis.xy / turned : vec2(1.0, 0.0);
#ifdef LIVE
    unit = vec2(dot(unit, vec2(patch_turn.x, -patch_turn.y)), dot(unit, patch_turn.yx));
#endif
    return axis.z * unit;
}

// Whether another surface of the mix is drawn in this pixel. Where several have a weight, pixels
// are shared out by a pattern (interleaved gradient noise, Jimenez 2014) that changes with the
// picture's shift by a part of a pixel, so the mean of frames is the blend.
bool masked(vec2 texcoord)
{
#ifdef MASK_MAPPED
    vec2 interval = looked_up(mask_map, mask_uv, texcoord, MASK_CLAMPED, MASK_NEAREST).rg;
    vec3 right = vec3(view_projection[0].x, view_projection[1].x, view_projection[2].x);
    vec3 up = vec3(view_projection[0].y, view_projection[1].y, view_projection[2].y);
    float shift = dot(right, vec3(7919.0, 6271.0, 5003.0)) + dot(up, vec3(4099.0, 8191.0, 6563.0));
    float noise = 52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)));
    float threshold = fract(noise + fract(shift));
    return threshold < interval.x || threshold >= interval.y;
#else
    return false;
#endif
}
