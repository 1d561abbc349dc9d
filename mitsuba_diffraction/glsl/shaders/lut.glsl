// `lut`: the colours of daylight, summed over all wavelengths beforehand; the twin of
// plugin/rgb_lookup.py. Rings even in ln r with azimuths of their own, a series of five terms in z.

uniform sampler2D colours;      // four texels a bin: term t of channel c is number 5c + t
uniform sampler2D rings;        // first bin and azimuths of a ring, and of the next one
uniform sampler2D glossy;       // order 0: radii × zs
uniform int bins;               // of one interval of z
uniform int last_ring;
uniform float smallest_radius;
uniform float ring_step;        // in ln r
uniform float interval_length;
uniform int intervals;
uniform float inverse_scale;
uniform vec2 glossy_steps;      // 1/µm… of radius and z: entries per unit
uniform ivec2 glossy_size;      // radii, zs

void add_azimuth(float start, float azimuths, float turn, float share, int interval,
                 inout vec4 a, inout vec4 b, inout vec4 c, inout vec4 d)
{
    float x = turn * azimuths;
    float lower = min(floor(x), azimuths - 1.0);
    float t = min(x - lower, 1.0);
    int bin = 4 * (interval * bins + int(start) + int(lower));
    vec2 weight = share * vec2(1.0 - t, t);
    a += weight.x * entry(colours, bin) + weight.y * entry(colours, bin + 4);
    b += weight.x * entry(colours, bin + 1) + weight.y * entry(colours, bin + 5);
    c += weight.x * entry(colours, bin + 2) + weight.y * entry(colours, bin + 6);
    d += weight.x * entry(colours, bin + 3) + weight.y * entry(colours, bin + 7);
}

vec3 other_orders(vec2 uv, float squared_radius, float z)
{
    float position = z / interval_length;
    int interval = int(clamp(floor(position), 0.0, float(intervals - 1)));
    float offset = position - float(interval);
    float t = clamp(2.0 * offset - 1.0, -1.0, 1.0);
#ifdef COHERENT
    float fade = interval == 0 ? offset : 1.0;
#else
    float fade = interval == 0 ? offset * offset : 1.0;
#endif
    float t2 = 2.0 * t * t - 1.0;
    float t3 = 2.0 * t * t2 - t;
    float t4 = 2.0 * t * t3 - t2;

    float squared_smallest = smallest_radius * smallest_radius;
    float ring = log(max(squared_radius, 0.25 * squared_smallest) / squared_smallest) * (0.5 / ring_step);
    ring = max(ring, 0.0);
    float lower = min(floor(ring), float(last_ring - 1));
    float share = min(ring - lower, 1.0);
    float turn = atan(uv.y, uv.x) * (0.5 / PI);
    if (turn < 0.0) turn += 1.0;

    vec4 pair = entry(rings, int(lower));
    vec4 a = vec4(0.0), b = vec4(0.0), c = vec4(0.0), d = vec4(0.0);
    add_azimuth(pair.x, pair.y, turn, 1.0 - share, interval, a, b, c, d);
    add_azimuth(pair.z, pair.w, turn, share, interval, a, b, c, d);
    vec4 first = vec4(1.0, t, t2, t3);
    vec3 sum = vec3(dot(a, first) + b.x * t4,
                    dot(vec4(b.yzw, c.x), first) + c.y * t4,
                    dot(vec4(c.zw, d.xy), first) + d.z * t4);
    return sum * (fade * inverse_scale);
}

// The glossy reflection, bright within a degree or so: a loop of one step, so that rasterisers in
// software skip it elsewhere.
vec3 order_0(float radius, float z)
{
    vec2 last = vec2(glossy_size) - 1.0;
    vec2 position = vec2(radius, z) * glossy_steps;
    vec3 colour = vec3(0.0);
    for (int n = 0; n < (position.x < last.x ? 1 : 0); ++n) {
        vec2 lower = min(floor(position), last - 1.0);
        vec2 t = clamp(position - lower, 0.0, 1.0);
        int index = int(lower.x) * glossy_size.y + int(lower.y);
        vec3 inner = mix(entry(glossy, index).rgb, entry(glossy, index + 1).rgb, t.y);
        index += glossy_size.y;
        vec3 outer = mix(entry(glossy, index).rgb, entry(glossy, index + 1).rgb, t.y);
        colour = mix(inner, outer, t.x);
    }
    return colour;
}

// R ⟨|P|²⟩ / (4π²σ⁴ λ²) over the light's wavelengths, linear sRGB, 1/µm².
vec3 diffracted(vec2 uv, float z, float cos_half, int light)
{
    float squared_radius = dot(uv, uv);
    vec3 colour = other_orders(uv, squared_radius, z) + order_0(sqrt(squared_radius), z);
    return reflectance(cos_half) * light_colour[light] * colour;
}
