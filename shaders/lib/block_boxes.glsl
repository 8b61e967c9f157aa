// Boxes inside an instance, as boxes of the hierarchy over the instances. Needs shaders/lib/{bvh,chord}.glsl.

// Returns the enlargement of boxes around boxes of a block, in the units of the shaft. If box_ray() of the block finds
// a hit with a box, the hierarchy's test of the box around it must find one at no larger t. The entry by the block's
// test has an error of 2^-19 (slack) + 2^-19 (slab) of the block's reach, and its image has four roundings more. The
// block's reach consists of two lengths, each at most twice the world's reach times the condition number. All errors
// are below 2^-16 of the condition times the reach, twice the slack of the hierarchy over instances
// (engine/rays/packed_bvh.cpp).
vec3 block_margin(ShaftSpace space, Shaft shaft) { return 4.0 * shaft_margin(space, shaft.origin_lower, shaft.origin_upper); }

// Transforms four boxes, lower and upper by axis (Arvo 1990, Transforming Axis-Aligned Bounding Boxes).
void boxes_around(ShaftSpace space, BvhHead block, uint instance, vec3 margin, vec4 lower[3], vec4 upper[3],
                  out vec4 around_lower[3], out vec4 around_upper[3]) {
    vec4 from[3];
    vec4 to[3];
    for (int a = 0; a < 3; ++a) {
        from[a] = kFloatNodes ? lower[a] : block.base[a] + lower[a] * block.cell[a];
        to[a] = kFloatNodes ? upper[a] : block.base[a] + upper[a] * block.cell[a];
    }
    for (int a = 0; a < 3; ++a) {
        vec4 row = instance_row(instance, kInstanceBlockToWorld, a);
        vec4 l = vec4(row.w - space.base[a]);
        vec4 u = l;
        for (int c = 0; c < 3; ++c) {
            l += min(row[c] * from[c], row[c] * to[c]);
            u += max(row[c] * from[c], row[c] * to[c]);
        }
        l = l / space.cell[a] - margin[a];
        u = u / space.cell[a] + margin[a];
        if (!kFloatNodes) {
            l = clamp(floor(l), 0.0, kGridCells);
            u = clamp(ceil(u), 0.0, kGridCells);
        }
        // A missing child stays empty.
        bvec4 there = lessThanEqual(lower[a], upper[a]);
        around_lower[a] = mix(lower[a], l, there);
        around_upper[a] = mix(upper[a], u, there);
    }
}
