// Project a vertex, and pass the surface's attributes to fragments.
//
// The tangent frame is interpolated, not the directions to light and eye: interpolated directions
// would be off by the square of the frame's rotation within a triangle, as much as a colour speckle.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 tangent;  // dp/du
layout(location = 3) in vec2 texcoord;
layout(location = 4) in vec3 colour;  // diffuse reflectance, linear sRGB
layout(location = 5) in vec3 axis;  // (cos, sin) from the tangent to the patch's x axis, and its stretch

uniform mat4 view_projection;

out vec3 v_position;
out vec3 v_normal;
out vec3 v_tangent;
out vec2 v_texcoord;
out vec3 v_colour;
out vec3 v_axis;

void main()
{
    v_position = position;
    v_normal = normal;
    v_tangent = tangent;
    v_texcoord = texcoord;
    v_colour = colour;
    v_axis = axis;
    gl_Position = view_projection * vec4(position, 1.0);
}
