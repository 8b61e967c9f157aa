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
#include "engine/paging/page_statistics.h"
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

/// Error of a picture that was rendered to an error target.
struct AchievedError {
    ErrorTarget target;
    ErrorEstimate estimate;
    bool reached = false;  // the error is below the target at kConfidence
};

/// Estimate of the error of a denoised picture (held_out.h).
struct DenoisedError {
    ErrorMetric metric = ErrorMetric::relmse;
    ErrorEstimate estimate;
    int samples = 0;     // samples per pixel of each of the two held-out pictures
    double seconds = 0;  // time of rendering them
};

/// Statistics of a render.
struct RenderStats {
    int samples = 0;                                // samples per pixel of the band that has fewest
    bool interrupted = false;                       // the callback stopped the render
    double prepare_seconds = 0;                     // time of tables, hierarchies and upload, once per pose
    double compile_seconds = 0;                     // time of shaders that this render was the first to need
    double render_seconds = 0;                      // time of sampling
    std::uint64_t paths = 0;                        // number of paths: width x height x samples
    std::size_t gpu_bytes = 0;                      // size of the buffers and textures of scene and frame
    Estimator estimator;                            // estimator with all automatic choices resolved
    PrimaryVisibility primary{};                    // method used; never `automatic`
    Lens lens{};                                    // lens of the camera, focused at a distance; unset: a pinhole
    std::optional<CacheStatistics> radiance_cache;  // statistics, if used and settings.measure is set
    std::vector<PassTime> passes;                   // times of passes; empty without settings.measure
    std::vector<LeftOut> left_out;                  // parts that scene or settings did not need, with the reason
    std::vector<BadValues> bad_values;              // counts of invalid values, listed by pass
    std::vector<std::string> biases;        // reasons why the picture would not converge to the true light; phrases
    std::vector<std::string> layer_biases;  // biases that affect the layers, too
    std::optional<AchievedError> error;     // achieved error; none without an error target or if interrupted
    std::vector<rays::BatchStatistics> batches;  // statistics of each ray batch
    std::string tracing_note;                    // Tracer::note()
    std::vector<rays::RasterBatch> raster;       // statistics of raster culling for each ray batch
    struct Paging {
        paging::PagingStatistics tracing;
        std::uint64_t rows = 0;  // table rows of hits that were read
        double row_seconds = 0;  // seconds of reading them
    };
    std::optional<Paging> paging;                    // statistics of scenes that are loaded in pages
    std::optional<paging::TileStatistics> textures;  // statistics of textures that are loaded in tiles
    struct Neighbours {
        int frames = 0;      // number of neighbouring frames that the denoiser used
        int rendered = 0;    // number of frames rendered for this picture, itself included; others were held in memory
        double seconds = 0;  // time of denoising, seconds
    };
    bool denoised = false;                        // the denoiser has replaced the picture
    std::optional<DenoisedError> denoised_error;  // RenderSettings::denoise_error
    std::optional<Neighbours> neighbours;         // statistics of a frame that is denoised with others
    rays::HierarchyCounts hierarchies;            // hierarchies built, refitted or kept for this picture
};

/// A picture with its layers.
struct RenderResult {
    Image beauty;                // RGBA, scene-linear Rec.709; A: 0 only where neither surface nor environment is seen
    std::vector<ExrLayer> aovs;  // layers in the order of the request
    std::map<std::string, std::string> attributes;  // text that files need for the layers
    Image view;                                     // RGBA, display-encoded, [0,1]; empty unless wanted
    RenderStats stats;
};

/// Progress of a render.
struct RenderProgress {
    int samples_done = 0;   // submitted samples per pixel, the mean of all bands; the device may still work on the last
    int samples_total = 0;  // expected samples per pixel; with an error target an estimate
    double seconds = 0;     // time since the start of the render
    // Makes the picture of the samples so far. It equals a render of so many samples bit for bit, except with
    // SamplePoints::blue_noise, which depends on the final number. aovs: layers of the RenderSettings, and any for
    // which AovInfo::at_any_time() holds. Call it during the callback only. Empty if there is no picture: bands
    // differ in samples, or the sums of earlier bands are gone (ScheduleSettings::in_turns).
    std::function<RenderResult(const std::vector<std::string>& aovs)> picture{};
};
/// Callback after every sample of a band; false stops the render. The result then has the samples so far; bands that
/// were not begun have no samples and are black. Exceptions are passed on, and the renderer can be used again.
using ProgressCallback = std::function<bool(const RenderProgress&)>;

}  // namespace halflight
