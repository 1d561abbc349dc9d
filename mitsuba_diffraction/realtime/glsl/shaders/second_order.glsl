// Second order: the factor of light that is diffracted twice on the power of an order, like
// plugin/second_order.py.

uniform sampler2D second_coefficients;  // c: one page per θi, rows over θo, columns over azimuth
uniform sampler2D slope_ratios;   // r: one page per κ, rows over q_y, columns over q_x
uniform vec3 ratio_size;          // numbers of nodes of q_x, q_y and κ
uniform vec3 ratio_steps;         // nodes per rad/µm
uniform vec3 ratio_zero;          // nodes of q_x = 0, q_y = 0 and κ = 0
uniform vec2 ratio_orders;        // 1 along axes where every node is one order

#if SURFACE_KIND == DIELECTRIC
#define OWN_INDEX eta
#else
#define OWN_INDEX vec2(channel_eta.x, 0.0)
#endif

vec4 pair_coefficients;

// Interpolate between pages that lie one below another; size and place are in nodes.
vec4 on_pages(sampler2D pages, vec3 size, vec3 place)
{
    place = clamp(place, vec3(0.0), size - 1.0);
    vec2 texel = 1.0 / vec2(size.x, size.y * size.z);
    vec2 at = (place.xy + 0.5) * texel;
    float page = size.y * texel.y;
#ifdef GLANCE  // only the nearest page
    return textureLod(pages, at + vec2(0.0, floor(place.z + 0.5) * page), 0.0);
#else
    float lower = min(floor(place.z), size.z - 2.0);
    at.y += lower * page;
    vec4 low = textureLod(pages, at, 0.0);
    return mix(low, textureLod(pages, at + vec2(0.0, page), 0.0), place.z - lower);
#endif
}

// Look up the coefficients of a pair of directions above the structure.
void begin_second_order(vec3 wi, vec3 wo)
{
    vec3 cosines = vec3(azimuth_cosine(wi, wo), wo.z, wi.z);
    vec3 angles = 1.0 - sign(cosines) * elevations(abs(cosines));  // angles over π/2
    vec3 place = angles * vec3(0.5, 1.0, 1.0) * (COEFFICIENT_NODES - 1.0);
    pair_coefficients = on_pages(second_coefficients, vec3(COEFFICIENT_NODES), place);
}

// |1 + s (c_l r_l + c_t r_t)|² at a wavenumber.
float second_order(vec2 uv, float r, float k, float z)
{
    vec3 place = k * vec3(uv, z) * ratio_steps + ratio_zero;
    place.xy = mix(place.xy, floor(place.xy + 0.5), ratio_orders);
    vec4 ratios = on_pages(slope_ratios, ratio_size, place);
    float weight = small_slope_weight(k * z, height_statistic(k * r), normal_reflectance(OWN_INDEX));
    vec4 c = pair_coefficients;
    weight *= height_scale * height_scale / patch_area;
    return 1.0 + added_power(c.x, c.y, c.z, c.w, ratios.x, ratios.y, ratios.z, ratios.w, weight);
}
