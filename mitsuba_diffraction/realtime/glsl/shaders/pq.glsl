// `pq`: the thesis' repeated patch (thesis/methods/periodic.py, linear interpolation). With REPEATED,
// the window of taylor.glsl is that of whole copies.

vec3 diffracted(vec2 uv, float z, float cos_half, int light)
{
    return over_spectrum(uv, z, cos_half, light);
}
