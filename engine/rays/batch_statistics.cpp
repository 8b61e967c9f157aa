#include "engine/rays/batch_statistics.h"

#include <algorithm>

namespace halflight::rays {

void add(BatchStatistics& to, const BatchStatistics& of) {
    for (std::size_t method = 0; method < kTraceMethods; ++method) {
        BatchStatistics::Measured& m = to.measured[method];
        const BatchStatistics::Measured& n = of.measured[method];
        m.runs += n.runs;
        m.timed += n.timed;
        m.seconds += n.seconds;
        m.best += n.best;
        m.rays += n.rays;
    }
    to.steps.cull += of.steps.cull;
    to.steps.search += of.steps.search;
    to.steps.rest += of.steps.rest;
    to.tiles += of.tiles;
    to.tiles_culled += of.tiles_culled;
    to.lists.tiles += of.lists.tiles;
    to.lists.entries += of.lists.entries;
    to.lists.leaves += of.lists.leaves;
    to.lists.longest = std::max(to.lists.longest, of.lists.longest);
    to.lists.rays += of.lists.rays;
    to.lists.rest_rays += of.lists.rest_rays;
    to.lists.remembered += of.lists.remembered;
    to.native_alone.rays += of.native_alone.rays, to.native_alone.seconds += of.native_alone.seconds;
    to.native_together.rays += of.native_together.rays, to.native_together.seconds += of.native_together.seconds;
    to.state_bytes += of.state_bytes;
}

}  // namespace halflight::rays
