// Order 0, a mirror's lobe: f₀ = R(θm) |a₀|² G(u) C(X_i) C(X_o). The formulas are of optics/mirror.py.
// All is relative to the factor of `begin_diffraction`, which sets the values of a pair.

vec2 mirror_ends = vec2(1.0);   // cosθi and cosθo
float mirror_half = 1.0;        // cosθh
float mirror_share = 1.0;       // of order 0
#ifdef COATED
float face_share;               // of the coat's face
#endif

// σ₀ of the window on the surface.
float on_surface(float sigma_0) { return sigma_0 * sqrt(patch_area); }

float visible(float k, float sigma_0)
{
    vec2 level = mirror_ends * mirror_ends * on_surface(sigma_0);
    return horizon_correction(level.x, level.y, k);
}

// cosθm outside of a coat.
float mirrored(float k, float sigma_0)
{
    return mirror_cosine(mirror_half, mirror_ends.x, mirror_ends.y, k * on_surface(sigma_0));
}

#ifdef COATED

float face_at(float k, float sigma_0)
{
    return face_share * face_reflectance(mirrored(k, sigma_0)) * visible(k, sigma_0);
}

vec3 face(float sigma_0)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) found[n] = face_at(channel_wavenumbers[n], sigma_0);
    return found;
}

#endif

// Factor of order 0 at one wavenumber.
float mirror_at(float k, float sigma_0)
{
    float cosine = mirrored(k, sigma_0);
#ifdef COATED
    float reflected = beneath_reflectance(cosine, coat, index_at(k));
#else
    float reflected = reflectance_at(cosine, k);
#endif
    return mirror_share * visible(k, sigma_0) * reflected;
}

#if SURFACE_KIND == CONDUCTOR

// Factor of order 0 in each channel.
vec3 mirror(float cos_half, float sigma_0)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) {
        found[n] = mirror_share * visible(channel_wavenumbers[n], sigma_0);
#ifdef COATED
        vec2 index = vec2(channel_eta[n], channel_k[n]);
        found[n] *= beneath_reflectance(mirrored(channel_wavenumbers[n], sigma_0), coat, index)
                    / max(interface_reflectance(cos_half, index), 1e-20);
#else
        found[n] *= reflectance(mirrored(channel_wavenumbers[n], sigma_0))[n];
#endif
    }
#ifdef COATED
    return found * reflectance(cos_half);
#else
    return found;
#endif
}

#else

vec3 mirror(float cos_half, float sigma_0)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) found[n] = mirror_at(channel_wavenumbers[n], sigma_0);
    return found;
}

#endif
