// Order 0, a mirror's lobe: f₀ = R(θm) |a₀|² G(u) C(X_i) C(X_o). The formulas are of optics/mirror.py.
// All is relative to the factor of `begin_diffraction`, which sets the values of a pair.

float mirror_half = 1.0;        // cosθh
float mirror_share = 1.0;       // of order 0
#ifdef COATED
float face_share;               // of the coat's face
#endif

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

// Factor of order 0 in each channel.
vec3 mirror(float cos_half, float sigma_0)
{
    vec3 found;
    for (int n = 0; n < 3; ++n) {
        float cosine = mirrored(channel_wavenumbers[n], sigma_0);
#ifdef COATED
        found[n] = beneath_reflectance(cosine, coat, channel_index(n))
                   / max(interface_reflectance(cos_half, channel_index(n)), 1e-20);
#else
        found[n] = reflectance(cosine)[n];
#endif
        found[n] *= mirror_share * visible(channel_wavenumbers[n], sigma_0);
    }
#ifdef COATED
    found *= reflectance(cos_half);
#endif
    return found;
}
