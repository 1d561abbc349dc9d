// Picture of a page: mean of the samples over a background, for a display.

uniform sampler2D samples;   // sums of linear sRGB and of coverage
uniform float sample_count;
uniform vec3 background;     // linear sRGB, exposed
uniform float exposure;      // factor

out vec4 fragment;

void main()
{
    vec4 mean = texelFetch(samples, ivec2(gl_FragCoord.xy), 0) / sample_count;
    fragment = vec4(displayed(mean.rgb * exposure + background * (1.0 - mean.a)), 1.0);
}
