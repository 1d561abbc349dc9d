// `spectral`: a loop over wavelengths in the table of powers, with the light's spectrum.
//
// The orders of a direction pair (u, v) lie near the ray k (u, v). With F(k) the light's response
// times an order's power at κ = k z, the result is ∫ Σ_j exp(−σ²|k (u, v) − q_j|²) F_j(k) dk.
// Far from the mirror direction lobes are narrow in k, and the loop steps from order to order along
// the ray: ∫ = exp(−σ² q⊥²) √π/(σr) · mean of F_j over the lobe, with q⊥ the order's distance from
// the ray. Two points at one standard deviation yield that mean to third order. Orders across the
// ray at one step share their mean wavelength. Near the mirror direction lobes are wide, and the
// loop steps in k.

#define SKIPS_UNLIT  // skip unlit fragments, so that loops can end early

uniform sampler2D orders;        // TEXELS texels per order: terms of its series in κ
uniform sampler2D functions;     // factors of all terms over κ, and |a₀|²: TEXELS + 1 texels at
                                 // each end of `cells` cells per interval
uniform ivec2 last_order;        // orders run from −last to last
uniform vec2 spacing;            // spacing of orders, rad/µm
uniform float sigma;
uniform float order_0_ratio;     // (σ₀/σ)² of order 0's window, the light's
uniform float interval_length;
uniform int intervals;
uniform int cells;
uniform float inverse_scale;

const float REACH = 2.6;         // half width of a lobe in 1/σ: erfc(2.6) = 2e-4 is left out

int interval_of(float kappa)
{
    return int(clamp(floor(kappa / interval_length), 0.0, float(intervals - 1)));
}

// Compute the weights of the terms, and return the power of order 0.
float series(float kappa, int interval, out vec4 weights[TEXELS])
{
    float offset = clamp(kappa / interval_length - float(interval), 0.0, 1.0);
    float fading = interval == 0 ? offset * offset : 1.0;  // powers are proportional to κ² near 0
    float place = offset * float(cells);
    int cell = min(int(place), cells - 1);
    float t = place - float(cell);
    int texel = (interval * (cells + 1) + cell) * (TEXELS + 1);
    for (int n = 0; n < TEXELS; ++n) {
        vec4 low = entry(functions, texel + n);
        weights[n] = fading * mix(low, entry(functions, texel + TEXELS + 1 + n), t);
    }
    float low = entry(functions, texel + TEXELS).x;
    return mix(low, entry(functions, texel + 2 * TEXELS + 1).x, t);
}

int first_texel(int interval, ivec2 order)
{
    ivec2 size = 2 * last_order + 1;
    ivec2 place = order + last_order;
    return ((interval * size.y + place.y) * size.x + place.x) * TEXELS;
}

vec3 from_order_to_order(vec2 uv, float r, float z, float cos_half, int light)
{
    vec2 rate = uv / spacing;  // orders per rad/µm along either axis
    bool steep = abs(rate.y) > abs(rate.x);
    // x: the axis whose orders the ray crosses faster; y: the other axis
    vec2 rates = steep ? rate.yx : rate;
    vec2 steps = steep ? spacing.yx : spacing;
    vec2 direction = (steep ? uv.yx : uv) / r;
    ivec2 last = steep ? last_order.yx : last_order;

    float reach = REACH / (sigma * steps.y * abs(direction.x));      // orders across the ray
    float shift = direction.y * steps.y / r;                         // change of k per order across
    float margin = reach * abs(shift);
    vec2 ends = rates.x * vec2(wavenumbers.x - margin, wavenumbers.y + margin);
    int first = max(int(ceil(min(ends.x, ends.y))), -last.x);
    int end = min(int(floor(max(ends.x, ends.y))), last.x);
    float falloff = sigma * steps.y * direction.x;
    float squared_falloff = falloff * falloff;
    float step_factor = exp(-2.0 * squared_falloff);
    ivec2 size = 2 * last_order + 1;
    int stride = TEXELS * (steep ? 1 : size.x);  // texels per order across

    float deviation = sqrt(0.5) / (sigma * r);

    vec3 sum = vec3(0.0);
    vec4 weights_low[TEXELS];
    vec4 weights_high[TEXELS];
    for (int n = first; n <= end; ++n) {
        float k = float(n) / rates.x;
        float centre = k * rates.y;
        int interval = interval_of(k * z);
        series((k - deviation) * z, interval, weights_low);
        series((k + deviation) * z, interval, weights_high);
        int low = max(int(ceil(centre - reach)), -last.y);
        int high = min(int(floor(centre + reach)), last.y);
        vec2 power = vec2(0.0);
        vec2 moment = vec2(0.0);  // power times the order's distance across the ray
        int texel = first_texel(interval, steep ? ivec2(low, n) : ivec2(n, low));
        // exp(−f²x²) at x, x + 1, …: the ratios of neighbours are a geometric series
        float across = float(low) - centre;
        float weight = exp(-squared_falloff * across * across);
        float factor = exp(-squared_falloff * (2.0 * across + 1.0));
        for (int m = low; m <= high; ++m) {
            vec2 value = vec2(0.0);
            for (int i = 0; i < TEXELS; ++i) {
                vec4 terms = entry(orders, texel + i);
                value += vec2(dot(terms, weights_low[i]), dot(terms, weights_high[i]));
            }
            value *= weight;
            power += value;
            moment += value * across;
            across += 1.0;
            weight *= factor;
            factor *= step_factor;
            texel += stride;
        }
        vec2 mean = clamp(moment / max(power, 1e-20), -reach, reach);
        vec2 at = k + mean * shift + vec2(-deviation, deviation);
        sum += power.x * boundary_at(cos_half, at.x, r, z) * response(at.x, light)
             + power.y * boundary_at(cos_half, at.y, r, z) * response(at.y, light);
    }
    return sum * (0.5 * inverse_scale * sqrt(PI) / (sigma * r));
}

// Power times reflectance at one wavenumber, summed over all orders in reach.
float reflected_at(vec2 uv, float r, float z, float k, float cos_half)
{
    vec2 falloff = sigma * spacing;
    float step_factor = exp(-2.0 * falloff.x * falloff.x);
    vec4 weights[TEXELS];
    int interval = interval_of(k * z);
    float specular = series(k * z, interval, weights);
    vec2 place = k * uv / spacing;
    float reach = REACH / falloff.y;
    int low = max(int(ceil(place.y - reach)), -last_order.y);
    int high = min(int(floor(place.y + reach)), last_order.y);
    float power = 0.0;
    for (int y = low; y <= high; ++y) {
        float apart = falloff.y * (float(y) - place.y);
        float width = sqrt(max(REACH * REACH - apart * apart, 0.0)) / falloff.x;  // half a chord
        int first = max(int(ceil(place.x - width)), -last_order.x);
        int last = min(int(floor(place.x + width)), last_order.x);
        float from = falloff.x * (float(first) - place.x);
        float weight = exp(-apart * apart - from * from);
        float factor = exp(-falloff.x * (2.0 * from + falloff.x));
        int texel = first_texel(interval, ivec2(first, y));
        for (int x = first; x <= last; ++x) {
            float value = 0.0;
            for (int i = 0; i < TEXELS; ++i) value += dot(entry(orders, texel + i), weights[i]);
            power += weight * value;
            weight *= factor;
            factor *= step_factor;
            texel += TEXELS;
        }
    }
    power *= inverse_scale;
    float apart = sigma * k * r;
    float reflected = power * boundary_at(cos_half, k, r, z);
#ifdef ORDER_0
    float sigma_0 = sigma * sqrt(order_0_ratio);
    float lobe = order_0_ratio * exp(-order_0_ratio * apart * apart);
    reflected += lobe * specular * mirror_at(k, sigma_0);
#ifdef COATED
    reflected += lobe * face_at(k, sigma_0);
#endif
#endif
    return reflected;
}

vec3 from_wavelength_to_wavelength(vec2 uv, float r, float z, float cos_half, int light)
{
    float deviation = sqrt(0.5) / (sigma * max(r, 1e-6));
    int count = int(ceil((wavenumbers.y - wavenumbers.x) / min(LARGEST_STEP, 1.5 * deviation)));
    float delta = (wavenumbers.y - wavenumbers.x) / float(count);
    vec3 sum = vec3(0.0);
    for (int n = 0; n < count; ++n) {
        float k = wavenumbers.x + (float(n) + 0.5) * delta;
        sum += reflected_at(uv, r, z, k, cos_half) * response(k, light);
    }
    return sum * delta;
}

#ifdef MONOCHROME

uniform float wavenumber;        // wavenumber of monochromatic light, rad/µm

vec3 diffracted(vec2 uv, float z, float cos_half, int light)
{
    float k = wavenumber / (2.0 * PI);
    return light_colour[light] * k * k * reflected_at(uv, length(uv), z, wavenumber, cos_half);
}

#else

// R ⟨|P|²⟩ / (4π²σ⁴ λ²) over the light's wavelengths, linear sRGB, 1/µm².
vec3 diffracted(vec2 uv, float z, float cos_half, int light)
{
    float r = length(uv);
    if (r * sigma * WIDEST_LOBE > sqrt(0.5)) return from_order_to_order(uv, r, z, cos_half, light);
    return from_wavelength_to_wavelength(uv, r, z, cos_half, light);
}

#endif
