// Reflectance of a flat surface, and energy conservation.

// The preprocessor removes the code of features that a surface lacks: software rasterisers execute
// both sides of a branch on a uniform, and a loop's body at least once. Code that all fragments run
// has no branches, which saves Mesa's rasteriser 40 % of the time.
#define PERFECT 0
#define DIELECTRIC 1
#define CONDUCTOR 2

uniform vec2 wavenumbers;        // ends of the visible range, rad/µm
uniform vec3 channel_wavenumbers;  // at the mean wavelengths of red, green and blue, rad/µm

// `reflectance` is R in linear sRGB, under daylight, and `reflectance_at` R at one wavenumber.

#if SURFACE_KIND == CONDUCTOR

uniform sampler2D reflectances;  // columns over cosθ, rows over k, the last row in linear sRGB; the
                                 // other channels have the index n + ik of the row
uniform vec3 channel_eta;        // the index at the mean wavelengths of red, green and blue
uniform vec3 channel_k;
uniform vec3 tint_0, tint_1, tint_2;  // columns of optics/colour.py's metal_tint

vec3 reflectance(float cos_i)
{
    return in_row(reflectances, cos_i, textureSize(reflectances, 0).y - 1).rgb;
}

vec3 tinted(vec3 colour) { return tint_0 * colour.r + tint_1 * colour.g + tint_2 * colour.b; }

// Row of the wavenumber nearest to k.
int row_at(float k)
{
    float last = float(textureSize(reflectances, 0).y - 2);
    float place = (k - wavenumbers.x) / (wavenumbers.y - wavenumbers.x);
    return int(clamp(place, 0.0, 1.0) * last + 0.5);
}

float reflectance_at(float cos_i, float k) { return in_row(reflectances, cos_i, row_at(k)).r; }
vec2 index_at(float k) { return texelFetch(reflectances, ivec2(0, row_at(k)), 0).yz; }
vec2 channel_index(int n) { return vec2(channel_eta[n], channel_k[n]); }

#else

#if SURFACE_KIND == DIELECTRIC
uniform float eta;               // index inside over index outside
float reflectance_at(float cos_i, float k) { return interface_reflectance(cos_i, eta); }
float index_at(float k) { return eta; }
float channel_index(int n) { return eta; }
#else
float reflectance_at(float cos_i, float k) { return 1.0; }
#endif

vec3 reflectance(float cos_i) { return vec3(reflectance_at(cos_i, 0.0)); }
vec3 tinted(vec3 colour) { return colour; }  // R is nearly constant within a channel

#endif

// ---------------------------------------------------------------- energy

#ifdef GRID_POLAR

uniform float energy_page;     // fractional number of the page; each page is for one height scale
uniform sampler2D directions;  // albedo less the flat interface's reflectance, and s less 1: rows of
                               // all pages over the polar angle, columns over the azimuth, periodic

// Values of a page at a fractional row and column.
vec4 on_page(int page, vec2 cell)
{
    float row = float(page * (GRID_POLAR + 1)) + clamp(cell.x, 0.0, float(GRID_POLAR));
    return texture(directions, (vec2(cell.y, row) + 0.5) / vec2(textureSize(directions, 0)));
}

// Values of a direction, whose tangential part is in the patch's frame (tables/directional.py).
vec4 of_direction(vec2 tangential, float cosine)
{
    float remaining = max(elevations(vec3(cosine)).x, 0.0);
    vec2 cell = vec2((1.0 - sqrt(remaining)) * (float(GRID_POLAR) / GRID_SHARE),
                     turn_of(tangential) * float(GRID_AZIMUTHAL));
#if GRID_PAGES > 1
    int lower = int(clamp(floor(energy_page), 0.0, float(GRID_PAGES - 2)));
    float share = clamp(energy_page - float(lower), 0.0, 1.0);
    return mix(on_page(lower, cell), on_page(lower + 1, cell), share);
#else
    return on_page(0, cell);
#endif
}

#endif

#ifdef ENERGY_CONSERVING

// Energy scale s of a direction, less at the horizon.
float energy_scale(vec2 tangential, float cosine)
{
    return (1.0 + of_direction(tangential, cosine).a) * horizon_attenuation(cosine);
}

#endif
