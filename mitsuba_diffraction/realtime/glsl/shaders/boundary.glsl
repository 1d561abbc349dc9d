// Boundary factor of the material, N' / (1 + ωi·ωo)², like plugin/boundary.py and plugin/layers.py.
// Kirchhoff's factor is the reflectance at the half vector.

#ifdef COATED

uniform float coat;               // index of the coat over that of the medium above

vec3 refracted(vec3 w)
{
    vec2 tangential = w.xy / coat;
    return vec3(tangential, sqrt(max(1.0 - dot(tangential, tangential), 1e-12)));
}

// Transmittances T_s and T_p of the coat's face.
vec2 transmittances(float cosine)
{
    float inside = sqrt(max(cosine * cosine + coat * coat - 1.0, 0.0));
    vec2 below = vec2(cosine + inside, coat * coat * cosine + inside);
    return vec2(1.0, coat * coat) * 4.0 * cosine * inside / (below * below);
}

// Reflection by the face, relative to the factor `outside` of the structure.
float face_reflected;

float face_reflectance(float cosine) { return 1.0 - 0.5 * dot(transmittances(cosine), vec2(1.0)); }

// Reflectance of a flat coated interface: 1 − T T / (1 − R R) of both faces.
vec3 flat_reflectance(float cosine)
{
    float inside = sqrt(max(cosine * cosine + coat * coat - 1.0, 0.0)) / coat;
    float face = face_reflectance(cosine);
    vec3 beneath = reflectance(inside);
    return 1.0 - (1.0 - face) * (1.0 - beneath) / max(1.0 - face * beneath, 1e-6);
}

#else

vec3 flat_reflectance(float cosine) { return reflectance(cosine); }

#endif

#if !defined(SMALL_SLOPE) && !defined(COATED)

void begin_pair(vec3 wi, vec3 wo, vec2 there, vec2 back) {}

vec3 boundary(float cos_half, float r, float z) { return reflectance(cos_half); }
float boundary_at_all(float cos_half) { return reflectance_at_all(cos_half); }
float boundary_at(float cos_half, float k, float r, float z) { return reflectance_at(cos_half, k); }

#else

// Matrices of a dielectric are real.
#if SURFACE_KIND == DIELECTRIC
#define NUMBER float

float times(float a, float b) { return a * b; }
float inverse_of(float a) { return 1.0 / a; }
float plus(float a, float b) { return a + b; }
float root(float a) { return sqrt(max(a, 0.0)); }

#else
#define NUMBER vec2

vec2 times(vec2 a, vec2 b) { return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x); }
vec2 inverse_of(vec2 a) { return vec2(a.x, -a.y) / dot(a, a); }
vec2 plus(vec2 a, float b) { return vec2(a.x + b, a.y); }

// Square root whose wave decays, or else propagates, away from the surface.
vec2 root(vec2 a)
{
    float larger = sqrt(0.5 * (length(a) + abs(a.x)));
    float smaller = 0.5 * a.y / max(larger, 1e-20);
    return a.x >= 0.0 ? vec2(larger, smaller) : vec2(smaller, larger);
}

#endif

// Values of the pair, set by `begin_pair`.
vec2 pair_cosines, pair_squares;  // cosines and squared sines
vec4 pair_turns;                  // products of the rotations to the facet's axis and back
float pair_dot, pair_cross, pair_sines, pair_half, pair_one_plus_dot;
vec2 pair_there, pair_back;       // T_s and T_p of a coat
vec4 pair_through;                // factor of the coat on each entry of the matrices

const float NORMAL = 1e-20;       // squared sine

// |r_s|² and |r_p|² of the flat structure; inside: cosine inside times the index.
vec2 mirrored(NUMBER epsilon, NUMBER inside, float cosine)
{
    NUMBER raised = epsilon * cosine;
    NUMBER r_s = times(plus(inside, -cosine), inverse_of(plus(inside, cosine)));
    NUMBER r_p = times(raised - inside, inverse_of(raised + inside));
    return vec2(dot(r_s, r_s), dot(r_p, r_p));
}

// √(T T G): transmittances of the coat's face, and reflections between coat and structure.
vec4 through_coat(vec2 structure0, vec2 structure)
{
    vec2 face0 = max(1.0 - pair_there, 0.0), face = max(1.0 - pair_back, 0.0);
    vec2 sent0 = sqrt(face0 * structure0), sent = sqrt(face * structure);
    vec4 left = 1.0 - vec4(sent.x * sent0, sent.y * sent0);
    vec4 least = vec4(max(structure.xx, structure0), max(structure.yy, structure0))
                 * (1.0 - vec4(min(face.xx, face0), min(face.yy, face0)));
    vec4 passed = vec4(pair_back.x * pair_there, pair_back.y * pair_there);
    return sqrt(passed / max(left, least));
}

void matrices(NUMBER index, out NUMBER tangent[4], out NUMBER gentle[4])
{
    NUMBER epsilon = times(index, index);
    NUMBER inside = root(plus(epsilon, pair_half * pair_half - 1.0));
    NUMBER raised = epsilon * pair_half;
    NUMBER r_s = -times(plus(inside, -pair_half), inverse_of(plus(inside, pair_half)));
    NUMBER r_p = times(raised - inside, inverse_of(raised + inside));
    r_s *= pair_one_plus_dot;
    r_p *= pair_one_plus_dot;
    tangent[0] = r_s * pair_turns.x - r_p * pair_turns.w;
    tangent[1] = r_s * pair_turns.y + r_p * pair_turns.z;
    tangent[2] = -(r_s * pair_turns.z + r_p * pair_turns.y);
    tangent[3] = r_p * pair_turns.x - r_s * pair_turns.w;

    NUMBER contrast = plus(epsilon, -1.0) * (2.0 * pair_cosines.x * pair_cosines.y);
    NUMBER in0 = root(plus(epsilon, -pair_squares.x)), in1 = root(plus(epsilon, -pair_squares.y));
    NUMBER s0 = inverse_of(plus(in0, pair_cosines.x)), s1 = inverse_of(plus(in1, pair_cosines.y));
    NUMBER p0 = inverse_of(epsilon * pair_cosines.x + in0);
    NUMBER p1 = inverse_of(epsilon * pair_cosines.y + in1);
    NUMBER bent0 = times(in0, p0), bent1 = times(in1, p1);
    gentle[0] = -times(contrast, times(s1, s0)) * pair_dot;
    gentle[1] = times(contrast, times(s1, bent0)) * pair_cross;
    gentle[2] = times(contrast, times(bent1, s0)) * pair_cross;
    gentle[3] = times(contrast, times(bent1, bent0) * pair_dot
                                - times(epsilon, times(p1, p0)) * pair_sines);
#ifdef COATED
    pair_through = through_coat(mirrored(epsilon, in0, pair_cosines.x),
                                mirrored(epsilon, in1, pair_cosines.y));
#else
    pair_through = vec4(1.0);
#endif
}

// ½ Σ|(1 − s) K + s B|² over (1 + ωi·ωo)².
float mean_power(NUMBER tangent[4], NUMBER gentle[4], float s)
{
    float sum = 0.0;
    for (int n = 0; n < 4; ++n) {
        NUMBER blended = mix(tangent[n], gentle[n], s) * (pair_through[n] / pair_one_plus_dot);
        sum += dot(blended, blended);
    }
    return 0.5 * sum;
}

#ifdef SMALL_SLOPE

uniform sampler2D roughness;      // σ_q² at a node in log2 q and at the next one
uniform float first_octave;       // log2 q of the first node
uniform float last_node;

// s = exp(−R₀(κσ_q)²/2 − (κσ_q)⁴/3)
float gentle_share(NUMBER index, float k, float r, float z)
{
    float place = (log2(max(k * r, 1e-10)) - first_octave) * NODES_PER_OCTAVE;
    place = clamp(place, 0.0, last_node);
    float lower = min(floor(place), last_node - 1.0);
    vec2 ends = entry(roughness, int(lower)).xy;
    float squared = k * k * z * z * mix(ends.x, ends.y, place - lower);
    NUMBER mirror = times(plus(index, -1.0), inverse_of(plus(index, 1.0)));
    return exp(-squared * (0.5 * dot(mirror, mirror) + squared / 3.0));
}

#else

float gentle_share(NUMBER index, float k, float r, float z) { return 0.0; }

#endif

#if SURFACE_KIND == DIELECTRIC

float pair_tangent[4], pair_gentle[4];  // equal at all wavelengths

void of_material() { matrices(eta, pair_tangent, pair_gentle); }

float boundary_at_all(float cos_half) { return 1.0; }

float boundary_at(float cos_half, float k, float r, float z)
{
    return mean_power(pair_tangent, pair_gentle, gentle_share(eta, k, r, z));
}

vec3 boundary(float cos_half, float r, float z)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) found[n] = boundary_at(cos_half, channel_wavenumbers[n], r, z);
    return found;
}

#else

void of_material() {}

float of_index(vec2 index, float s)
{
    vec2 tangent[4], gentle[4];
    matrices(index, tangent, gentle);
    return mean_power(tangent, gentle, s);
}

float boundary_at_all(float cos_half) { return 1.0; }

float boundary_at(float cos_half, float k, float r, float z)
{
    float last = float(textureSize(reflectances, 0).y - 2);
    float y = clamp((k - wavenumbers.x) / (wavenumbers.y - wavenumbers.x), 0.0, 1.0) * last;
    vec2 index = texelFetch(reflectances, ivec2(0, int(y + 0.5)), 0).yz;
    return of_index(index, gentle_share(index, k, r, z));
}

// Boundary factor of each channel: the reflectance under daylight, times the ratio of the blended to
// Kirchhoff's factor at the channel's mean wavelength.
vec3 boundary(float cos_half, float r, float z)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) {
        float k = channel_wavenumbers[n];
        vec2 index = vec2(channel_eta[n], channel_k[n]);
        vec2 tangent[4], gentle[4];
        matrices(index, tangent, gentle);
        float own = 0.0;
        for (int m = 0; m < 4; ++m) own += dot(tangent[m], tangent[m]);
        own *= 0.5 / (pair_one_plus_dot * pair_one_plus_dot);
        found[n] = mean_power(tangent, gentle, gentle_share(index, k, r, z)) / max(own, 1e-20);
    }
    return found * reflectance(cos_half);
}

#endif

// Prepare the values of a pair of directions above the structure that all wavelengths share.
// there, back: transmittances of a coat.
void begin_pair(vec3 wi, vec3 wo, vec2 there, vec2 back)
{
    vec3 sum = wi + wo;
    pair_one_plus_dot = max(0.5 * dot(sum, sum), 1e-12);
    pair_half = sqrt(min(0.5 * pair_one_plus_dot, 1.0));
    pair_cosines = vec2(wi.z, wo.z);
    pair_squares = vec2(dot(wi.xy, wi.xy), dot(wo.xy, wo.xy));
    pair_there = there;
    pair_back = back;

    bool slanted = min(pair_squares.x, pair_squares.y) > NORMAL;
    vec2 squares = slanted ? pair_squares : vec2(1.0);
    float inverse = inversesqrt(squares.x) * inversesqrt(squares.y);
    float across = wi.x * wo.y - wi.y * wo.x;
    pair_dot = slanted ? -dot(wi.xy, wo.xy) * inverse : 1.0;
    pair_cross = slanted ? -across * inverse : 0.0;
    pair_sines = slanted ? sqrt(squares.x) * sqrt(squares.y) : 0.0;

    float x = wi.y * wo.z - wi.z * wo.y;
    float y = wi.z * wo.x - wi.x * wo.z;
    vec2 turns = vec2(x * wi.y - y * wi.x, y * wo.x - x * wo.y);
    vec2 lengths = turns * turns + across * across;
    bool found = min(lengths.x, lengths.y) > NORMAL;
    lengths = found ? lengths : vec2(1.0);
    inverse = inversesqrt(lengths.x) * inversesqrt(lengths.y);
    vec4 turned = vec4(turns.y * turns.x, turns.y * across, -across * turns.x, -across * across);
    pair_turns = found ? turned * inverse : vec4(pair_dot, 0.0, pair_cross, 0.0);
    of_material();
}

#endif
