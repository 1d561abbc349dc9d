// `flss`: the thesis' uniform sampling of the whole spectrum.

vec3 diffracted(vec2 uv, float z, float cos_half, int light)
{
    return over_spectrum(uv, z, cos_half, light);
}
