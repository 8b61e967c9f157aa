// Pictures of a loaded scene: single ones, and frames of a sequence with or without motion blur.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/halflight/loaded_scene.h"
#include "api/halflight/log.h"
#include "engine/color/color.h"
#include "engine/gpu/context.h"
#include "engine/settings/render_settings.h"
#include "renderer/checkpoint.h"
#include "renderer/render_result.h"

namespace halflight {

namespace rays {
class BatchServer;
class TraceScene;
}  // namespace rays
class NoisyFiles;

/// Place of the frame's time in the opening of the shutter.
enum class ShutterPosition : std::uint8_t { start, centre, end };
inline constexpr std::array kShutterPositions = {ShutterPosition::start, ShutterPosition::centre, ShutterPosition::end};
const char* name(ShutterPosition position);
/// Throws Error about `subject` for other names.
ShutterPosition parse_shutter_position(const std::string& subject, const std::string& text);

/// Motion blur: the shutter is open around the time of each frame, and each sample has a time in it. A camera that
/// jumps (LoadedScene::shot()) shows the shot of the frame's own time alone.
struct Shutter {
    double open = 0;             // opening time in frames, [0, kMostShutter]; 0: no motion blur
    std::optional<int> times{};  // number of poses in the opening time, >= 1; none: chosen by shutter_times()
    ShutterPosition position = ShutterPosition::centre;
    // Share of the opening time in which the shutter opens and closes, at equal speed, [0,1]; 0: it is open or closed.
    double ramp = 0;
};
inline constexpr double kMostShutter = 100;

/// Returns the number of shutter times that samples share (SceneSettings::shutter_times); 0: each sample has its own.
/// Scene and settings decide if the number is left open. Samples then share times if their poses would take more than a
/// quarter of the time of the samples, or if sampling is adaptive. Without motion blur, returns 1.
int shutter_times(const Shutter& shutter, const LoadedScene& scene, const RenderSettings& settings, int samples);

/// Returns the number of bounces if PictureSettings::bounces leaves it open: more if some material is solid.
int default_bounces(const Scene& scene);

/// Requests the layers of the light groups of a scene, and no others of light groups. Renderers of frames do so.
void request_light_groups(RenderSettings& settings, const Scene& scene);

/// Returns "open for 0.5 of a frame, 8 times", the text in files; empty without motion blur.
std::string shutter_text(const Shutter& shutter, const LoadedScene& scene, const RenderSettings& settings);

/// Counts of the vertices that a renderer deformed for a frame: by morph targets and skins.
struct DeformCounts {
    std::size_t vertices = 0;
    std::size_t vertices_on_cpu = 0;  // number of vertices beyond the limits of the driver
    double seconds = 0;               // CPU time, seconds
};

/// Makes the ray server of a prepared scene (api/halflight/ray_server.h). Both outlive the renderer's pictures.
using RayServerFactory = std::function<std::shared_ptr<rays::BatchServer>(const rays::TraceScene& scene)>;

/// Checkpoints of a picture (renderer/checkpoint.h).
struct CheckpointOptions {
    std::filesystem::path folder;  // folder of the checkpoint, which holds nothing else
    double interval = 60;          // seconds between two saves, > 0
    bool fresh = false;            // removes the samples that an earlier run has saved
    int part = 0;  // number of the only part of the samples that is rendered, 1 to FrameSettings::parts; 0: all samples
};

/// Checkpoints of the frames of a sequence. Each frame has one of its own, and neighbours that the denoiser uses go on
/// from theirs, unless another process renders them.
struct FrameCheckpoints {
    // Returns the folder of a frame's checkpoint; none: the frame has no checkpoint.
    std::function<std::optional<std::filesystem::path>(FrameNumber frame)> folder;
    double interval = 60;  // seconds between two saves, > 0
    bool fresh = false;    // removes the samples of a frame that an earlier run has saved, when it is its turn
};

struct RendererOptions {
    gpu::ContextOptions device{};             // options for the context that the renderer makes
    std::shared_ptr<gpu::Context> context{};  // shared context; null: the renderer makes one
    std::optional<ColorConfig> colors{};      // colour config; none: ColorConfig::load()
    Shutter shutter{};
    RayServerFactory ray_server{};  // serves all ray batches in place of RenderSettings::culling; empty: none
    // Frees meshes and images of the scene once they are uploaded (LoadedScene::free_surfaces()), for programs that use
    // the scene for nothing else. Pictures after an edit, or after a picture that failed, throw Error. The option is
    // ignored if surfaces move.
    bool frees_scene = false;
    // The frame of the settings goes on from a checkpoint, and saves its samples; other frames do not. The constructor
    // throws Error if the checkpoint has other settings or another scene.
    std::optional<CheckpointOptions> checkpoint{};
    std::optional<FrameCheckpoints> frame_checkpoints{};  // excludes `checkpoint`
    // Folders of the complete checkpoints of all parts, in order (FrameSettings::parts). The frame of the settings is
    // made of their sums. The constructor throws Error if one is missing or of another picture.
    std::vector<std::filesystem::path> merged{};
    // Files of noisy frames, which render_sequence() makes; null: frames are held in memory only.
    std::shared_ptr<NoisyFiles> noisy_files{};
    int exr_tile = 0;  // side of the tiles of the .exr, pixels, for the memory estimate; 0: it has lines
};

/// Returns options whose context keeps compiled shaders in the default folder, $XDG_CACHE_HOME/halflight/programs.
gpu::ContextOptions default_device(std::string device = "");

/// Logs the exposure of display pictures if a physical camera decides it, or if metering has found it for a requested
/// view and it is not 0. Warns of emissive and unlit materials, and of an environment, that are black at this exposure,
/// and of lamps that have no size or no alpha.
void note_exposure(const ViewTransform& requested, const RenderSettings& used, const LoadedScene& scene,
                   const Log& log);

/// Renders pictures of a scene with one device, bringing it from pose to pose. A picture is a function of scene,
/// settings and frame number, whatever was rendered before (preview mode `temporal` apart). Settings that are left to a
/// pilot (`estimator auto`) have to be settled by find_estimator() before the first picture.
///
/// Edits and camera changes of the scene apply from the next picture on. Renderers may share scenes and contexts, all
/// in one thread at a time. Makes its context current on the calling thread.
class FrameRenderer {
  public:
    /// The scene must outlive the renderer. Throws Error if there is no such device, and for settings that
    /// cannot be combined (engine/settings/constraints.h); the first picture checks the rest.
    FrameRenderer(LoadedScene& scene, RenderSettings settings, RendererOptions options = {});
    FrameRenderer(FrameRenderer&&) noexcept;
    FrameRenderer& operator=(FrameRenderer&&) noexcept;
    ~FrameRenderer();

    /// Settles what RenderSettings::estimator leaves open, by small pictures of the scene at 0 s (renderer/pilot.h).
    /// Returns the estimator, or none if `progress` has cancelled. Calls `progress` with the share of the work that
    /// is done, [0,1]; false cancels. Does nothing if nothing is left open. Throws Error as render() does.
    std::optional<Estimator> find_estimator(const std::function<bool(double share)>& progress = {});

    /// Settles an automatic exposure of RenderSettings::view, by a small picture of the scene at 0 s
    /// (renderer/metering.h). Returns the exposure in stops, or none if `progress` has cancelled. Does nothing if
    /// no view is wanted, now or from a kept noisy frame, or its exposure is fixed. render() calls it for the first
    /// picture. Throws Error as render() does.
    std::optional<float> find_exposure(const std::function<bool(double share)>& progress = {});

    /// Renders a frame at its own time; with motion blur at times up to open / 2 frames before and after.
    /// `progress` is called after each sample; false stops and sets RenderStats::interrupted. An Interruptible
    /// (engine/core/interruption.h) ends a sample earlier, with its own exception, and keeps the prepared scene. Throws
    /// Error if the picture cannot be made, or an estimator is left open; exceptions of `progress` are passed on.
    /// Other pictures can be made afterwards.
    RenderResult render(FrameNumber frame, const ProgressCallback& progress = {});
    /// Renders the frame of the settings.
    RenderResult render(const ProgressCallback& progress = {}) { return render(settings().frame, progress); }

    /// Returns the settings of the frame rendered last, with its number, its camera and its number of bounces.
    const RenderSettings& settings() const;
    /// Changes samples, seed, error target, time limit or filter of later pictures.
    void set_frame_settings(const FrameSettings& settings);
    LoadedScene& scene() const;
    const Shutter& shutter() const;
    const ColorConfig& colors() const;
    gpu::Context& context() const;

    /// Returns the checkpoint of the frame of the settings; null: none. Remove it when the picture is written.
    Checkpoint* checkpoint() const;
    /// Removes the checkpoint of a frame of RendererOptions::frame_checkpoints, after its files were written.
    void remove_checkpoint(FrameNumber frame);
    /// Returns why samples of the last frame were not saved in its checkpoint; empty: they were, or there is none.
    const std::string& checkpoint_problem() const;

    /// Returns the seconds that posing the scene took for the last frame.
    double load_seconds() const;
    /// Returns the counts of the last frame; none for scenes that nothing deforms.
    const std::optional<DeformCounts>& deformed() const;
    /// Returns the compiled graph of the last picture in Graphviz' dot language. Precondition: a picture was rendered.
    std::string graph_dot() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight
