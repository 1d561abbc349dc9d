// Shade one fragment: under lights, or by surroundings looked up along its lobes (LOOKED_UP). Each
// method defines `diffracted`.

uniform vec3 eye;
uniform vec4 light_place[LIGHTS];   // w = 0: direction to the light; w = 1: position
uniform vec3 sky[4];              // irradiance over π: mean, and gradient along x, y, z

// used only with the definitions of a feature
uniform bool two_sided;
uniform sampler2D colour_map;
uniform mat3 colour_uv;
uniform vec4 live_pigment;        // colour of the page's control; w = 1 where it replaces the scene's
uniform sampler2D bump_map;       // heights along the normal, in the scene's unit
uniform mat3 bump_uv;
uniform sampler2D normal_map;
uniform mat3 normal_uv;
uniform vec3 emission;            // radiance, on the side that the normal points to
uniform mat3 pigment_in_light;    // from a pigment's colour to its colour under this light
uniform float light_density;      // `lights.Lamp.density`
uniform vec2 surroundings_lit;    // factors on the environment and on area lights: 1, or 0 if off

out vec4 fragment;

#if defined(DIFFRACTING) || defined(GLOSS)
#define LOBES
#endif

#if defined(BUMP_MAPPED) || defined(NORMAL_MAPPED)
#define TURNED

// Flip the slope of a perturbed normal that faces away from the eye, like Mitsuba's
// `flip_invalid_normals`.
vec3 facing(vec3 turned, vec3 n, vec3 towards_eye)
{
    if (dot(towards_eye, n) * dot(towards_eye, turned) > 0.0) return turned;
    return 2.0 * dot(turned, n) * n - turned;
}

// Share of the light from a direction that reaches a facet with a perturbed normal, like that of
// rough facets as steep (Estevez et al. 2019, Mitsuba's `use_shadowing_function`).
float kept_by_facet(vec3 turned, vec3 n, vec3 direction)
{
    float slope = dot(turned, n), height = dot(direction, n);
    float roughness = min(0.125 * (1.0 / max(slope * slope, 1e-8) - 1.0), 1.0);
    float steepness = 1.0 / max(height * height, 1e-8) - 1.0;
    return 2.0 / (1.0 + sqrt(1.0 + roughness * steepness));
}
#else
float kept_by_facet(vec3 turned, vec3 n, vec3 direction) { return 1.0; }
#endif

#ifdef BUMP_MAPPED

float bump_at(ivec2 texel)
{
    ivec2 size = textureSize(bump_map, 0);
    return texelFetch(bump_map, ((texel % size) + size) % size, 0).r;
}

// Gradient of the heights over (u, v), from the four surrounding texels.
vec2 bump_gradient()
{
    vec2 size = vec2(textureSize(bump_map, 0));
    vec2 place = (bump_uv * vec3(v_texcoord, 1.0)).xy * size - 0.5;
    ivec2 texel = ivec2(floor(place));
    vec2 t = place - floor(place);
    float a = bump_at(texel), b = bump_at(texel + ivec2(1, 0));
    float c = bump_at(texel + ivec2(0, 1)), d = bump_at(texel + ivec2(1, 1));
    vec2 gradient = vec2(mix(b - a, d - c, t.y), mix(c - a, d - b, t.x)) * size;
    return vec2(dot(bump_uv[0].xy, gradient), dot(bump_uv[1].xy, gradient));
}

// Normal of a surface displaced along its normal (Blinn 1978).
vec3 bumped(vec3 n)
{
    vec3 x = dFdx(v_position), y = dFdy(v_position);
    vec2 u = dFdx(v_texcoord), v = dFdy(v_texcoord);
    float area = u.x * v.y - u.y * v.x;
    if (abs(area) < 1e-30) return n;
    vec3 along_u = (x * v.y - y * u.y) / area, along_v = (y * u.x - x * v.x) / area;
    vec2 gradient = bump_gradient();
    along_u += n * (gradient.x - dot(n, along_u));
    along_v += n * (gradient.y - dot(n, along_v));
    vec3 found = normalize(cross(along_u, along_v));
    return dot(found, n) < 0.0 ? -found : found;
}

#endif

void main()
{
    vec3 n = normalize(v_normal);
    vec3 s = v_tangent - n * dot(n, v_tangent);
    s *= inversesqrt(max(dot(s, s), 1e-20));
    vec3 t = cross(n, s);
    vec3 smooth_normal = n;
#ifdef BUMP_MAPPED
    n = bumped(n);
#endif
#ifdef NORMAL_MAPPED
    vec3 mapped = looked_up(normal_map, normal_uv, v_texcoord, false, false);
    n = normalize(mapped.x * s + mapped.y * t + mapped.z * n);
#endif
    vec3 towards_eye = normalize(eye - v_position);
#ifdef TURNED
    n = facing(n, smooth_normal, towards_eye);
    s = normalize(s - n * dot(n, s));
    t = cross(n, s);
#endif
    vec3 wi = vec3(dot(towards_eye, s), dot(towards_eye, t), dot(towards_eye, n));
    float side = two_sided && wi.z < 0.0 ? -1.0 : 1.0;
    bool seen = side * wi.z > 0.0;
    wi.z = max(side * wi.z, LOWEST);

    vec3 pigment = v_colour;
#ifdef COLOUR_MAPPED
    pigment = looked_up(colour_map, colour_uv, v_texcoord, COLOUR_CLAMPED, COLOUR_NEAREST);
#endif
#if defined(LIVE) && defined(DIFFRACTING)
    pigment = mix(pigment, live_pigment.rgb, live_pigment.a);
#endif
    vec2 rotation = patch_frame(v_texcoord, v_axis);
#ifdef PIGMENT_IN_LIGHT
    pigment = pigment_in_light * pigment;
#endif
#ifdef PRINCIPLED
    base_colour = pigment;
#endif

#if defined(SHADOWED) || defined(LOOKED_UP)
    vec3 flat_normal = cross(dFdx(v_position), dFdy(v_position));
    flat_normal *= inversesqrt(max(dot(flat_normal, flat_normal), 1e-30));
    if (dot(flat_normal, towards_eye) < 0.0) flat_normal = -flat_normal;
#endif

    if (masked(v_texcoord)) discard;
    vec3 radiance = vec3(0.0);
#ifdef LOOKED_UP
#ifdef BOUNCES
    vec3 shift = fract(drawn_numbers().xyx * vec3(57.0, 83.0, 131.0)) - 0.5;
#ifdef PIGMENTED
    if (seen) radiance += light_colour[0] * pigment * transmission(wi, vec3(0.0, 0.0, 1.0), rotation)
            * bounced(ARRIVING, v_position, side * n, shift);
#endif
#endif
#ifdef LOBES
    vec3 wo = lobe_direction(wi, rotation, drawn_numbers());
    vec3 direction = wo.x * s + wo.y * t + side * wo.z * n;
    if (seen && wo.z > LOWEST && side * dot(direction, smooth_normal) > 0.0) {
        float distance;
        vec4 light = arriving(v_position, direction, distance);
        float density = lobe_density(wi, wo, rotation);
        bool met = distance < 1e30 && light.rgb == vec3(0.0);
        light *= distance < 1e30 ? surroundings_lit.y : surroundings_lit.x;
        if (distance >= 1e30 && dot(direction, dome.xyz) > 0.0) light.rgb += dome.w;
#ifdef OBSTACLES
        if (hidden(v_position, flat_normal, direction, distance)) {
            light = vec4(0.0);
            met = true;
        }
#endif
#ifdef BOUNCES
        if (met) light.rgb = bounced(LEAVING, v_position + distance * direction, -direction, shift);
#endif
#ifdef MONOCHROME
        light.rgb = vec3(dot(light.rgb, vec3(0.2126, 0.7152, 0.0722)));
#endif
#ifdef MIRROR
        light.w = 0.0;
#endif
        if (density > 0.0 && light.rgb != vec3(0.0))
            radiance += light.rgb * diffraction(wi, wo, rotation, 0)
                * (kept_by_facet(n, smooth_normal, direction) / (density + light.w));
    }
#endif
#else
    for (int i = 0; i < LIGHTS_LIT; ++i) {
        vec3 away = light_place[i].xyz - light_place[i].w * v_position;
        float square = dot(away, away);
        vec3 direction = away * inversesqrt(square);
        vec3 wo = vec3(dot(direction, s), dot(direction, t), side * dot(direction, n));
        bool lit = seen && wo.z > 0.0 && side * dot(direction, smooth_normal) > 0.0;
#ifdef SKIPS_UNLIT
        if (!lit) continue;
#endif
        wo.z = max(wo.z, LOWEST);
        vec3 added = vec3(0.0);
#ifdef PIGMENTED
        added += light_colour[i] * wo.z * (1.0 / PI) * pigment * transmission(wi, wo, rotation);
#endif
#if defined(LOBES) && !defined(MIRROR)
        float share = 1.0;
#ifdef WEIGHTED
        float drawn = light_density * square / max(emitted(direction), 1e-6);
        if (light_density != 0.0) share = drawn / max(drawn + lobe_density(wi, wo, rotation), 1e-20);
#endif
        added += share * diffraction(wi, wo, rotation, i);
#endif
        float falloff = kept_by_facet(n, smooth_normal, direction);
        if (light_place[i].w > 0.0) falloff /= square;
#ifdef SHADOWED
        if (i == 0) falloff *= emitted(direction) * reached(v_position, flat_normal);
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
#endif
#if defined(EMITTING) && !defined(WEIGHTED)
    if (dot(v_normal, towards_eye) > 0.0) radiance += surroundings_lit.y * emission;
#endif
    fragment = vec4(radiance, 1.0);
}
