// Functions that all shaders share: lists, angles, lights.

const float PI = 3.14159265358979;

// Entry i of a list, which is stored in rows of PAGE = 2^PAGE_BITS texels.
vec4 entry(sampler2D list, int i)
{
    return texelFetch(list, ivec2(i & (PAGE - 1), i >> PAGE_BITS), 0);
}

// Two numbers whose upper halves a float stores.
vec2 upper_halves(float stored)
{
    uint word = floatBitsToUint(stored);
    return uintBitsToFloat(uvec2(word << 16, word & 0xffff0000u));
}

// Interpolate along a row of a texture; share: from 0 in its first column to 1 in its last one.
vec4 in_row(sampler2D table, float share, int row)
{
    float last = float(textureSize(table, 0).x - 1), x = clamp(share, 0.0, 1.0) * last;
    float lower = min(floor(x), last - 1.0);
    vec4 left = texelFetch(table, ivec2(int(lower), row), 0);
    return mix(left, texelFetch(table, ivec2(int(lower) + 1, row), 0), x - lower);
}

// Angle from the x axis in turns, 0 to 1. Minimax polynomial, 3e-7: drivers' atan costs twice as much.
float turn_of(vec2 p)
{
    vec2 size = abs(p);
    float t = min(size.x, size.y) / max(max(size.x, size.y), 1e-30);
    float s = t * t;
    float turn = t * (0.15915132 + s * (-0.05293857 + s * (0.03080291 + s * (-0.01852985
                 + s * (0.008379084 - s * 0.0018651575)))));
    turn = size.y > size.x ? 0.25 - turn : turn;
    turn = p.x < 0.0 ? 0.5 - turn : turn;
    return p.y < 0.0 ? 1.0 - turn : turn;
}

// 1 − 2θ/π of cosines from 0 to 1. A minimax polynomial over √(1 − cosθ), 3e-6.
vec3 elevations(vec3 cosines)
{
    vec3 c = clamp(cosines, 0.0, 1.0);
    return 1.0 - sqrt(1.0 - c) * (0.99999695 + c * (-0.13641527 + c * (0.05451908
               + c * (-0.02394849 + c * 0.006196195))));
}

// asin of sines from 0 to 1, from `elevations`.
float arcsine(float sine) { return 0.5 * PI * elevations(vec3(sine)).x; }

#ifdef LIGHTS
uniform vec3 light_colour[LIGHTS];  // irradiance, or intensity of a point light, linear sRGB
#else
const vec3 light_colour[1] = vec3[1](vec3(1.0));  // the caller multiplies by the light's colour
#endif
