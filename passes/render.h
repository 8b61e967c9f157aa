// The renderer: a scene, settings, a picture.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/color/color.h"
#include "engine/core/image.h"
#include "engine/gpu/context.h"
#include "engine/io/exr.h"
#include "engine/rays/tracer.h"
#include "engine/scene/scene.h"

namespace halflight {

/// An arbitrary output variable that can be asked for by name.
struct AovInfo {
    std::string_view name;         // EXR layer ("albedo", "depth")
    std::string_view channels;     // after the layer's name ("RGB", "XYZ", "Z")
    std::string_view description;  // one line with units
    bool debug = false;            // tells how the picture was made, not what it shows; may differ from run to run
};
/// Those for debugging come last.
std::span<const AovInfo> known_aovs();

struct RenderSettings {
    int width = 1280;  // pixels, > 0
    int height = 720;  // pixels, > 0
    Camera camera;
    std::optional<Camera> previous_camera;  // of the frame before, for the motion output; without: `camera`
    int samples = 64;                       // per pixel, > 0
    double time_limit = 0;    // seconds; > 0: samples are added until it is spent, at least one, `samples` at most
    int bounces = 8;          // reflections along a path, >= 0: 0 emission only, 1 direct light
    std::uint32_t seed = 0;   // independent pictures of the same frame
    std::uint32_t frame = 0;  // frame number: other noise for every frame
    std::vector<std::string> aovs;  // names of known_aovs(); Error for others
    bool half_color = false;        // colour layers as half floats; data stays float32
    bool want_view = false;         // also the picture through `view`
    ViewTransform view;
    rays::Culling culling = rays::Culling::automatic;  // who finds hits; never changes the picture
    bool measure = false;  // wait for the GPU after each pass to tell its time, and count rays and culling (slower)
};

struct RenderProgress {
    int samples_done = 0;
    int samples_total = 0;
    double seconds = 0;
};
/// Called after every sample; false stops early (what is done is returned).
using ProgressCallback = std::function<bool(const RenderProgress&)>;

struct PassTime {
    std::string name;
    std::uint64_t runs = 0;
    double seconds = 0;
};

struct NonFiniteCount {
    std::string component;
    std::uint64_t values = 0;  // replaced by zero before accumulation
};

struct RenderStats {
    int samples = 0;                    // per pixel, done
    bool interrupted = false;           // by the callback
    double prepare_seconds = 0;         // tables, hierarchies, upload
    double compile_seconds = 0;         // shaders that this render was the first to need
    double render_seconds = 0;          // samples
    std::uint64_t paths = 0;            // width x height x samples
    std::size_t gpu_bytes = 0;          // buffers and textures, scene and frame
    std::vector<PassTime> passes;       // with settings.measure, else empty
    std::vector<std::string> left_out;  // passes that the scene or the settings did not need, with the reason
    std::vector<NonFiniteCount> non_finite;
    std::vector<rays::BatchStatistics> batches;  // how rays were traced
    std::vector<rays::RasterKind> raster;        // with raster culling: what it did
};

struct RenderResult {
    Image beauty;                // RGBA, scene-linear Rec.709; A: 0 only where neither surface nor environment is seen
    std::vector<ExrLayer> aovs;  // in the order asked for
    Image view;                  // RGBA, display-encoded, [0,1]; empty unless wanted
    RenderStats stats;
};

/// Needs its context current on the calling thread for as long as it lives. Scene and context must outlive it.
class Renderer {
  public:
    /// Uploads the scene and compiles what it needs. Throws Error for settings out of range and for limits of the
    /// driver.
    Renderer(gpu::Context&, const Scene&, const ColorConfig&, RenderSettings);
    Renderer(Renderer&&) noexcept;
    ~Renderer();

    RenderResult render(const ProgressCallback& = {});
    /// The compiled frame graph in Graphviz' dot language.
    std::string graph_dot() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight
