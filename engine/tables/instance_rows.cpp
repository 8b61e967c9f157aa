#include "engine/tables/instance_rows.h"

#include "shaders/shared/instance_texels.h"

namespace halflight {

std::vector<vec4> instance_rows(const TraceTables& tables) {
    std::vector<vec4> rows;
    rows.reserve(tables.instances.size() * shared::kInstanceStride);
    for (const BlockInstance& instance : tables.instances) {
        for (const glm::mat4x3& m : {instance.block_to_world, instance.world_to_block})
            for (int r = 0; r < 3; ++r) rows.emplace_back(m[0][r], m[1][r], m[2][r], m[3][r]);
        rows.emplace_back(instance.identity ? 0 : 1, 0, 0, 0);
    }
    return rows;
}

}  // namespace halflight
