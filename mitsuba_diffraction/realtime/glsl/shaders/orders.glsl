// Efficiencies of solved orders, like orders/lookup.py: the cell of the incident light
// (orders/cells.py), and its tile in a texture (solved.py).

uniform sampler2D efficiencies;  // tiles of ρ × τ, side by side for groups of four w
uniform vec3 order_cells;        // cells of a tile along τ, ρ and w
uniform int order_columns;       // tiles in a row of the texture
uniform float last_band;
uniform float period;            // µm
uniform float superstrate;       // index of the clear layer over the grooves
uniform float kept;              // most that the grooves send back, see optics/coat.py
uniform float least_c;           // least c of light from outside the layer
uniform vec2 solved_range;       // shortest and longest wavelength of the table, µm
uniform vec2 solved_reach;       // ends of the light that it reflects, µm

// Row of efficiencies of one direction and wavelength (Row of orders/lookup.py).
vec2 row_incident;               // tangential part of ωi in the patch's frame
float row_wavelength;            // in vacuum, µm
float row_face;                  // share of the light that the layer's face reflects
float row_entering;              // `passage` of the rest
float row_channel, row_channels;
int row_tile;
vec3 row_place;                  // τ, ρ and w
float row_lit;                   // 0 beyond the table's wavelengths, else 1

// Begin with a direction to the eye.
void begin_orders(vec3 wi, vec2 rotation)
{
    row_incident = in_patch(wi, rotation);
    row_face = 0.0;
    row_entering = 1.0;
#ifdef FACE
    float through = face_transmittance(wi.z, superstrate);
    row_face = 1.0 - through;
    row_entering = passage(through, kept);
#endif
}

// Find the row of a wavelength.
void find_row(float wavelength)
{
    row_wavelength = wavelength;
    row_lit = step(solved_reach.x, wavelength) * step(wavelength, solved_reach.y);
    wavelength = max(wavelength, solved_range.x);
    vec2 mirror = vec2(-row_incident.x, row_incident.y) / superstrate;
    float optical_period = superstrate * period, c, orders, band, t, r, shortest, longest;
    bool kind_a;
    order_cell(mirror.x, mirror.y, optical_period / wavelength, last_band, 1e-7, c, orders, band,
               row_channel, kind_a, t, r);
    row_channels = band + (kind_a ? 1.0 : 0.0);
    int k = int(band);
    int first = k * (k + 1) * (2 * k + 1) / 3 + (kind_a ? 0 : (k + 1) * (k + 2));
    row_tile = first + int(row_channel) * int(row_channels + 1.0);
    cell_wavelengths(wavelength / c, solved_range.x, solved_range.y, least_c, shortest, longest);
    row_place = vec3(smooth_coordinate(t), smooth_coordinate(r),
                     wavelength_coordinate(wavelength, shortest, longest, 1e-6));
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
    float out_x, square;
    order_direction(row_incident.x, row_incident.y, order, row_wavelength / period, out_x, square);
    if (square <= 0.0) return 0.0;
    float leaving = passage(face_transmittance(sqrt(square), superstrate), kept);
    return row_entering * leaving * efficiency_towards(q) + (order == 0.0 ? row_face : 0.0);
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
        sums[n] = row_entering * efficiency_towards(row_channels) + row_face;
    }
    return min(sums, 1.0);
}
