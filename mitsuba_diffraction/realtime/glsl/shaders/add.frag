// A frame, to be added to a sum.

uniform sampler2D frame;

out vec4 fragment;

void main()
{
    fragment = texelFetch(frame, ivec2(gl_FragCoord.xy), 0);
}
