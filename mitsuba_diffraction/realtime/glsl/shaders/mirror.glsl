// Order 0, a mirror's lobe: f₀ = R(θh) |a₀|² G(u) C(X_i) C(X_o). The formulas are of optics/mirror.py.
// All is relative to the factor of `begin_diffraction`, which sets the values of a pair.

vec2 mirror_ends = vec2(1.0);   // cosθi and cosθo
float mirror_share = 1.0;       // of order 0
#ifdef COATED
vec3 mirror_wi, mirror_wo;   // directions within the coat
float face_share;            // of the coat's face, times its reflectance
#endif

// √(kσ₀) of the window on the surface.
float sharpness(float k, float sigma_0) { return sqrt(k * sigma_0 * sqrt(patch_area)); }

float visible(float sharp, float slope)
{
    return horizon_correction(mirror_ends.x, mirror_ends.y, sharp, slope);
}

#ifdef COATED

float face_at(float k, float sigma_0)
{
    float sharp = sharpness(k, sigma_0);
    return face_share * visible(sharp, face_slope(coat, sharp));
}

vec3 face(float sigma_0)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) found[n] = face_at(channel_wavenumbers[n], sigma_0);
    return found;
}

#endif

#if SURFACE_KIND == CONDUCTOR

float mirror_of(vec2 index, float k, float sigma_0)
{
    float sharp = sharpness(k, sigma_0);
#ifdef COATED
    return mirror_share * visible(sharp, 0.0)
           * coated_mirror(mirror_wi, mirror_wo, index, coat, mirror_ends.x, mirror_ends.y);
#else
    return mirror_share * visible(sharp, grazing_slope(index, sharp));
#endif
}

// Factor of order 0 at one wavenumber, to be multiplied by `boundary_at_all`.
float mirror_at(float cos_half, float k, float sigma_0)
{
    vec2 index = texelFetch(reflectances, ivec2(0, row_at(k)), 0).yz;
#ifdef COATED
    return mirror_of(index, k, sigma_0);
#else
    return mirror_of(index, k, sigma_0) * reflectance_at(cos_half, k);
#endif
}

// Factor of order 0 in each channel.
vec3 mirror(float cos_half, float sigma_0)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) {
        vec2 index = vec2(channel_eta[n], channel_k[n]);
        found[n] = mirror_of(index, channel_wavenumbers[n], sigma_0);
#ifdef COATED
        found[n] /= max(interface_reflectance(cos_half, index), 1e-20);
#endif
    }
    return found * reflectance(cos_half);
}

#else

float mirror_at(float cos_half, float k, float sigma_0)
{
    float sharp = sharpness(k, sigma_0);
#if defined(COATED)
    return mirror_share * visible(sharp, 0.0)
           * coated_mirror(mirror_wi, mirror_wo, eta, coat, mirror_ends.x, mirror_ends.y);
#elif SURFACE_KIND == PERFECT
    return mirror_share * visible(sharp, 0.0);
#elif defined(BOUNDARY)
    return mirror_share * visible(sharp, grazing_slope(eta, sharp)) * reflectance_at_all(cos_half);
#else
    return mirror_share * visible(sharp, grazing_slope(eta, sharp));
#endif
}

vec3 mirror(float cos_half, float sigma_0)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) found[n] = mirror_at(cos_half, channel_wavenumbers[n], sigma_0);
    return found * boundary_at_all(cos_half);
}

#endif
