// f·cosθ of the diffraction times the light's irradiance; each method defines `diffracted`.

vec3 diffraction(vec3 wi, vec3 wo, vec2 rotation, int light)
{
    vec4 place;
    float outside = begin_diffraction(wi, wo, rotation, place);
    return outside * diffracted(place.xy, place.z, place.w, light);
}
