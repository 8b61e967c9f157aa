// Ways to trace a ray set, ready to be measured.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/gpu/context.h"
#include "engine/gpu/program.h"
#include "engine/rays/tiles.h"
#include "tools/measure/bench/embree_tracer.h"
#include "tools/measure/bench/ray_set.h"

namespace halflight::bench {

/// What else is to be told of a method's run.
struct Figure {
    std::string name;  // "queries", "cull ms"
    double value = 0;
};

/// A method with a ray set uploaded and all else done that is not to be measured.
struct Prepared {
    std::function<void()> run;          // all of the work, again and again; may leave work to the GPU
    std::function<Answers()> answers;   // of the last run, by path; undefined where no ray was to be traced
    std::string note = {};              // what was chosen; may be empty
    std::function<void()> before = {};  // not measured, ahead of every run; optional
    std::function<std::vector<Figure>()> figures = {};  // of runs of its own, made to look at them; optional
};

struct Method {
    std::string name;
    bool exact = false;  // its answers are to be the plain tracer's, bit for bit
    /// The set must outlive what is returned.
    std::function<Prepared(const RaySet&)> prepare;
};

/// What methods trace with; outlives them.
struct Bench {
    const gpu::Context& context;
    gpu::ProgramCache& programs;
    const TraceTables& tables;
    const rays::PackedScene& packed;  // of the tables
    const rays::TraceScene& trace;    // of both
    const EmbreeTracer& embree;
    rays::TileSettings tiles;
};

/// Names in the order of reports:
///   naive    naive.comp, rays along the picture's rows
///   plain    the engine's kernel without culling, rays in the order of the pass
///   compute  culling by tile lists, which every run makes anew
///   kept     the same with the lists of the run before: what they could save at most, the rays being the very same
///   auto     what Culling::automatic takes after its trials; knows the lists of the run before
///   raster   culling by occlusion queries; its state is that of the runs before over the same set
///   embree   Embree, ray by ray
///   packets  Embree, the fastest of its packet and stream modes for that set
///   ceiling  plain with perfect culling: only the treelet of up to 64 triangles that holds the hit is traversed, and
///            nothing where there is none
const std::vector<std::string>& method_names();
/// Throws Error where a method cannot take the scene.
Method make_method(const std::string& name, const Bench& bench);

}  // namespace halflight::bench
