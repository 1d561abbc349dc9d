// `fast`: colours under daylight, summed over all wavelengths in advance, like plugin/rgb.py. Bins
// lie on rings even in ln r, each with its number of azimuths; a bin is a series of five terms in z.

uniform sampler2D colours;      // two texels per bin: term t of channel c is number 5c + t
uniform sampler2D rings;        // first bin of a ring; azimuths of the ring and the next one
uniform sampler2D glossy;       // order 0: columns over z, rows over the radius
uniform int bins;               // number of bins in one interval of z
uniform int last_ring;
uniform float smallest_radius;
uniform float ring_step;        // step in ln r
uniform float interval_length;
uniform int intervals;
uniform float inverse_scale;
uniform vec2 glossy_ends;       // z and radius of the last entries
uniform float glossy_scale;     // colour of 1
uniform float sigma_0;          // of order 0's window, µm

void add_bin(int bin, float weight, inout mat4 sum)
{
    vec4 low = entry(colours, bin);
    vec4 high = entry(colours, bin + 1);
    sum += weight * mat4(upper_halves(low.x), upper_halves(low.y), upper_halves(low.z),
                         upper_halves(low.w), upper_halves(high.x), upper_halves(high.y),
                         upper_halves(high.z), upper_halves(high.w));
}

void add_azimuth(int start, float azimuths, float turn, float share, inout mat4 sum)
{
    float x = turn * azimuths;
    float lower = min(floor(x), azimuths - 1.0);
    float t = share * min(x - lower, 1.0);
    int bin = 2 * (start + int(lower));
    add_bin(bin, share - t, sum);
    add_bin(bin + 2, t, sum);
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
    float turn = turn_of(uv);

    vec3 ring_bins = entry(rings, int(lower)).xyz;
    float azimuths = ring_bins.y;
    int start = interval * bins + int(ring_bins.x);
    mat4 terms = mat4(0.0);  // of red, green and blue, five each
    int next = start + int(azimuths) + 1;  // a ring repeats its first bin at its end
#ifdef GLANCE  // the nearest alone: a picture that is gone at once
    float count = share > 0.5 ? ring_bins.z : azimuths;
    add_bin(2 * ((share > 0.5 ? next : start) + int(turn * count + 0.5)), 1.0, terms);
#else
    add_azimuth(start, azimuths, turn, 1.0 - share, terms);
    add_azimuth(next, ring_bins.z, turn, share, terms);
#endif
    vec4 first = vec4(1.0, t, t2, t3);
    vec3 sum = vec3(dot(terms[0], first) + terms[1].x * t4,
                    dot(vec4(terms[1].yzw, terms[2].x), first) + terms[2].y * t4,
                    dot(vec4(terms[2].zw, terms[3].xy), first) + terms[3].z * t4);
    return sum * (fade * inverse_scale);
}

// Order 0, whose lobe is about a degree wide; the last radius is dark.
vec3 order_0(float radius, float z)
{
    float last = float(textureSize(glossy, 0).y - 1), place = min(radius / glossy_ends.y, 1.0) * last;
    float lower = min(floor(place), last - 1.0), share = z / glossy_ends.x;
    vec4 inner = in_row(glossy, share, int(lower)), outer = in_row(glossy, share, int(lower) + 1);
    return glossy_scale * mix(inner.rgb, outer.rgb, place - lower);
}

#ifdef COHERENT

// |o + c|² of orders of one window, c of order 0, from |o + c|² − |c|² and |c|², each with its factor:
// o is taken in phase with c, or opposite. Colours outside the gamut do not interfere.
vec3 interfering(vec3 others, vec3 zeroth, vec3 factor, vec3 mirrored)
{
    const vec3 least = vec3(1e-18);
    vec3 total = others + zeroth, outside = clamp(total, min(zeroth, 0.0), max(zeroth, 0.0));
    vec3 apart = sqrt(max(total, least)) - sqrt(max(zeroth, least));
    vec3 sum = apart * sqrt(factor) + sqrt(max(zeroth, least) * mirrored);
    vec3 both = vec3(greaterThan(min(total, zeroth), least));
    return mix((total - outside) * factor + outside * mirrored, sum * sum, both);
}

#endif

// R ⟨|P|²⟩ / (4π²σ⁴ λ²) over the light's wavelengths, linear sRGB, 1/µm².
vec3 diffracted(vec2 uv, float z, float cos_half, int light)
{
    float r = length(uv);
    vec3 others = other_orders(uv, r * r, z), factor = boundary(cos_half, r, z);
#if defined(ORDER_0) && defined(COHERENT)
    vec3 colour = interfering(others, order_0(r, z), factor, mirror(cos_half, sigma_0));
#elif defined(ORDER_0)
    vec3 colour = others * factor + order_0(r, z) * mirror(cos_half, sigma_0);
#else
    vec3 colour = others * factor;
#endif
    colour = tinted(colour);
#if defined(ORDER_0) && defined(COATED)
    colour += order_0(r, 0.0) * face(sigma_0);
#endif
    return light_colour[light] * colour;
}
