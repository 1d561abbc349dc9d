// `nmm`: the thesis' n_min–n_max method, which sums only wavelengths whose orders reach the view
// direction, each with the step of the full sum (thesis/methods/periodic.py).

uniform vec2 periods;           // periods along x and y, µm; 0 where none exists
uniform float specular_reach;   // largest hypot(u, v) of the white mirror direction
uniform float white_wavelength; // wavelength that sets the brightness of white, µm

vec3 reached(float frequency, float period, vec2 uv, float z, float cos_half, int light)
{
    float path = period * abs(frequency);
    vec3 sum = vec3(0.0);
    int highest = int(floor(path / first_wavelength));
    for (int n = max(1, int(ceil(path / last_wavelength))); n <= highest; ++n)
        sum += of_wavelength(uv, z, cos_half, path / float(n), light);
    return sum * wavelength_step;
}

vec3 diffracted(vec2 uv, float z, float cos_half, int light)
{
    if (length(uv) < specular_reach) {
        float power = window_power(uv, z, white_wavelength) / (white_wavelength * white_wavelength);
        return light_colour[light] * reflectance(cos_half) * power;
    }
    return reached(uv.x, periods.x, uv, z, cos_half, light)
         + reached(uv.y, periods.y, uv, z, cos_half, light);
}
