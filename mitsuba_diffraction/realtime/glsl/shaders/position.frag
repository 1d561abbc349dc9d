// Position of a pixel's surface in the scene; with only a depth buffer, a shadow map.

in vec3 v_position;

out vec4 fragment;

void main()
{
    fragment = vec4(v_position, 1.0);
}
