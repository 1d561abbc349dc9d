// Functions that all methods share: lists, reflectance, shadowing, energy conservation.

const float PI = 3.14159265358979;

// Entry i of a list, which is stored in rows of PAGE = 2^PAGE_BITS texels.
vec4 entry(sampler2D list, int i)
{
    return texelFetch(list, ivec2(i & (PAGE - 1), i >> PAGE_BITS), 0);
}

#ifndef FLOAT_TEXTURES

uvec4 entry(usampler2D list, int i)
{
    return texelFetch(list, ivec2(i & (PAGE - 1), i >> PAGE_BITS), 0);
}

// Two floats whose upper halves a word stores.
vec2 upper_halves(uint word)
{
    return uintBitsToFloat(uvec2(word << 16, word & 0xffff0000u));
}

#endif

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

// ---------------------------------------------------------------- reflectance

// The preprocessor removes the code of features that a surface lacks: software rasterisers execute
// both sides of a branch on a uniform, and a loop's body at least once. Code that all fragments run
// has no branches, which saves Mesa's rasteriser 40 % of the time.
#define PERFECT 0
#define DIELECTRIC 1
#define CONDUCTOR 2

uniform vec2 wavenumbers;        // ends of the visible range, rad/µm
uniform vec3 channel_wavenumbers;  // at the mean wavelengths of red, green and blue, rad/µm

#if SURFACE_KIND == DIELECTRIC

uniform float eta;               // index inside over index outside

// Unpolarised power reflectance of an interface between dielectrics (Fresnel).
float fresnel(float cos_i)
{
    // without a branch for total reflection, where cos_t = 0
    float cos_t = sqrt(max(1.0 - (1.0 - cos_i * cos_i) / (eta * eta), 0.0));
    vec2 a = vec2(cos_i, eta * cos_i);
    vec2 b = vec2(eta * cos_t, cos_t);
    vec2 below = a + b;
    vec2 crossed = (a - b) * below.yx;  // numerators over a common denominator
    return 0.5 * dot(crossed, crossed) / (below.x * below.x * below.y * below.y);
}

// R in linear sRGB, under daylight.
vec3 reflectance(float cos_i) { return vec3(fresnel(cos_i)); }
vec3 tinted(vec3 colour) { return colour; }  // R is nearly constant within a channel

// R at one wavenumber: the product of a factor for all wavenumbers and one for this wavenumber.
float reflectance_at_all(float cos_i) { return fresnel(cos_i); }
float reflectance_at(float cos_i, float k) { return 1.0; }

#elif SURFACE_KIND == CONDUCTOR

uniform sampler2D reflectances;  // columns over cosθ, rows over k, the last row in linear sRGB; the
                                 // other channels have the index n + ik of the row
uniform vec3 channel_eta;        // the index at the mean wavelengths of red, green and blue
uniform vec3 channel_k;
uniform vec3 tint_0, tint_1, tint_2;  // columns of optics/colour.py's metal_tint

vec4 conductor_row(float cos_i, int row)
{
    float last = float(textureSize(reflectances, 0).x - 1);
    float x = clamp(cos_i, 0.0, 1.0) * last;
    float lower = min(floor(x), last - 1.0);
    vec4 left = texelFetch(reflectances, ivec2(int(lower), row), 0);
    vec4 right = texelFetch(reflectances, ivec2(int(lower) + 1, row), 0);
    return mix(left, right, x - lower);
}

vec3 reflectance(float cos_i)
{
    return conductor_row(cos_i, textureSize(reflectances, 0).y - 1).rgb;
}

vec3 tinted(vec3 colour) { return tint_0 * colour.r + tint_1 * colour.g + tint_2 * colour.b; }

float reflectance_at_all(float cos_i) { return 1.0; }

float reflectance_at(float cos_i, float k)
{
    float last = float(textureSize(reflectances, 0).y - 2);
    float y = clamp((k - wavenumbers.x) / (wavenumbers.y - wavenumbers.x), 0.0, 1.0) * last;
    return conductor_row(cos_i, int(y + 0.5)).r;
}

#else

vec3 reflectance(float cos_i) { return vec3(1.0); }
vec3 tinted(vec3 colour) { return colour; }

float reflectance_at_all(float cos_i) { return 1.0; }
float reflectance_at(float cos_i, float k) { return 1.0; }

#endif

// ---------------------------------------------------------------- shadowing and energy

// Long V-shaped grooves, edges level: min(1, 2(n·h)(n·ωi)/(ωo·h), 2(n·h)(n·ωo)/(ωo·h))
// (Torrance and Sparrow 1967).
float groove_shadow(float cos_i, float cos_o, float one_plus_dot)
{
    return min(1.0, 2.0 * (cos_i + cos_o) * min(cos_i, cos_o) / max(one_plus_dot, 1e-30));
}

#ifdef GRID_POLAR

uniform float energy_page;   // fractional number of the page; each page is for one height scale

// Fractional row and column on the grid of directions (tables/energy/grid.py).
vec2 on_grid(vec2 tangential, float cosine)
{
    float remaining = max(elevations(vec3(cosine)).x, 0.0);
    return vec2((1.0 - sqrt(remaining)) * (float(GRID_POLAR) / GRID_SHARE),
                turn_of(tangential) * float(GRID_AZIMUTHAL));
}

#if GRID_PAGES > 1
#define ON_PAGES(of, place) mix(of(lower_page(), place), of(lower_page() + 1, place), \
                                clamp(energy_page - float(lower_page()), 0.0, 1.0))
int lower_page() { return int(clamp(floor(energy_page), 0.0, float(GRID_PAGES - 2))); }
#else
#define ON_PAGES(of, place) of(0, place)
#endif

#endif

#ifdef BENEATH

uniform sampler2D beneath;   // rows of all pages; columns over the azimuth, periodic

vec3 beneath_on_page(int page, vec2 cell)
{
    float row = float(page * (GRID_POLAR + 1)) + clamp(cell.x, 0.0, float(GRID_POLAR));
    return texture(beneath, (vec2(cell.y, row) + 0.5) / vec2(textureSize(beneath, 0))).rgb;
}

// Albedo over the flat interface's reflectance; the tangential part is in the patch's frame.
vec3 reflected_ratio(vec2 tangential, float cosine)
{
    vec2 cell = on_grid(tangential, cosine);
    return ON_PAGES(beneath_on_page, cell);
}

#endif

#ifdef ENERGY_CONSERVING

uniform sampler2D energy;    // s at the corners of GRID_POLAR × GRID_AZIMUTHAL cells

float energy_on_page(int page, vec2 cell)
{
    vec2 lower = clamp(floor(cell), vec2(0.0), vec2(GRID_POLAR - 1, GRID_AZIMUTHAL - 1));
    vec2 t = clamp(cell - lower, 0.0, 1.0);
    vec4 corner = entry(energy, (page * GRID_POLAR + int(lower.x)) * GRID_AZIMUTHAL + int(lower.y));
    vec2 along = mix(corner.xz, corner.yw, t.y);
    return mix(along.x, along.y, t.x);
}

// Energy scale s of a direction; the tangential part is in the patch's frame.
float energy_scale(vec2 tangential, float cosine)
{
    vec2 cell = on_grid(tangential, cosine);
    return ON_PAGES(energy_on_page, cell);
}

#endif
