// Evaluate a method's function at one set of arguments per fragment, for tests and timings.

#ifdef PAIRED
uniform sampler2D directions;  // ωi in the first row, ωo in the second
#endif
uniform sampler2D places;  // u, v, z = w·height_scale, cosine at the half vector

out vec4 fragment;

void main()
{
#ifdef PAIRED
    ivec2 column = ivec2(gl_FragCoord.x, 0);
    vec3 wi = texelFetch(directions, column, 0).xyz;
    vec3 wo = texelFetch(directions, column + ivec2(0, 1), 0).xyz;
#ifndef ORDERS
    begin_pair(wi, wo, vec2(wi.z, wo.z));
#endif
#endif
    vec4 place = texelFetch(places, ivec2(gl_FragCoord.xy), 0);
#ifdef ORDERS
#ifndef PAIRED
    vec3 wi = vec3(0.0, 0.0, 1.0), wo = vec3(place.xy, sqrt(1.0 - dot(place.xy, place.xy)));
#endif
    fragment = vec4(diffraction(wi, wo, vec2(1.0, 0.0), 0), 1.0);
#else
    fragment = vec4(diffracted(place.xy, place.z, place.w, 0), 1.0);
#endif
}
