// Prepare a pair of directions in the tangent frame, wi towards the eye. `place` gets the arguments
// of the look-up (u, v, z = w·height_scale, cosine at the half vector); returns the factor on it.
float begin_diffraction(vec3 wi, vec3 wo, vec2 rotation, out vec4 place)
{
    vec3 sum = wi + wo;
    place.xy = in_patch(sum, rotation);
    patch_area = dot(rotation, rotation);
    float area = patch_area * area_factor;
    vec2 outer = vec2(wi.z, wo.z);
#ifdef ORDER_0
    mirror_half = sqrt(min(0.25 * dot(sum, sum), 1.0));
#endif
#ifdef ENERGY_CONSERVING
    float energy = energy_scale(in_patch(wi, rotation), wi.z)
                 * energy_scale(in_patch(wo, rotation), wo.z);
#endif
#ifdef COATED
    wi = refracted(wi, coat);
    wo = refracted(wo, coat);
    sum = wi + wo;
#endif
    float one_plus_dot = 0.5 * dot(sum, sum), ratio = one_plus_dot / sum.z;
    float outside = area * ratio * ratio / wi.z * (outer.y / wo.z);
#ifdef COATED
    sum.z *= coat;  // κ is larger by the index of the coat
#endif
    begin_pair(wi, wo, outer);
    float mirrored = area * outer.y;  // of order 0, which has no shadowing
#ifdef ENERGY_CONSERVING
    outside *= energy;
    mirrored *= energy;
#endif
#ifdef VCAVITY
    outside *= vcavity(wi.z, wo.z, one_plus_dot);
#endif
#ifdef ORDER_0
    mirror_ends = outer;
    mirror_share = mirrored / outside;
#ifdef COATED
    face_share = area * outer.y / outside;
#endif
#endif
    place.zw = vec2(sum.z * height_scale, sqrt(min(0.5 * one_plus_dot, 1.0)));
    return outside;
}
