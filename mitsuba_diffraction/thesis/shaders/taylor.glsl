// Table of the thesis: complex DFTs of (2h/H)ⁿ, summed as a Taylor series in κH/2 before the sum is
// squared. flss, nmm and pq share it; thesis/methods documents the formulas.

#define SKIPS_UNLIT  // skip unlit fragments, so that loops can end early

uniform sampler2D series_amplitudes; // TEXELS texels per bin: real and imaginary part of two terms
uniform sampler2D amplitude_zero;   // series of order 0, minus 1
uniform sampler2D responses;        // linear sRGB / 2π over k, one row per light
uniform ivec2 last_order;
uniform vec2 spacing;               // spacing of bins, rad/µm
uniform vec2 exponents;             // exponents of the window, per squared bin
uniform float half_range;           // H/2, µm
uniform float inverse_scale;
uniform float first_wavelength;     // µm
uniform float last_wavelength;
uniform float wavelength_step;
uniform vec2 repeats;               // copies of the patch, for pq

// The light's response times dλ/λ² in 1/µm² at a wavelength in µm, for a step of 1 µm.
vec3 response(float wavelength, int light)
{
    float k = 2.0 * PI / wavelength;
    float place = (k - wavenumbers.x) / (wavenumbers.y - wavenumbers.x);
    return in_row(responses, place, light).rgb * (k * k / (2.0 * PI));
}

float kernel(float apart, float exponent)
{
#ifdef REPEATED
    return max(0.0, 1.0 - abs(apart));
#else
    return exp(-exponent * apart * apart);
#endif
}

// |sin(πnx)/(n sin(πx))|, 1 at integers: interference of n copies of the patch.
float copies(float x, float n)
{
    float part = x - floor(x + 0.5);
    float below = n * sin(PI * part);
    return abs(part) < 1e-5 ? 1.0 : abs(sin(PI * n * part) / below);
}

vec2 series(sampler2D list, int texel, float weights[2 * TEXELS])
{
    vec2 sum = vec2(0.0);
    for (int i = 0; i < TEXELS; ++i) {
        vec4 pair = entry(list, texel + i);
        sum += weights[2 * i] * pair.xy + weights[2 * i + 1] * pair.zw;
    }
    return sum;
}

ivec2 first_bin(vec2 place)
{
    ivec2 taps = ivec2(TAPS_X, TAPS_Y);
    ivec2 odd = taps & 1;
    return ivec2(floor(place + 0.5 * vec2(odd))) - (taps - 1) / 2;
}

// S, the power under the window: 1 for a flat mirror in the mirror direction.
float window_power(vec2 uv, float z, float wavelength)
{
    float k = 2.0 * PI / wavelength;
    float x = k * z * half_range;
    float weights[2 * TEXELS];
    float weight = 1.0;
    for (int n = 0; n < 2 * TEXELS; ++n) {
        weight *= x / float(n + 1);
        weights[n] = weight;
    }
    vec2 place = k * uv / spacing;
    ivec2 first = first_bin(place);
    ivec2 size = 2 * last_order + 1;
    ivec2 corner = clamp(first + last_order, ivec2(0), size - ivec2(TAPS_X, TAPS_Y));
    vec2 centre = vec2(1.0, 0.0) + series(amplitude_zero, 0, weights);
    float lobe = kernel(place.x, exponents.x) * kernel(place.y, exponents.y);
    vec2 amplitude = lobe * centre;
    float power = lobe * dot(centre, centre);
    for (int j = 0; j < TAPS_Y; ++j) {
        float across = kernel(place.y - float(first.y + j), exponents.y);
        for (int i = 0; i < TAPS_X; ++i) {
            int texel = ((corner.y + j) * size.x + corner.x + i) * TEXELS;
            vec2 value = series(series_amplitudes, texel, weights) * inverse_scale;
            float share = across * kernel(place.x - float(first.x + i), exponents.x);
            amplitude += share * value;
            power += share * dot(value, value);
        }
    }
#ifdef COHERENT
    power = dot(amplitude, amplitude);
#endif
#ifdef REPEATED
    vec2 filled = vec2(copies(place.x, repeats.x), copies(place.y, repeats.y));
    power *= filled.x * filled.x * filled.y * filled.y;
#endif
    return power;
}

// Contribution of a wavelength in µm, for a step of 1 µm.
vec3 of_wavelength(vec2 uv, float z, float cos_half, float wavelength, int light)
{
    float reflected = reflectance_at(cos_half, 2.0 * PI / wavelength);
    return window_power(uv, z, wavelength) * reflected * response(wavelength, light);
}
