// Directions drawn from a surface's specular or diffraction lobes, and their probability densities.

#if defined(DIFFRACTING)

uniform sampler2D lobe_places;     // points (u, v), as dense as the lobes are bright
uniform sampler2D lobe_densities;  // density per area of (u, v): azimuths × rings
uniform float lobe_smallest;       // radius of the innermost cell
uniform float lobe_step;           // width of the other cells in ln r

float lobe_density(vec3 wi, vec3 wo, vec2 rotation)
{
    vec2 uv = in_patch(wi + wo, rotation);
    ivec2 cells = textureSize(lobe_densities, 0);
    float ring = log(max(dot(uv, uv), 1e-20) / (lobe_smallest * lobe_smallest)) * (0.5 / lobe_step);
    ivec2 cell = ivec2(turn_of(uv) * float(cells.x), floor(ring) + 1.0);
    cell = clamp(cell, ivec2(0), cells - 1);
    return texelFetch(lobe_densities, cell, 0).r * wo.z * dot(rotation, rotation);
}

vec3 lobe_direction(vec3 wi, vec2 rotation, vec2 drawn)
{
    int number = min(int(drawn.x * float(LOBE_PLACES)), LOBE_PLACES - 1);
    vec2 uv = entry(lobe_places, number).xy;
    vec2 sum = (rotation.x * uv + rotation.y * vec2(-uv.y, uv.x)) / dot(rotation, rotation);
    vec2 along = sum - wi.xy;
    return vec3(along, sqrt(max(1.0 - dot(along, along), 0.0)));
}

#elif defined(MIRROR)

float lobe_density(vec3 wi, vec3 wo, vec2 rotation) { return 1.0; }
vec3 lobe_direction(vec3 wi, vec2 rotation, vec2 drawn) { return vec3(-wi.xy, wi.z); }

#elif defined(GLOSS)

float lobe_density(vec3 wi, vec3 wo, vec2 rotation)
{
    vec3 h = normalize(wi + wo);
    return microfacets(h.z) * h.z / max(4.0 * dot(wi, h), 1e-6);
}

vec3 lobe_direction(vec3 wi, vec2 rotation, vec2 drawn)
{
#ifdef GGX
    float steepness = drawn.x / max(1.0 - drawn.x, 1e-6);
#else
    float steepness = -log(max(1.0 - drawn.x, 1e-6));
#endif
    float slope = gloss_alpha * sqrt(steepness), turn = 2.0 * PI * drawn.y;
    vec3 h = normalize(vec3(slope * cos(turn), slope * sin(turn), 1.0));
    return 2.0 * dot(wi, h) * h - wi;
}

#endif
