// A picture and its statistics, and the progress of a render. No OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/replicates.h"
#include "engine/io/exr.h"
#include "engine/rays/batch_statistics.h"
#include "engine/rays/hierarchies.h"
#include "engine/rays/raster_walk.h"
#include "engine/settings/estimator.h"
#include "engine/settings/frame_settings.h"
#include "engine/settings/preview.h"
#include "engine/settings/visibility.h"
#include "passes/picture/bad_values.h"
#include "renderer/needs.h"

namespace halflight {

struct PassTime {
    std::string name;
    std::uint64_t runs = 0;
    double seconds = 0;
};

/// Of a picture that was rendered to an error.
struct AchievedError {
    ErrorTarget target;
    ErrorEstimate estimate;
    bool reached = false;  // the target, at kConfidence
};

struct RenderStats {
    int samples = 0;                                // per pixel, done; those of the band that has fewest
    bool interrupted = false;                       // by the callback
    double prepare_seconds = 0;                     // tables, hierarchies, upload, once for all pictures of a pose
    double compile_seconds = 0;                     // shaders that this render was the first to need
    double render_seconds = 0;                      // samples
    std::uint64_t paths = 0;                        // width x height x samples
    std::size_t gpu_bytes = 0;                      // buffers and textures, scene and frame
    Estimator estimator;                            // nothing in it is left to the scene any more
    PrimaryVisibility primary{};                    // nor is this
    std::optional<CacheStatistics> radiance_cache;  // where it was used, with settings.measure
    std::vector<PassTime> passes;                   // with settings.measure, else empty
    std::vector<LeftOut> left_out;                  // what the scene or the settings did not need, with the reason
    std::vector<BadValues> bad_values;
    std::vector<std::string> biases;        // why the picture would not converge to the light that there is; phrases
    std::vector<std::string> layer_biases;  // those of them that its layers have, too
    std::optional<AchievedError> error;     // where one was asked for, unless interrupted
    std::vector<rays::BatchStatistics> batches;  // how rays were traced
    std::vector<rays::RasterBatch> raster;       // with raster culling: what it did
    rays::HierarchyCounts hierarchies;           // what became of them before this picture
};

struct RenderResult {
    Image beauty;                // RGBA, scene-linear Rec.709; A: 0 only where neither surface nor environment is seen
    std::vector<ExrLayer> aovs;  // in the order asked for
    std::map<std::string, std::string> attributes;  // text that files need beside the AOVs
    Image view;                                     // RGBA, display-encoded, [0,1]; empty unless wanted
    RenderStats stats;
};

struct RenderProgress {
    int samples_done = 0;   // per pixel, the mean of all bands
    int samples_total = 0;  // as far as is known: with an error to reach, what it seems to take
    double seconds = 0;
    // Makes the picture of the samples so far, bit for bit that of a render of so many (but with
    // SamplePoints::blue_noise, which is of the number that there will be), with these AOVs: some of those of the
    // RenderSettings, and any that are there at any time. To be called during the callback. Empty where there is none:
    // bands differ in samples, or sums of earlier bands are gone (in_turns).
    std::function<RenderResult(const std::vector<std::string>& aovs)> picture{};
};
/// Called after every sample of a band; false stops early. What is done is returned: bands that were not begun are
/// black and have no samples. What it throws is passed on, and the renderer can be used again.
using ProgressCallback = std::function<bool(const RenderProgress&)>;

}  // namespace halflight
