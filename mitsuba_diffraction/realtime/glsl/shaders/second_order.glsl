// What light that is diffracted twice makes of orders: the twin of plugin/second_order.py.

#ifdef SECOND_ORDER

uniform sampler2D second_coefficients;  // c: a page for each θi, of θo over the azimuth between
uniform sampler2D slope_ratios;   // r: a page for each κ, of q_y over q_x
uniform vec3 ratio_size;          // nodes of q_x, q_y and κ ...
uniform vec3 ratio_steps;         // ... per rad/µm
uniform vec3 ratio_zero;          // ... and which is where they are 0
uniform vec2 ratio_orders;        // 1 where a node is one order, along x and y

vec4 pair_coefficients;
vec2 pair_uv;

// Of pages below each other; size and place are in nodes.
vec4 on_pages(sampler2D pages, vec3 size, vec3 place)
{
    place = clamp(place, vec3(0.0), size - 1.0);
    vec2 texel = 1.0 / vec2(size.x, size.y * size.z);
    vec2 at = (place.xy + 0.5) * texel;
    float page = size.y * texel.y;
#ifdef GLANCE  // the nearest page alone
    return textureLod(pages, at + vec2(0.0, floor(place.z + 0.5) * page), 0.0);
#else
    float lower = min(floor(place.z), size.z - 2.0);
    at.y += lower * page;
    vec4 low = textureLod(pages, at, 0.0);
    return mix(low, textureLod(pages, at + vec2(0.0, page), 0.0), place.z - lower);
#endif
}

// cosines: of θi, θo and the azimuth of ωo from that of −ωi.
void begin_second_order(vec3 cosines, vec2 uv)
{
    vec3 angles = 1.0 - sign(cosines) * elevations(abs(cosines));  // over π/2
    vec3 place = angles.zyx * vec3(0.5, 1.0, 1.0) * (COEFFICIENT_NODES - 1.0);
    pair_coefficients = on_pages(second_coefficients, vec3(COEFFICIENT_NODES), place);
    pair_uv = uv;
}

// |1 + s (c_l r_l + c_t r_t)|² at a wavenumber, 1 amid the lobe of order 0.
float second_order(float s, float k, float r, float z)
{
    vec3 place = k * vec3(pair_uv, z) * ratio_steps + ratio_zero;
    place.xy = mix(place.xy, floor(place.xy + 0.5), ratio_orders);
    vec4 ratios = on_pages(slope_ratios, ratio_size, place);
    vec4 c = pair_coefficients;
    vec2 added = vec2(dot(c * vec4(1.0, -1.0, 1.0, -1.0), ratios), dot(c, ratios.yxwz));
    added *= s * height_scale * height_scale;
    added *= min(1.0, SECOND_ORDER_LIMIT * inversesqrt(max(dot(added, added), 1e-20)));
    float lobe = exp(-area_factor / (4.0 * PI) * k * k * r * r);
    return 1.0 + (1.0 - lobe) * (dot(added, added) + 2.0 * added.x);
}

#else

void begin_second_order(vec3 cosines, vec2 uv) {}
float second_order(float s, float k, float r, float z) { return 1.0; }

#endif
