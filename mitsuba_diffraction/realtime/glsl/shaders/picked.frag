// Point under the page's cursor: directions of eye and light in the patch's axes.

uniform vec3 eye;
uniform vec4 light_place[LIGHTS];
uniform float surface_number;

layout(location = 0) out vec4 picked_wi;
layout(location = 1) out vec4 picked_wo;

void main()
{
    vec3 n = normalize(v_normal);
    vec3 s = normalize(v_tangent - n * dot(n, v_tangent));
    vec3 t = cross(n, s);
    if (masked(v_texcoord)) discard;
    vec2 rotation = patch_frame(v_texcoord, v_axis);
    float stretch = length(rotation);
    rotation /= stretch;
    vec3 wi = normalize(eye - v_position);
    if (dot(wi, n) < 0.0) n = -n;
    vec3 wo = normalize(light_place[0].xyz - light_place[0].w * v_position);
    vec3 wi_local = vec3(dot(wi, s), dot(wi, t), dot(wi, n));
    vec3 wo_local = vec3(dot(wo, s), dot(wo, t), dot(wo, n));
    picked_wi = vec4(in_patch(wi_local, rotation), wi_local.z, surface_number + 1.0);
    picked_wo = vec4(in_patch(wo_local, rotation), wo_local.z, stretch);
}
