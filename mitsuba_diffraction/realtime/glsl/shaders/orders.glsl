// Efficiencies of solved orders, like plugin/orders/lookup.py: the cell of the incident light
// (tables/orders/cells.py), and its tile in a texture (orders.py).

uniform sampler2D efficiencies;  // tiles of ρ × τ, side by side for groups of four w
uniform vec3 order_cells;        // cells of a tile along τ, ρ and w
uniform int order_columns;       // tiles in a row of the texture
uniform float last_band;
uniform float period;            // µm
uniform float superstrate;       // index of the clear layer over the grooves
uniform vec2 solved_range;       // shortest and longest wavelength of the table, µm
uniform vec2 solved_reach;       // ends of the light that it reflects, µm

// Row of efficiencies of one direction and wavelength (Row of plugin/orders/lookup.py).
vec2 row_incident;               // tangential part of ωi in the patch's frame
float row_wavelength;            // in vacuum, µm
float row_face;                  // share of the light that the layer's face reflects
float row_channel, row_channels;
int row_tile;
vec3 row_place;                  // τ, ρ and w
float row_lit;                   // 0 beyond the table's wavelengths, else 1

#ifdef FACE

// Unpolarised transmittance of the layer's face, for the cosine outside (Fresnel).
float through_face(float cosine)
{
    float squared = superstrate * superstrate;
    float inside = sqrt(max(cosine * cosine + squared - 1.0, 0.0));
    vec2 below = vec2(cosine + inside, squared * cosine + inside);
    return 2.0 * cosine * inside * dot(vec2(1.0, squared), 1.0 / (below * below));
}

#endif

// Begin with a direction to the eye.
void begin_orders(vec3 wi, vec2 rotation)
{
    row_incident = in_patch(wi, rotation);
    row_face = 0.0;
#ifdef FACE
    row_face = 1.0 - through_face(wi.z);
#endif
}

// Find the row of a wavelength.
void find_row(float wavelength)
{
    row_wavelength = wavelength;
    row_lit = step(solved_reach.x, wavelength) * step(wavelength, solved_reach.y);
    wavelength = max(wavelength, solved_range.x);
    vec2 mirror = vec2(-row_incident.x, row_incident.y) / superstrate;
    float c = sqrt(max(1.0 - mirror.y * mirror.y, 1e-7));
    float inverse = superstrate * period / wavelength;
    float orders = 2.0 * c * inverse;  // K of the table's cells
    float p = clamp((c - mirror.x) * inverse, 0.0, orders);
    float band = clamp(floor(orders), 0.0, last_band);
    row_channel = clamp(floor(p), 0.0, band);
    float r = clamp(orders - band, 0.0, 1.0), f = p - row_channel;
    bool kind_a = f < r || row_channel >= band;
    float t = kind_a ? f / max(r, 1e-7) : (f - r) / max(1.0 - r, 1e-7);
    row_channels = band + (kind_a ? 1.0 : 0.0);
    int k = int(band);
    int first = k * (k + 1) * (2 * k + 1) / 3 + (kind_a ? 0 : (k + 1) * (k + 2));
    row_tile = first + int(row_channel) * int(row_channels + 1.0);
    row_place.xy = elevations(vec3(sqrt(clamp(vec2(t, r), 0.0, 1.0)), 0.0)).xy;  // 2/π asin
    float longest = wavelength * 2.0 * inverse / max(orders, 1e-7);
    float shortest = longest * sqrt(1.0 - 1.0 / (superstrate * superstrate));
    vec2 ends = clamp(solved_range, shortest, longest);
    row_place.z = clamp((wavelength - ends.x) / max(ends.y - ends.x, 1e-6), 0.0, 1.0);
}

// Interpolate the row's efficiency towards channel q; the sum of all is beyond the last one.
float efficiency_towards(float q)
{
    int tile = row_tile + int(q);
    vec2 nodes = order_cells.yx + 1.0;
    float groups = order_cells.z / 3.0;  // of four w, the last of which is the next one's first
    float w = row_place.z * order_cells.z, group = min(floor(w / 3.0), groups - 1.0);
    vec2 corner = vec2(ivec2(tile % order_columns, tile / order_columns)) * nodes * vec2(groups, 1.0);
    corner.x += group * nodes.x;
    vec2 at = corner + row_place.yx * order_cells.yx + 0.5;
    vec4 four = textureLod(efficiencies, at / vec2(textureSize(efficiencies, 0)), 0.0);
    vec4 apart = abs(w - 3.0 * group - vec4(0.0, 1.0, 2.0, 3.0));
    return row_lit * dot(four, max(1.0 - apart, 0.0));
}

// Efficiency of an order of the row; 0 if it does not propagate.
float efficiency_of(float order)
{
    float q = row_channel - order;
    if (q < 0.0 || q >= row_channels) return 0.0;
#ifdef FACE
    vec2 leaving = vec2(order * row_wavelength / period - row_incident.x, row_incident.y);
    float squared = dot(leaving, leaving);
    if (squared >= 1.0) return 0.0;
    float twice = (1.0 - row_face) * through_face(sqrt(1.0 - squared));
    return twice * efficiency_towards(q) + (order == 0.0 ? row_face : 0.0);
#else
    return efficiency_towards(q);
#endif
}

// Σ η_m at the mean wavelengths of red, green and blue.
vec3 albedo(vec3 w, vec2 rotation)
{
    begin_orders(w, rotation);
    vec3 sums;
    for (int n = 0; n < 3; ++n) {
        find_row(2.0 * PI / channel_wavenumbers[n]);
        sums[n] = mix(efficiency_towards(row_channels), 1.0, row_face);
    }
    return min(sums, 1.0);
}
