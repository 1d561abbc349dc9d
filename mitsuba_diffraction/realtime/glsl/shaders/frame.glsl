// The patch's frame at a point of the surface, and whether a surface of a mix is drawn there.

#ifdef AXIS_MAPPED
uniform sampler2D axis_map;       // (cos, sin) of the patch's x axis, and its stretch
uniform mat3 axis_uv;
#endif
#ifdef MASK_MAPPED
uniform sampler2D mask_map;       // interval of [0, 1) that the surface's weight takes
uniform mat3 mask_uv;
uniform mat4 view_projection;
#endif

#ifdef LIVE
uniform vec2 patch_turn;          // (cos, sin) of the page's control, by which all patches are turned
#endif

// Clamp texture coordinates to a picture.
vec2 within(vec2 place, vec2 size) { return clamp(place, 0.5 / size, 1.0 - 0.5 / size); }

// Middle of the texel, for textures that are not interpolated.
vec2 nearest(vec2 place, vec2 size) { return (floor(place * size) + 0.5) / size; }

// Rotation to the patch's axes times its stretch. axis: (cos, sin) and stretch of the vertex.
vec2 patch_frame(vec2 texcoord, vec3 axis)
{
#ifdef AXIS_MAPPED
    vec2 place = (axis_uv * vec3(texcoord, 1.0)).xy, size = vec2(textureSize(axis_map, 0));
#ifdef AXIS_NEAREST
    place = nearest(place, size);
#endif
#ifdef AXIS_CLAMPED
    place = within(place, size);
#endif
    axis = texture(axis_map, place).rgb;
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
    vec2 place = (mask_uv * vec3(texcoord, 1.0)).xy, size = vec2(textureSize(mask_map, 0));
#ifdef MASK_NEAREST
    place = nearest(place, size);
#endif
#ifdef MASK_CLAMPED
    place = within(place, size);
#endif
    vec2 interval = texture(mask_map, place).rg;
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
