// Whether the scene obstructs a ray, and where; see surroundings.py.

#ifdef OBSTACLES
uniform sampler2D obstacles;      // distance of the nearest surface, in units of OBSTACLES cells
uniform vec3 obstacles_low;
uniform float obstacles_cell;
uniform ivec3 obstacles_size;

// Whether a surface is nearer than `farthest`, which then becomes its distance.
bool hidden(vec3 position, vec3 normal, vec3 direction, inout float farthest)
{
    // start beyond the cells of the surface at `position`
    vec3 place = (position - obstacles_low) / obstacles_cell + 1.75 * normal;
    vec3 behind = min(place, vec3(obstacles_size) - place);
    if (min(behind.x, min(behind.y, behind.z)) < 0.0) return false;
    vec3 ahead = mix(place, vec3(obstacles_size) - place, greaterThan(direction, vec3(0.0)));
    ahead /= max(abs(direction), 1e-6);
    float last = min(min(ahead.x, ahead.y), min(ahead.z, farthest / obstacles_cell));
    float gone = 0.0;
    for (int i = 0; i < 96; ++i) {
        if (gone > last) return false;
        ivec3 cell = min(ivec3(max(place + gone * direction, 0.0)), obstacles_size - 1);
        int number = (cell.z * obstacles_size.y + cell.y) * obstacles_size.x + cell.x;
        float apart = OBSTACLES * entry(obstacles, number).r;
        if (apart == 0.0) {
            farthest = gone * obstacles_cell;
            return true;
        }
        gone += max(apart - 1.0, 0.5);  // less 1: distances are those between cells' middles
    }
    return false;
}
#endif
