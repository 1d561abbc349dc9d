// Light that surfaces send to each other, on a coarse grid; see bounces.py.

#ifdef BOUNCES
uniform sampler2D bounces;        // 12 entries a cell: kind, axis, sign
uniform vec3 bounces_low;
uniform float bounces_cell;
uniform ivec3 bounces_size;

const int LEAVING = 0, ARRIVING = 1;

// Mean radiance that leaves the surfaces in a cell along a direction, or arrives there from other
// surfaces at one with this normal. shift: from −0.5 to 0.5 cells, which smooths the mean of frames.
vec3 bounced(int kind, vec3 position, vec3 direction, vec3 shift)
{
    vec3 place = (position - bounces_low) / bounces_cell + shift;
    ivec3 cell = clamp(ivec3(floor(place)), ivec3(0), bounces_size - 1);
    int first = ((cell.z * bounces_size.y + cell.y) * bounces_size.x + cell.x) * 12 + 6 * kind;
    vec3 weights = direction * direction, sum = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis)
        sum += weights[axis] * entry(bounces, first + 2 * axis + (direction[axis] < 0.0 ? 1 : 0)).rgb;
#ifdef MONOCHROME
    sum = vec3(dot(sum, vec3(0.2126, 0.7152, 0.0722)));
#endif
    return sum;
}
#endif
