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
