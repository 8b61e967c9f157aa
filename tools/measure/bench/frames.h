// Measures whole frames, with and without culling and its state: the samples of a still frame, and the views of a
// moving camera.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/gpu/context.h"
#include "engine/rays/tracer.h"
#include "tools/measure/bench/measure.h"

namespace halflight::bench {

/// Returns the names of the tracing methods of frames, in the order of reports:
///   naive    the tracer of naive.comp; its hits differ from the others' by rounding
///   off      no culling
///   compute  Culling::compute
///   fresh    Culling::compute, its state discarded before every frame
///   auto     Culling::automatic, including its trials
///   raster   Culling::raster
const std::vector<std::string>& variant_names();

struct FrameOrder {
    std::vector<std::string> variants;  // members of variant_names()
    ivec2 size{0};                      // size of the picture, pixels
    int bounces = 8;                    // >= 0
    int samples = 64;                   // number of samples of the still frame, > 0
    int views = 48;                     // number of views of the moving camera, one sample each, >= 0
    int reference = 0;                  // number of samples of the reference picture for errors; 0: no errors
};

/// Times of one variant's frames, or of the samples of its still frame.
struct Series {
    std::string variant;
    std::vector<Seconds> frames;
    /// Times of the passes that serve a ray batch, by frame. The key is the batch's RayKind, preceded by "later" for
    /// all but the first batch of that kind in a frame.
    std::map<std::string, std::vector<Seconds>> batches;
    std::vector<rays::BatchStatistics> chosen;  // statistics of the last frame
};

struct ErrorPoint {
    int samples = 0;
    double relative_mse = 0;
    double trimmed_mse = 0;  // relative_mse without the worst thousandth of all values, which may dominate it
};

struct FrameResult {
    std::vector<Series> still;
    std::vector<Series> moving;      // series in the order of `still`
    std::vector<ErrorPoint> errors;  // errors of the still frame, which all variants share
    // Pixels whose means differ in any bit from the first variant's; "fresh" and "naive" are not compared.
    std::size_t different = 0;
};

/// Measures the variants in turns, in another order each time. The camera swings around the middle of its view, by two
/// degrees from one view to the next. Shaders are compiled and memory is allocated before the measurement, and all
/// state is discarded then. Calls between() between frames; an exception from it ends the run. Throws Error if a
/// frame does not fit into one band.
FrameResult measure_frames(gpu::Context& context, const Scene& scene, const TraceTables& tables,
                           const rays::PackedScene& packed, const Camera& camera, const FrameOrder& order,
                           const std::function<void()>& between);

}  // namespace halflight::bench
