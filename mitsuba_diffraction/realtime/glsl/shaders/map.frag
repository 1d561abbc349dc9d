// BRDF for one light direction over all view directions, seen from above, for a display.

uniform vec3 light_direction;  // in the patch's axes
uniform float exposure;
uniform float stretch;         // of the patch
uniform float side;            // size of the map, pixels

out vec4 fragment;

void main()
{
    vec2 place = 2.0 * gl_FragCoord.xy / side - 1.0;
    float square = dot(place, place);
    vec3 found = vec3(0.0);
#ifdef DIFFRACTING
    if (square < 0.999 && light_direction.z > 0.0) {
        vec3 wi = vec3(place, sqrt(1.0 - square));
        found = diffraction(wi, light_direction, vec2(stretch, 0.0), 0);
    }
#endif
    fragment = vec4(encoded_colour(found * exposure), 1.0);
}
