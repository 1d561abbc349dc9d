// Picture of two kinds of frames from their sums, for a display.

uniform sampler2D first;
uniform sampler2D second;
uniform vec2 weights;        // 1 over the number of frames of each kind
uniform float exposure;      // factor

out vec4 fragment;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 light = weights.x * texelFetch(first, pixel, 0).rgb
               + weights.y * texelFetch(second, pixel, 0).rgb;
    fragment = vec4(displayed(exposure * light), 1.0);
}
