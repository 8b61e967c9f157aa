// Rays in the space of a block instance. Needs shaders/geometry_tables.glsl.
#include "shaders/shared/ray_structs.h"

// Returns the ray in the space of a block; t is unchanged, because the direction is not normalized.
Ray ray_in_block(Ray ray, uint instance) {
    vec4 rows[3] = vec4[3](instance_row(instance, kInstanceWorldToBlock, 0),
                           instance_row(instance, kInstanceWorldToBlock, 1),
                           instance_row(instance, kInstanceWorldToBlock, 2));
    precise vec3 origin;
    precise vec3 direction;
    for (int i = 0; i < 3; ++i) {
        origin[i] = rows[i].x * ray.origin.x + rows[i].y * ray.origin.y + rows[i].z * ray.origin.z + rows[i].w;
        direction[i] = rows[i].x * ray.direction.x + rows[i].y * ray.direction.y + rows[i].z * ray.direction.z;
    }
    return Ray(origin, ray.t_min, direction, ray.t_max);
}
