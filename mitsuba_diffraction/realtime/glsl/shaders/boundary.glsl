// Boundary factor of the material, N' / (1 + ωi·ωo)². The formulas are of optics/ (formulas.py).
// Kirchhoff's factor is the reflectance at the half vector.

#ifdef COATED

uniform float coat;               // index of the coat over that of the medium above

float face_reflectance(float cosine) { return 1.0 - face_transmittance(cosine, coat); }

// Reflectance of a flat coated interface.
vec3 flat_reflectance(float cosine)
{
    vec3 beneath = reflectance(cosine_within(cosine, coat)), found;
    float face = face_reflectance(cosine);
    for (int n = 0; n < 3; ++n) found[n] = coated_reflectance(face, beneath[n]);
    return found;
}

#else

vec3 flat_reflectance(float cosine) { return reflectance(cosine); }

#endif

#ifndef BOUNDARY

void begin_pair(vec3 wi, vec3 wo, vec2 outer) {}

vec3 boundary(float cos_half, float r, float z) { return reflectance(cos_half); }
float boundary_at(float cos_half, float k, float r, float z) { return reflectance_at(cos_half, k); }

#else

#ifdef STATISTIC

uniform sampler2D statistic;      // of the heights, µm², over log2 q
uniform float first_octave;       // log2 q of the first node

// The model's statistic of the heights at the frequency q of an order, σ_q² of small slope.
float height_statistic(float q)
{
    float place = (log2(max(q, 1e-10)) - first_octave) * NODES_PER_OCTAVE;
    return in_row(statistic, place / float(textureSize(statistic, 0).x - 1), 0).x;
}

#else

float height_statistic(float q) { return 0.0; }

#endif

vec3 pair_wi, pair_wo;            // above the structure
vec2 pair_outer;                  // their cosines outside of a coat
float pair_square;                // (1 + ωi·ωo)²

void begin_pair(vec3 wi, vec3 wo, vec2 outer)
{
    pair_wi = wi;
    pair_wo = wo;
    pair_outer = outer;
    float edge = max(0.5 * dot(wi + wo, wi + wo), 1e-12);  // not 0 of opposite grazing directions
    pair_square = edge * edge;
}

#ifdef COATED
#define POWER(index, kappa, variance) pair_power(pair_wi, pair_wo, index, kappa, variance, \
                                                 coat, pair_outer.x, pair_outer.y)
#else
#define POWER(index, kappa, variance) pair_power(pair_wi, pair_wo, index, kappa, variance)
#endif

float boundary_at(float cos_half, float k, float r, float z)
{
    return POWER(index_at(k), k * z, height_statistic(k * r)) / pair_square;
}

// Boundary factor of each channel: the reflectance under daylight, times the ratio of the model's to
// Kirchhoff's factor at the channel's mean wavelength.
vec3 boundary(float cos_half, float r, float z)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) {
        float k = channel_wavenumbers[n];
        found[n] = POWER(channel_index(n), k * z, height_statistic(k * r))
                   / max(interface_reflectance(cos_half, channel_index(n)), 1e-20);
    }
    return found * reflectance(cos_half) / pair_square;
}

#endif
