// Light's response over wavenumbers, for method `exact`.

uniform sampler2D responses;     // linear sRGB / 2π over k, one row per light

const float WIDEST_LOBE = 0.35;  // widest lobe for steps from order to order, rad/µm: 17 nm at 550
const float LARGEST_STEP = 0.25; // largest step in k, rad/µm, which resolves colour matching

vec3 response(float k, int light)
{
    float last = float(textureSize(responses, 0).x - 1);
    float x = (k - wavenumbers.x) / (wavenumbers.y - wavenumbers.x) * last + 0.5;
    return texelFetch(responses, ivec2(int(clamp(x, 0.0, last)), light), 0).rgb;  // 0 at both ends
}
