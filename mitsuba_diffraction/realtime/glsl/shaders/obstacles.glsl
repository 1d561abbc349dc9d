// Whether the scene stands in the way of a ray; see surroundings.py.

#ifdef OBSTACLES
uniform sampler2D obstacles;      // distances from the nearest surface over OBSTACLES cells
uniform vec3 obstacles_low;
uniform float obstacles_cell;
uniform ivec3 obstacles_size;

bool hidden(vec3 position, vec3 normal, vec3 direction, float farthest)
{
    // beyond the cells that the surface itself lies in
    vec3 place = (position - obstacles_low) / obstacles_cell + 1.75 * normal;
    float gone = 0.0;
    farthest /= obstacles_cell;
    for (int i = 0; i < 96; ++i) {
        ivec3 cell = ivec3(floor(place + gone * direction));
        if (gone > farthest || any(lessThan(cell, ivec3(0)))
            || any(greaterThanEqual(cell, obstacles_size))) return false;
        int number = (cell.z * obstacles_size.y + cell.y) * obstacles_size.x + cell.x;
        float apart = OBSTACLES * entry(obstacles, number).r;
        if (apart == 0.0) return true;
        gone += max(apart - 1.0, 0.5);  // ray and surface may lie half a diagonal off the middles
    }
    return false;
}
#endif
