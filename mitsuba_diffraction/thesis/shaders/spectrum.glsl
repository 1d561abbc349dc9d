// `flss` and `pq`: the thesis' uniform sampling of the whole spectrum; `pq` has the window of whole
// copies, see REPEATED in taylor.glsl (thesis/methods/periodic.py, linear interpolation).

// Trapezoidal rule over the whole spectrum; the last interval may be shorter.
vec3 diffracted(vec2 uv, float z, float cos_half, int light)
{
    vec3 sum = vec3(0.0);
    float intervals = ceil((last_wavelength - first_wavelength) / wavelength_step - 1e-3);
    float before = 0.0;
    for (int n = 0; n <= int(intervals); ++n) {
        float wavelength = min(first_wavelength + float(n) * wavelength_step, last_wavelength);
        float next = min(wavelength + wavelength_step, last_wavelength);
        float weight = 0.5 * (before + next - wavelength);
        before = next - wavelength;
        sum += weight * of_wavelength(uv, z, cos_half, wavelength, light);
    }
    return sum;
}
