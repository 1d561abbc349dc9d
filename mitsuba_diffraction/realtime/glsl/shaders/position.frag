// Where in the scene a pixel's surface lies; with a depth buffer alone, a shadow map.

in vec3 v_position;

out vec4 fragment;

void main()
{
    fragment = vec4(v_position, 1.0);
}
