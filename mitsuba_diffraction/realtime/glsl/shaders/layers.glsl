// Constants of a surface, the patch's frame, and the light that reaches the base beneath.

uniform float area_factor;        // 4πσ², that is 4π²σ⁴ over the window's area πσ²
uniform float height_scale;

float patch_area = 1.0;           // square of the factor by which the patch is stretched

// Tangential part along the patch's axes. rotation: (cos, sin) of its x axis times the factor by
// which it is stretched, which multiplies (u, v) as the table has the patch without it.
vec2 in_patch(vec3 direction, vec2 rotation)
{
    return vec2(rotation.x * direction.x + rotation.y * direction.y,
                rotation.x * direction.y - rotation.y * direction.x);
}

#if defined(ORDERS) || defined(ORDER_0)

vec2 mirror_ends = vec2(1.0);     // cosθi and cosθo

// σ₀ of the window on the surface.
float on_surface(float sigma_0) { return sigma_0 * sqrt(patch_area); }

// C(X_i) C(X_o) of order 0.
float visible(float k, float sigma_0)
{
    vec2 level = mirror_ends * mirror_ends * on_surface(sigma_0);
    return horizon_correction(level.x, level.y, k);
}

#endif

const float LOWEST = 1e-6;  // least cosine of a direction, which keeps results finite

#if defined(ORDERS)

vec3 albedo(vec3 w, vec2 rotation);  // of orders.glsl

#elif defined(DIFFRACTING)

// Albedo of the surface for one direction, at most 1.
vec3 albedo(vec3 w, vec2 rotation)
{
    vec3 found = flat_reflectance(w.z);
#if defined(BENEATH) && !defined(GLANCE)
    found += of_direction(in_patch(w, rotation), w.z).rgb;
#endif
    return clamp(found, 0.0, 1.0);
}

#endif

#ifdef THROUGH

uniform sampler2D through;        // transmittance of a plain material's face, over cosθ

#endif

#ifdef PRINCIPLED

uniform float metallic;           // share of the metal
uniform float roughness;

float fifth_power(float x) { return x * x * x * x * x; }

// Base of the principled BSDF relative to a diffuse one, with retro-reflection (Burley 2012).
float burley(vec3 wi, vec3 wo)
{
    float there = fifth_power(1.0 - wo.z), back = fifth_power(1.0 - wi.z);
    float thrown = roughness * (1.0 + dot(wi, wo));  // 2 r cos²θ of the half vector
    return (1.0 - 0.5 * there) * (1.0 - 0.5 * back)
        + thrown * (there + back + there * back * (thrown - 1.0));
}

#endif

// Share of the light that passes the surface twice, to the base and back.
vec3 transmission(vec3 wi, vec3 wo, vec2 rotation)
{
#if defined(THROUGH)
    return in_row(through, wi.z, 0).rrr * in_row(through, wo.z, 0).r;
#elif defined(PRINCIPLED)
    return vec3((1.0 - metallic) * burley(wi, wo));
#elif !defined(DIFFRACTING)
    return vec3(1.0);
#else
    return (1.0 - albedo(wi, rotation)) * (1.0 - albedo(wo, rotation));
#endif
}
