// The table of block instances that kernels read.
#pragma once

#include <vector>

#include "engine/tables/tables.h"

namespace halflight {

/// Returns the rows of all block instances as shaders/shared/instance_texels.h lays them out.
std::vector<vec4> instance_rows(const TraceTables& tables);

}  // namespace halflight
