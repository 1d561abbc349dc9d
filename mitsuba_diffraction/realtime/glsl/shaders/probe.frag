// A method's own function at given places, one a fragment: for checks and timings.

uniform sampler2D places;  // u, v, z = w·height_scale, cosine at the half vector

out vec4 fragment;

void main()
{
    vec4 place = texelFetch(places, ivec2(gl_FragCoord.xy), 0);
    fragment = vec4(diffracted(place.xy, place.z, place.w, 0), 1.0);
}
