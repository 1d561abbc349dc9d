// What all methods share: reading lists, the surface's reflectance, shadowing, energy, display.

const float PI = 3.14159265358979;

// Number i of a list, which lies in rows of PAGE texels.
vec4 entry(sampler2D list, int i)
{
    return texelFetch(list, ivec2(i & (PAGE - 1), i / PAGE), 0);
}

uniform vec3 light_colour[LIGHTS];  // irradiance, or intensity of a point light, linear sRGB

// ---------------------------------------------------------------- reflectance

const int PERFECT = 0;
const int DIELECTRIC = 1;
const int CONDUCTOR = 2;

uniform int surface_kind;
uniform float eta;               // of a dielectric, inside over outside
uniform sampler2D reflectances;  // of a conductor: columns over cosθ, rows over k, colours in the last
uniform vec2 wavenumbers;        // first and last row, rad/µm

// Unpolarised power reflectance of an interface between dielectrics (Fresnel).
float fresnel(float cos_i)
{
    float squared_cos_t = 1.0 - (1.0 - cos_i * cos_i) / (eta * eta);
    if (squared_cos_t <= 0.0) return 1.0;
    float cos_t = sqrt(squared_cos_t);
    float s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    float p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return 0.5 * (s * s + p * p);
}

vec4 conductor_row(float cos_i, int row)
{
    float last = float(textureSize(reflectances, 0).x - 1);
    float x = clamp(cos_i, 0.0, 1.0) * last;
    float lower = min(floor(x), last - 1.0);
    vec4 left = texelFetch(reflectances, ivec2(int(lower), row), 0);
    vec4 right = texelFetch(reflectances, ivec2(int(lower) + 1, row), 0);
    return mix(left, right, x - lower);
}

// R in linear sRGB, under daylight.
vec3 reflectance(float cos_i)
{
    if (surface_kind == DIELECTRIC) return vec3(fresnel(cos_i));
    if (surface_kind == CONDUCTOR)
        return conductor_row(cos_i, textureSize(reflectances, 0).y - 1).rgb;
    return vec3(1.0);
}

// R at one wavenumber.
float reflectance_at(float cos_i, float k)
{
    if (surface_kind == DIELECTRIC) return fresnel(cos_i);
    if (surface_kind == CONDUCTOR) {
        float last = float(textureSize(reflectances, 0).y - 2);
        float y = clamp((k - wavenumbers.x) / (wavenumbers.y - wavenumbers.x), 0.0, 1.0) * last;
        return conductor_row(cos_i, int(y + 0.5)).r;
    }
    return 1.0;
}

// ---------------------------------------------------------------- shadowing and energy

uniform bool vcavity;

// Long V-shaped grooves, edges level: min(1, 2(n·h)(n·ωi)/(ωo·h), 2(n·h)(n·ωo)/(ωo·h))
// (Torrance and Sparrow 1967).
float groove_shadow(float cos_i, float cos_o, float one_plus_dot)
{
    return min(1.0, 2.0 * (cos_i + cos_o) * min(cos_i, cos_o) / max(one_plus_dot, 1e-30));
}

uniform bool energy_conserving;
uniform sampler2D bounds;   // of the albedo, pages of (BOUND_POLAR + 1) × (BOUND_AZIMUTHAL + 1)
uniform float bound_page;   // between pages, which are for different height scales
uniform int bound_pages;

float bound_on_page(int page, vec2 cell)
{
    ivec2 lower = ivec2(clamp(floor(cell), vec2(0.0), vec2(BOUND_POLAR - 1, BOUND_AZIMUTHAL - 1)));
    vec2 t = clamp(cell - vec2(lower), 0.0, 1.0);
    int stride = BOUND_AZIMUTHAL + 1;
    int index = (page * (BOUND_POLAR + 1) + lower.x) * stride + lower.y;
    float low = mix(entry(bounds, index).r, entry(bounds, index + 1).r, t.y);
    float high = mix(entry(bounds, index + stride).r, entry(bounds, index + stride + 1).r, t.y);
    return mix(low, high, t.x);
}

// max(1, a) of a direction, given its tangential part in the patch's frame.
float albedo_bound(vec2 tangential, float cosine)
{
    float remaining = 1.0 - acos(clamp(cosine, 0.0, 1.0)) * (2.0 / PI);
    float turn = atan(tangential.y, tangential.x) * (0.5 / PI);
    if (turn < 0.0) turn += 1.0;
    vec2 cell = vec2((1.0 - sqrt(max(remaining, 0.0))) * (float(BOUND_POLAR) / BOUND_SHARE),
                     turn * float(BOUND_AZIMUTHAL));
    int page = int(clamp(floor(bound_page), 0.0, float(bound_pages - 1)));
    float bound = bound_on_page(page, cell);
    if (page + 1 < bound_pages)
        bound = mix(bound, bound_on_page(page + 1, cell), clamp(bound_page - float(page), 0.0, 1.0));
    // towards the horizon the albedo grows with 1/cos²θ
    float beyond = max(BOUND_LAST_COSINE / max(cosine, 1e-6), 1.0);
    return bound * beyond * beyond;
}

// ---------------------------------------------------------------- display

// What a display is sent (IEC 61966-2-1), clipped.
vec3 encode_srgb(vec3 linear)
{
    vec3 c = clamp(linear, 0.0, 1.0);
    return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
