// Efficiencies of solved orders, like orders/lookup.py, in tiles of a texture (shading/orders.py).

uniform sampler2D efficiencies;
uniform float tau_cells;         // cells of a tile along τ, ρ and w
uniform float rho_cells;
uniform float w_cells;
uniform float tiles_across;      // tiles in a row of the texture
uniform float last_band;
uniform float period;            // µm
uniform float superstrate;       // index of the clear layer over the grooves
uniform float kept;              // most that the grooves send back, see optics/coat.py
uniform float least_c;           // least c of light from outside the layer
uniform float shortest;          // shortest and longest wavelength of the table, µm
uniform float longest;
uniform float shortest_lit;      // ends of the light that it reflects, µm
uniform float longest_lit;

// Row of efficiencies of one direction and wavelength (OrderRow of shading/orders.py).
vec2 row_incident;               // tangential part of ωi in the patch's frame
float row_wavelength;            // in vacuum, µm
float row_face;                  // share of the light that the layer's face reflects
float row_entering;              // `passage` of the rest
float row_lit, row_channel, row_channels, row_tile;
vec3 row_place;                  // τ, ρ and w

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
    order_row(row_incident.x, row_incident.y, wavelength, period, superstrate, last_band, least_c,
              shortest, longest, shortest_lit, longest_lit, row_lit, row_channel, row_channels,
              row_tile, row_place);
}

// Interpolate the row's efficiency towards channel q; the sum of all is beyond the last one.
float efficiency_towards(float q)
{
    vec3 at = order_texel(row_tile + q, row_place.x, row_place.y, row_place.z,
                          tau_cells, rho_cells, w_cells, tiles_across);
    vec4 four = textureLod(efficiencies, at.xy / vec2(textureSize(efficiencies, 0)), 0.0);
    vec4 apart = abs(at.z - vec4(0.0, 1.0, 2.0, 3.0));
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
