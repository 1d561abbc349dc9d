// Shape that emits light, on the side of its normal.

in vec3 v_position;
in vec3 v_normal;

uniform vec3 eye;
uniform vec3 radiance;

out vec4 fragment;

void main()
{
    bool front = dot(eye - v_position, v_normal) > 0.0;
    fragment = vec4(front ? radiance : vec3(0.0), 1.0);
}
