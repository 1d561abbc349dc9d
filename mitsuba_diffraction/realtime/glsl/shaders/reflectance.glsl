// Reflectance of a flat surface, and energy conservation.

// The preprocessor removes the code of features that a surface lacks: software rasterisers execute
// both sides of a branch on a uniform, and a loop's body at least once. Code that all fragments run
// has no branches, which saves Mesa's rasteriser 40 % of the time.
#define PERFECT 0
#define DIELECTRIC 1
#define CONDUCTOR 2

uniform vec2 wavenumbers;        // ends of the visible range, rad/µm
uniform vec3 channel_wavenumbers;  // at the mean wavelengths of red, green and blue, rad/µm

// `reflectance` is R in linear sRGB, under daylight. R at one wavenumber is the product of
// `reflectance_at_all` for all wavenumbers and `reflectance_at` for this wavenumber.

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

float reflectance_at_all(float cos_i) { return 1.0; }

// Row of the wavenumber nearest to k.
int row_at(float k)
{
    float last = float(textureSize(reflectances, 0).y - 2);
    float place = (k - wavenumbers.x) / (wavenumbers.y - wavenumbers.x);
    return int(clamp(place, 0.0, 1.0) * last + 0.5);
}

float reflectance_at(float cos_i, float k) { return in_row(reflectances, cos_i, row_at(k)).r; }

#else

#if SURFACE_KIND == DIELECTRIC
uniform float eta;               // index inside over index outside
vec3 reflectance(float cos_i) { return vec3(interface_reflectance(cos_i, eta)); }
#else
vec3 reflectance(float cos_i) { return vec3(1.0); }
#endif

vec3 tinted(vec3 colour) { return colour; }  // R is nearly constant within a channel
float reflectance_at_all(float cos_i) { return reflectance(cos_i).r; }
float reflectance_at(float cos_i, float k) { return 1.0; }

#endif

// ---------------------------------------------------------------- energy

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

// Albedo less the flat interface's reflectance; the tangential part is in the patch's frame.
vec3 albedo_excess(vec2 tangential, float cosine)
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

// Energy scale s of a direction, less at the horizon; the tangential part is in the patch's frame.
float energy_scale(vec2 tangential, float cosine)
{
    vec2 cell = on_grid(tangential, cosine);
    return ON_PAGES(energy_on_page, cell) * horizon_attenuation(cosine);
}

#endif
