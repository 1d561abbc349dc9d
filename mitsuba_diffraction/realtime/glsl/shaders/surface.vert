// From a vertex to its place in the picture, and to what a fragment needs of the surface.
//
// The tangent frame travels, not the directions to light and eye: interpolated directions are off by
// the square of the frame's turn within a triangle, as much as a speckle of colour is wide.

in vec3 position;
in vec3 normal;
in vec3 tangent;   // dp/du
in vec2 texcoord;
in vec3 colour;    // diffuse reflectance, linear sRGB
in vec2 axis;      // (cos, sin) from the tangent to the patch's x axis

uniform mat4 view_projection;

out vec3 v_position;
out vec3 v_normal;
out vec3 v_tangent;
out vec2 v_texcoord;
out vec3 v_colour;
out vec2 v_axis;

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
