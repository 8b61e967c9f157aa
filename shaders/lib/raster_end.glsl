// The end of rays for raster culling. Needs shaders/shared/ray_structs.h, shaders/lib/bvh.glsl and
// shaders/lib/raster_shaft.glsl.

// Returns an upper bound of a ray's end; negative if the ray misses the box of the whole hierarchy.
float end_of(Ray ray, BvhHead head) {
    BoxRay box = box_ray(ray.origin, ray.direction, head.base, head.cell, head.slack);
    vec3 lower = vec3(0.0), upper = vec3(kGridCells);
    if (kFloatNodes) {
        lower = head.base, upper = head.base + kGridCells * head.cell;
        lower -= abs(lower) * 1.1920928955078125e-7;  // 2^-23: rounding of the sum
        upper += abs(upper) * 1.1920928955078125e-7;
    }
    vec3 near = (mix(lower, upper, box.backward) - box.near_origin) * box.near_inverse;
    vec3 far = (mix(upper, lower, box.backward) - box.far_origin) * box.far_inverse;
    float begin = max(ray.t_min, greatest_of(near));
    float end = min(ray.t_max, min(far.x, min(far.y, far.z)));
    return begin > end ? -1.0 : end;
}
