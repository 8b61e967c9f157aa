// Methods that trace a ray set, ready to be measured.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/gpu/context.h"
#include "engine/gpu/program_cache.h"
#include "engine/paging/page_schedule.h"
#include "engine/paging/pages.h"
#include "engine/rays/tiles.h"
#include "tools/measure/bench/embree_tracer.h"
#include "tools/measure/bench/ray_set.h"

namespace halflight::bench {

/// An additional figure of a method's run.
struct Figure {
    std::string name;  // quantity and unit, such as "queries" or "cull ms"
    double value = 0;
};

/// A method after its preparation for a ray set, which is not measured.
struct Prepared {
    std::function<void()> run;          // the measured work, which the GPU may finish later
    std::function<Answers()> answers;   // returns the last run's answers by path; undefined for paths without a ray
    std::string note = {};              // the method's choices; may be empty
    std::function<void()> before = {};  // called before every run, outside the measured time; optional
    std::function<std::vector<Figure>()> figures = {};  // returns figures from runs of its own; optional
};

struct Method {
    std::string name;
    bool exact = false;  // the answers must equal the plain tracer's bit for bit
    /// Prepares the method for a ray set, which must outlive the result.
    std::function<Prepared(const RaySet&)> prepare;
};

/// Inputs that methods share and that must outlive them.
struct Bench {
    const gpu::Context& context;
    gpu::ProgramCache& programs;
    const TraceTables& tables;
    const rays::PackedScene& packed;  // hierarchies and triangles of `tables`
    const rays::TraceScene& trace;    // buffers of `tables` and `packed`
    const EmbreeTracer& embree;
    rays::TileSettings tiles;
    const paging::PageSource* pages;  // the scene's page file; null: none
    std::size_t pool_bytes;           // bytes of a pool of pages
    paging::PageSchedule page_schedule;
};

/// Returns the names in the order of reports:
///   naive    naive.comp, rays along the picture's rows
///   plain    the engine's kernel without culling, rays in the order of the pass
///   compute  culling by tile lists, which every run makes anew
///   kept     culling by the tile lists of the run before: an upper bound of their saving, since the rays are the same
///   auto     the choice of Culling::automatic after its trials, with the lists of the run before
///   raster   culling by occlusion queries, with the state of the runs before over the same set
///   native   vector code of the processor, if it is the renderer, too
///   embree   Embree, ray by ray
///   packets  Embree, the fastest of its packet modes for that set
///   paged    the scene's page file (--pages), with the pool of the run before
///   paged-cold     the page file, from an empty pool
///   paged-half     as paged, but the pool has room for half of the pages that the set needs
///   paged-quarter  as paged-half, for a quarter
///   ceiling  plain with perfect culling: traverses only the treelet of up to 64 triangles that contains the hit
const std::vector<std::string>& method_names();
/// Returns the method of this name. Throws Error if it cannot take the scene.
Method make_method(const std::string& name, const Bench& bench);

}  // namespace halflight::bench
