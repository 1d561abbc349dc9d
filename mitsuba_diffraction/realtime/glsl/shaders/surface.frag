// One fragment: lights over the surface. What a method adds is `diffracted`.

in vec3 v_position;
in vec3 v_normal;
in vec3 v_tangent;
in vec2 v_texcoord;
in vec3 v_colour;
in vec2 v_axis;

uniform vec3 eye;
uniform vec3 view_axis;           // of an orthographic camera, towards it; zero otherwise
uniform vec4 light_place[LIGHTS];   // w = 0: direction towards it; w = 1: position
uniform vec3 sky[4];              // irradiance over π: the mean, and its change along x, y, z

uniform bool two_sided;
uniform float area_factor;        // 4πσ², that is 4π²σ⁴ over the window's area πσ²
uniform float height_scale;
uniform float diffuse_weight;     // of layering `thesis`

#ifdef COLOUR_MAPPED
uniform sampler2D colour_map;
uniform mat3 colour_uv;
#endif
#ifdef AXIS_MAPPED
uniform sampler2D axis_map;
uniform mat3 axis_uv;
#endif

uniform float exposure;           // factor, for a display

out vec4 fragment;

vec2 in_patch(vec3 direction, vec2 rotation)
{
    return vec2(rotation.x * direction.x + rotation.y * direction.y,
                rotation.x * direction.y - rotation.y * direction.x);
}

const float LOWEST = 1e-6;  // cosine of what is seen or lit, so that all is finite

#ifdef DIFFRACTING

// f·cosθ of the diffraction times the light's irradiance, wi towards the eye.
vec3 diffraction(vec3 wi, vec3 wo, vec2 rotation, int light)
{
    vec3 sum = wi + wo;
    vec2 uv = in_patch(sum, rotation);
    float one_plus_dot = 0.5 * dot(sum, sum);
    float ratio = one_plus_dot / sum.z;
    float outside = area_factor * ratio * ratio / wi.z;
    vec2 there = vec2(1.0), back = vec2(1.0);
#ifdef COATED
    there = transmittances(wi.z);
    back = transmittances(wo.z);
    float face = outside * face_reflectance(sqrt(min(0.5 * one_plus_dot, 1.0)));
    float leaving = wo.z;
    wi = refracted(wi);
    wo = refracted(wo);
    sum = wi + wo;
    one_plus_dot = 0.5 * dot(sum, sum);
    ratio = one_plus_dot / sum.z;
    outside = area_factor * ratio * ratio / wi.z * leaving / wo.z;
    sum.z *= coat;  // κ grows by the index
#endif
    begin_pair(wi, wo, there, back);
#ifdef ENERGY_CONSERVING
    outside *= energy_scale(in_patch(wi, rotation), wi.z)
             * energy_scale(in_patch(wo, rotation), wo.z) * energy_fade(wi.z, wo.z);
#endif
#ifdef VCAVITY
    outside *= groove_shadow(wi.z, wo.z, one_plus_dot);
#endif
#ifdef COATED
    face_reflected = face / outside;
#endif
    float cos_half = sqrt(min(0.5 * one_plus_dot, 1.0));
    return outside * diffracted(uv, sum.z * height_scale, cos_half, light);
}

#endif

#ifdef DIFFRACTING

// What the surface reflects of a direction's light, at most all.
vec3 albedo(vec3 w, vec2 rotation)
{
    vec3 found = flat_reflectance(w.z);
#ifdef BENEATH
    found *= reflected_ratio(in_patch(w, rotation), w.z);
#endif
    return min(found, 1.0);
}

#endif

// Share of the light that reaches what lies beneath and comes back.
vec3 transmission(vec3 wi, vec3 wo, vec2 rotation)
{
#ifndef DIFFRACTING
    return vec3(1.0);
#elif defined(THESIS)
    return 1.0 - reflectance(0.5 * length(wi + wo)) + diffuse_weight;
#else
    return (1.0 - albedo(wi, rotation)) * (1.0 - albedo(wo, rotation));
#endif
}

void main()
{
    vec3 n = normalize(v_normal);
    vec3 s = v_tangent - n * dot(n, v_tangent);
    s *= inversesqrt(max(dot(s, s), 1e-20));
    vec3 t = cross(n, s);
    vec3 towards_eye = dot(view_axis, view_axis) > 0.0 ? view_axis : normalize(eye - v_position);
    vec3 wi = vec3(dot(towards_eye, s), dot(towards_eye, t), dot(towards_eye, n));
    float side = two_sided && wi.z < 0.0 ? -1.0 : 1.0;
    bool seen = side * wi.z > 0.0;
    wi.z = max(side * wi.z, LOWEST);

    vec3 pigment = v_colour;
#ifdef COLOUR_MAPPED
    pigment = texture(colour_map, (colour_uv * vec3(v_texcoord, 1.0)).xy).rgb;
#endif
    vec2 rotation = v_axis;
#ifdef AXIS_MAPPED
    rotation = texture(axis_map, (axis_uv * vec3(v_texcoord, 1.0)).xy).rg;
#endif
    float turned = length(rotation);
    rotation = turned > 1e-6 ? rotation / turned : vec2(1.0, 0.0);

#ifdef SHADOWED
    vec3 flat_normal = cross(dFdx(v_position), dFdy(v_position));
    flat_normal *= inversesqrt(max(dot(flat_normal, flat_normal), 1e-30));
#endif

    vec3 radiance = vec3(0.0);
    for (int i = 0; i < LIGHTS_LIT; ++i) {
        vec3 away = light_place[i].xyz - light_place[i].w * v_position;
        float square = dot(away, away);
        vec3 direction = away * inversesqrt(square);
        vec3 wo = vec3(dot(direction, s), dot(direction, t), side * dot(direction, n));
        bool lit = seen && wo.z > 0.0;
#ifdef SKIPS_UNLIT
        if (!lit) continue;
#endif
        wo.z = max(wo.z, LOWEST);
        vec3 added = vec3(0.0);
#ifdef PIGMENTED
        added += light_colour[i] * wo.z * (1.0 / PI) * pigment * transmission(wi, wo, rotation);
#endif
#ifdef DIFFRACTING
        vec3 diffracting = diffraction(wi, wo, rotation, i);
#ifdef THESIS
        diffracting *= 1.0 - diffuse_weight;
#endif
        added += diffracting;
#endif
        float falloff = light_place[i].w > 0.0 ? 1.0 / square : 1.0;
#ifdef SHADOWED
        falloff *= emitted(direction) * reached(v_position, flat_normal);
#endif
        radiance += lit ? falloff * added : vec3(0.0);
    }
#ifdef SKY
    vec3 facing = side * n;
    vec3 above = sky[0] + facing.x * sky[1] + facing.y * sky[2] + facing.z * sky[3];
    vec3 returned = pigment * transmission(wi, vec3(0.0, 0.0, 1.0), rotation);
#ifdef DIFFRACTING
    returned += albedo(wi, rotation);
#endif
    radiance += seen ? max(above, 0.0) * returned : vec3(0.0);
#endif
#ifdef DISPLAYED
    radiance = encode_srgb(radiance * exposure);
#endif
    fragment = vec4(radiance, 1.0);
}
