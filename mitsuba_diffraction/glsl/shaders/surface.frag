// One fragment: lights over the surface. What a method adds is `diffracted`.

in vec3 v_position;
in vec3 v_normal;
in vec3 v_tangent;
in vec2 v_texcoord;
in vec3 v_colour;
in vec2 v_axis;

uniform vec3 eye;
uniform vec3 view_axis;           // of an orthographic camera, towards it; zero otherwise
uniform int lights;
uniform vec4 light_place[LIGHTS];   // w = 0: direction towards it; w = 1: position
uniform vec3 sky;                 // radiance from everywhere

uniform bool diffracting;
uniform bool two_sided;
uniform float area_factor;        // 4πσ², that is 4π²σ⁴ over the window's area πσ²
uniform float height_scale;
uniform float above;              // factor of the diffraction; 1 but in layering `thesis`
uniform float beneath_extra;      // diffuse_weight of layering `thesis`, else −1

uniform bool colour_mapped;
uniform sampler2D colour_map;
uniform mat3 colour_uv;
uniform bool axis_mapped;
uniform sampler2D axis_map;
uniform mat3 axis_uv;

uniform bool display;             // for a screen: exposed, with the transfer curve of sRGB
uniform float exposure;           // factor

out vec4 fragment;

vec2 in_patch(vec3 direction, vec2 rotation)
{
    return vec2(rotation.x * direction.x + rotation.y * direction.y,
                rotation.x * direction.y - rotation.y * direction.x);
}

// f·cosθ of the diffraction times the light's irradiance of 1, wi towards the eye.
vec3 diffraction(vec3 wi, vec3 wo, vec2 rotation, int light)
{
    vec3 sum = wi + wo;
    float one_plus_dot = 0.5 * dot(sum, sum);
    float ratio = one_plus_dot / sum.z;
    float outside = area_factor * ratio * ratio / wi.z;
    if (energy_conserving)
        outside /= max(albedo_bound(in_patch(wi, rotation), wi.z),
                       albedo_bound(in_patch(wo, rotation), wo.z));
    if (vcavity) outside *= groove_shadow(wi.z, wo.z, one_plus_dot);
    float cos_half = sqrt(min(0.5 * one_plus_dot, 1.0));
    return outside * diffracted(in_patch(sum, rotation), sum.z * height_scale, cos_half, light);
}

// Share of the light that reaches what lies beneath and comes back.
vec3 transmission(vec3 wi, vec3 wo)
{
    if (!diffracting) return vec3(1.0);
    if (beneath_extra >= 0.0) return 1.0 - reflectance(0.5 * length(wi + wo)) + beneath_extra;
    return (1.0 - reflectance(wi.z)) * (1.0 - reflectance(wo.z));
}

void main()
{
    vec3 n = normalize(v_normal);
    vec3 s = v_tangent - n * dot(n, v_tangent);
    s = dot(s, s) > 1e-20 ? normalize(s) : normalize(cross(n, abs(n.x) < 0.7 ? vec3(1, 0, 0) : vec3(0, 1, 0)));
    vec3 t = cross(n, s);
    vec3 towards_eye = dot(view_axis, view_axis) > 0.0 ? view_axis : normalize(eye - v_position);
    vec3 wi = vec3(dot(towards_eye, s), dot(towards_eye, t), dot(towards_eye, n));
    float side = two_sided && wi.z < 0.0 ? -1.0 : 1.0;
    wi.z *= side;

    vec3 pigment = v_colour;
    if (colour_mapped) pigment = texture(colour_map, (colour_uv * vec3(v_texcoord, 1.0)).xy).rgb;
    vec2 rotation = v_axis;
    if (axis_mapped) rotation = texture(axis_map, (axis_uv * vec3(v_texcoord, 1.0)).xy).rg;
    float turned = length(rotation);
    rotation = turned > 1e-6 ? rotation / turned : vec2(1.0, 0.0);

    vec3 radiance = vec3(0.0);
    if (wi.z > 0.0) {
        for (int i = 0; i < lights; ++i) {
            vec3 away = light_place[i].xyz - light_place[i].w * v_position;
            float falloff = light_place[i].w > 0.0 ? 1.0 / dot(away, away) : 1.0;
            vec3 direction = normalize(away);
            vec3 wo = vec3(dot(direction, s), dot(direction, t), side * dot(direction, n));
            if (wo.z <= 0.0) continue;
            vec3 irradiance = falloff * light_colour[i];
            radiance += irradiance * wo.z * (1.0 / PI) * pigment * transmission(wi, wo);
            if (diffracting) radiance += falloff * above * diffraction(wi, wo, rotation, i);
        }
        // Light from everywhere: a diffracting surface returns about what a smooth one does
        vec3 up = vec3(0.0, 0.0, 1.0);
        vec3 smooth_part = diffracting ? reflectance(wi.z) : vec3(0.0);
        radiance += sky * (pigment * transmission(wi, up) + smooth_part);
    }
    fragment = display ? vec4(encode_srgb(radiance * exposure), 1.0) : vec4(radiance, 1.0);
}
