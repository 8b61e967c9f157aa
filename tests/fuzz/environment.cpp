#include "engine/io/environment.h"

#include <cmath>

#include "engine/tables/environment_warp.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {

void environment(std::string_view input) {
    const MemoryFile file(input);
    ExrLimits limits;
    limits.max_side = 1024;  // small files can hold large pictures
    check_errors(file.path().string(), [&] {
        SceneReport report;
        const Environment loaded = load_environment(file.path(), report, limits);
        const Image& map = loaded.map;
        if (map.pixels.empty() != loaded.black()) throw Broken("neither a map nor black");
        if (loaded.black()) return;
        for (const float v : map.pixels)
            if (!(std::isfinite(v) && v >= 0)) throw Broken("a texel is not finite or negative");
        const EnvironmentCells cells = environment_cells(map);
        if (!std::isfinite(cells.integral)) throw Broken("the integral of the map is not finite");
        for (const double weight : cells.weights)
            if (!(std::isfinite(weight) && weight >= 0)) throw Broken("a weight is not finite or negative");
    });
}

}  // namespace halflight::fuzz
