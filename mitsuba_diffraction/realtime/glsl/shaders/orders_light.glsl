// Light of all solved orders under the coherence window, like orders/bsdf/lobes.py:
// f = Σ_m η_m (k²σ²/π) exp(−σ²|q − q_m|²), order 0 times C(X_i) C(X_o) of optics/mirror.py.

#define SKIPS_UNLIT  // skip unlit fragments, so that loops can end early

uniform float sigma;             // standard deviation of the amplitude window, µm

const float FAR = 18.0;          // squared distance from a lobe's centre, in its widths, where it is 0

// Lobes of all orders of one wavenumber, from a look-up at it: f without the cosine.
float orders_at(vec2 uv, float k)
{
    find_row(2.0 * PI / k);
    vec2 place = uv * (k * period / (2.0 * PI));
    float sharpness = pow(2.0 * PI * sigma / period, 2.0);
    float reach = sqrt(FAR / sharpness);
    int last = int(floor(place.x + reach));
    float sum = 0.0;
    for (int m = int(ceil(place.x - reach)); m <= last; ++m) {
        float lobe = order_lobe(place.x - float(m), place.y, sharpness);
        if (m == 0) lobe *= visible(k, sigma);
        if (lobe > exp(-FAR)) sum += lobe * efficiency_of(float(m));
    }
    return sum * lobe_peak(k, sigma);
}

#if defined(MONOCHROME)

uniform float wavenumber;        // wavenumber of monochromatic light, rad/µm

vec3 all_orders(vec2 uv, int light) { return light_colour[light] * orders_at(uv, wavenumber); }

#else

#ifdef DAYLIGHT

uniform sampler2D daylight;       // linear sRGB of a lobe: columns over its k, rows over its variance
uniform vec2 daylight_waves;      // k of the first and last column, rad/µm
uniform vec2 daylight_variances;  // variance of the first and last row
uniform sampler2D order_0;        // linear sRGB of wavelengths that order 0 is summed over, and these

vec3 daylight_at(float k, float variance)
{
    vec2 size = vec2(textureSize(daylight, 0));
    vec2 low = vec2(daylight_waves.x, daylight_variances.x);
    vec2 place = (vec2(k, variance) - low) / (vec2(daylight_waves.y, daylight_variances.y) - low);
    return textureLod(daylight, (clamp(place, 0.0, 1.0) * (size - 1.0) + 0.5) / size, 0.0).rgb;
}

// All lobes, summed over daylight (orders/daylight.py).
vec3 all_orders(vec2 uv, int light)
{
    uv.x = abs(uv.x) < 1e-4 ? 1e-4 : uv.x;
    float square = dot(uv, uv), step = wavenumber_step(uv.x, uv.y, period);
    float falloff = lobe_falloff(uv.x, uv.y, sigma, period);
    float first = max(ceil(daylight_waves.x / step), 1.0);
    float last = min(floor(daylight_waves.y / step), sqrt(FAR / max(falloff, 1e-8)));
    vec3 sum = vec3(0.0);
    for (float m = first; m <= last; ++m) {
        float k = m * step;
        find_row(2.0 * PI / k);
        sum += exp(-falloff * m * m) * efficiency_of(sign(uv.x) * m)
             * daylight_at(k, 0.5 / (sigma * sigma * square));
    }
    sum *= sigma * inversesqrt(square * PI);
    int nodes = textureSize(order_0, 0).x;
    float longest = 2.0 * PI * sigma / texelFetch(order_0, ivec2(nodes - 1, 0), 0).w;
    if (square * longest * longest < FAR)
        for (int n = 0; n < nodes; ++n) {
            vec4 node = texelFetch(order_0, ivec2(n, 0), 0);
            float k = 2.0 * PI / node.w;
            find_row(node.w);
            sum += node.rgb * (lobe_peak(k, sigma) * exp(-square * sigma * sigma * k * k)
                               * visible(k, sigma) * efficiency_of(0.0));
        }
    return light_colour[light] * sum;
}

#else

// All lobes under the light's spectrum. Far from the mirror direction they are narrow in k: two points
// at one standard deviation yield a lobe's mean to third order. Near it, the loop steps in k.
vec3 all_orders(vec2 uv, int light)
{
    float r = max(length(uv), 1e-6), deviation = sqrt(0.5) / (sigma * r);
    vec3 sum = vec3(0.0);
    if (deviation < WIDEST_LOBE) {
        uv.x = abs(uv.x) < 1e-4 ? 1e-4 : uv.x;
        float step = wavenumber_step(uv.x, uv.y, period);
        float falloff = lobe_falloff(uv.x, uv.y, sigma, period);
        float first = max(ceil((wavenumbers.x - 3.0 * deviation) / step), 1.0);
        float last = min(floor((wavenumbers.y + 3.0 * deviation) / step), sqrt(FAR / max(falloff, 1e-8)));
        for (float m = first; m <= last; ++m) {
            vec3 mean = vec3(0.0);
            for (int side = -1; side <= 1; side += 2) {
                float k = m * step + float(side) * deviation;
                find_row(2.0 * PI / k);
                mean += efficiency_of(sign(uv.x) * m) * response(k, light);
            }
            sum += exp(-falloff * m * m) * mean;
        }
        return sum * (2.0 * PI * sqrt(PI) * sigma / r);
    }
    int count = int(ceil((wavenumbers.y - wavenumbers.x) / min(LARGEST_STEP, 1.5 * deviation)));
    float delta = (wavenumbers.y - wavenumbers.x) / float(count);
    for (int n = 0; n < count; ++n) {
        float k = wavenumbers.x + (float(n) + 0.5) * delta;
        sum += orders_at(uv, k) * response(k, light) / (k * k);
    }
    return sum * (4.0 * PI * PI * delta);
}

#endif
#endif

// f·cosθ times the light's irradiance.
vec3 diffraction(vec3 wi, vec3 wo, vec2 rotation, int light)
{
    begin_orders(wi, rotation);
    mirror_ends = vec2(wi.z, wo.z);
    return wo.z * all_orders(in_patch(wi + wo, rotation), light);
}
