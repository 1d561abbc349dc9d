// A frame, added to sums: by blending, or here for browsers, which may not blend floats.

uniform sampler2D frame;
uniform sampler2D sums;
uniform bool first;               // whether nothing is added here
uniform float covers;             // 0 of frames without coverage

out vec4 fragment;

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 before = first ? vec4(0.0) : texelFetch(sums, at, 0);
    fragment = before + vec4(1.0, 1.0, 1.0, covers) * texelFetch(frame, at, 0);
}
