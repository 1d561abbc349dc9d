// Specular reflection of plain materials: microfacets (Walter et al. 2007), or a smooth face. See
// materials.py.

uniform float gloss_alpha;        // roughness α

float microfacets(float cosine)
{
    float squared = max(cosine * cosine, 1e-8);
    float steepness = (1.0 / squared - 1.0) / (gloss_alpha * gloss_alpha);
    float below = PI * gloss_alpha * gloss_alpha * squared * squared;
#ifdef GGX
    return 1.0 / (below * (1.0 + steepness) * (1.0 + steepness));
#else
    return exp(-steepness) / below;
#endif
}

// Share of the facets that is visible along a direction (Smith 1967).
float unshadowed(float cosine)
{
    float squared = max(cosine * cosine, 1e-8);
    float slope = gloss_alpha * sqrt(max(1.0 / squared - 1.0, 0.0));
#ifdef GGX
    return 2.0 / (1.0 + sqrt(1.0 + slope * slope));
#else
    float a = 1.0 / max(slope, 1e-6);
    return a >= 1.6 ? 1.0 : a * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a));
#endif
}

#ifdef PRINCIPLED
vec3 base_colour;                 // base colour of the fragment

// Reflectance of facets: a dielectric, and a metal by Schlick's formula (Burley 2012).
vec3 facet_reflectance(float cosine)
{
    vec3 metal = mix(base_colour, vec3(1.0), fifth_power(1.0 - cosine));
    return mix(reflectance(cosine), metal, metallic);
}
#else
vec3 facet_reflectance(float cosine) { return reflectance(cosine); }
#endif

// f·cosθ; wi points to the eye.
vec3 gloss(vec3 wi, vec3 wo)
{
#ifdef MIRROR
    return reflectance(wi.z);  // along the mirror direction
#else
    vec3 h = normalize(wi + wo);
    return facet_reflectance(dot(wi, h)) * (microfacets(h.z) * unshadowed(wi.z) * unshadowed(wo.z)
                                            / (4.0 * wi.z));
#endif
}

// f·cosθ times the light's irradiance, as of a surface that diffracts.
vec3 diffraction(vec3 wi, vec3 wo, vec2 rotation, int light)
{
    return light_colour[light] * gloss(wi, wo);
}
