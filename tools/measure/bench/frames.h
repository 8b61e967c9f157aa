// Whole frames instead of rays alone: what culling and its state are worth to a picture that gets better sample by
// sample, and to a camera that moves.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/gpu/context.h"
#include "engine/rays/tracer.h"
#include "tools/measure/bench/measure.h"

namespace halflight::bench {

/// Ways to have frames traced, in the order of reports:
///   naive    the tracer of naive.comp; its hits are the others' but for rounding
///   off      plain
///   compute  Culling::compute
///   fresh    the same, but all state is forgotten ahead of every frame
///   auto     Culling::automatic, its trials included
///   raster   Culling::raster
const std::vector<std::string>& variant_names();

struct FrameOrder {
    std::vector<std::string> variants;  // of variant_names()
    ivec2 size{0};
    int bounces = 8;    // >= 0
    int samples = 64;   // of the still frame, > 0
    int views = 48;     // of the moving camera, one sample each; 0: it does not move
    int reference = 0;  // samples of the picture that errors are measured from; 0: they are not
};

/// One variant's frames, or samples of the same frame.
struct Series {
    std::string variant;
    std::vector<Seconds> frames;
    /// Of the passes that serve a ray batch, per frame: by its RayKind, from its second one in a frame on "later ..."
    std::map<std::string, std::vector<Seconds>> batches;
    std::vector<rays::BatchStatistics> chosen;  // at the end
};

struct ErrorPoint {
    int samples = 0;
    double relative_mse = 0;
    double trimmed_mse = 0;  // the same without the worst thousandth of all values, which may make up most of it
};

struct FrameResult {
    std::vector<Series> still;
    std::vector<Series> moving;      // the same variants
    std::vector<ErrorPoint> errors;  // of the still frame: the same for all variants
    // Pixels whose means are not the first variant's, bit for bit; "fresh" has none, and "naive" need not agree.
    std::size_t different = 0;
};

/// Samples of the variants are taken in turns, in another order each time. The camera goes to and fro around the
/// middle of what it sees, two degrees from one view to the next. Shaders are compiled and memory is allocated before
/// anything is measured; then all is forgotten. between() is called between frames; what it throws ends the run. Throws
/// Error where a frame does not fit into one band.
FrameResult measure_frames(gpu::Context& context, const Scene& scene, const TraceTables& tables,
                           const rays::PackedScene& packed, const Camera& camera, const FrameOrder& order,
                           const std::function<void()>& between);

}  // namespace halflight::bench
