#include "api/halflight/frame_renderer.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <map>
#include <span>
#include <utility>

#include "api/picture/scene_renderer.h"
#include "api/sequence/fingerprint.h"
#include "api/sequence/near_frames.h"
#include "api/sequence/noisy_files.h"
#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/key_text.h"
#include "engine/core/stopwatch.h"
#include "engine/core/suggestion.h"
#include "engine/gpu/program_binaries.h"
#include "engine/io/exr.h"
#include "engine/scene/material_lobes.h"
#include "engine/settings/constraints.h"
#include "renderer/film.h"
#include "renderer/held_out.h"
#include "renderer/noisy_frame.h"

namespace halflight {

namespace {

/// Returns how long a pose of a scene takes, in times of a sample of a pixel (docs/sequences.md). A triangle that
/// deforms takes about a third of that time. Any other takes a sixth, since the tables of the pose contain it as well.
double cost_of_pose(const Scene& scene) {
    double triangles = 0;
    for (const Mesh& mesh : scene.meshes) triangles += double(mesh.triangles.size()) * (mesh.deforms ? 1 : 0.5);
    return triangles / 3;
}

/// Returns a callback after which the context of the work is current again.
template <class Progress>
std::function<bool(Progress)> keeping_context(const std::function<bool(Progress)>& progress) {
    if (!progress) return nullptr;
    return [&progress](Progress p) {
        const gpu::KeepCurrent keep;
        return progress(p);
    };
}

}  // namespace

int shutter_times(const Shutter& shutter, const LoadedScene& scene, const RenderSettings& settings, int samples) {
    if (shutter.open == 0) return 1;
    if (shutter.times) return *shutter.times < samples ? *shutter.times : 0;
    // Samples of listed blocks are rendered together if they share a time.
    constexpr int kTimesOfBlocks = 32;
    if (settings.time_limit > 0)  // any number of samples may be taken
        return settings.adaptive && kTimesOfBlocks < samples ? kTimesOfBlocks : 0;
    constexpr int kLeastTimes = 8, kKnownSamples = 256;  // an error target may end the picture early
    constexpr double kMost = 0.25;                       // time of all poses over that of all samples
    const double pixels = double(settings.width) * double(settings.height);
    const double share = scene.surfaces_move() ? kMost * pixels / std::max(cost_of_pose(scene.scene()), 1.0) : 1;
    const double most = settings.error ? std::min(samples, kKnownSamples) : samples;
    int times = share >= 1 ? samples : std::max(static_cast<int>(most * share), kLeastTimes);
    if (settings.adaptive) times = std::min(times, kTimesOfBlocks);
    return times < samples ? times : 0;
}

int default_bounces(const Scene& scene) {
    return std::ranges::any_of(scene.materials, is_solid) ? kBouncesOfSolids : kBounces;
}

void request_light_groups(RenderSettings& settings, const Scene& scene) {
    for (const std::string& layer : light_group_layers(settings)) std::erase(settings.aovs, layer);
    for (const std::string& group : scene.light_groups) settings.aovs.push_back(std::string(kLightGroupLayer) + group);
}

std::string shutter_text(const Shutter& shutter, const LoadedScene& scene, const RenderSettings& settings) {
    if (shutter.open == 0) return "";
    const int times = shutter_times(shutter, scene, settings, settings.samples);
    std::string text = fmt::format("open for {:g} of a frame, {}", shutter.open,
                                   times > 0 ? fmt::format("{} times", times) : "a time for each sample");
    if (shutter.position != ShutterPosition::centre)
        text += fmt::format(", the frame's time at its {}", name(shutter.position));
    if (shutter.ramp > 0) text += fmt::format(", opening and closing for {:g} of that", shutter.ramp);
    return text;
}

const char* name(ShutterPosition position) {
    return position == ShutterPosition::start ? "start" : position == ShutterPosition::centre ? "centre" : "end";
}

ShutterPosition parse_shutter_position(const std::string& subject, const std::string& text) {
    for (const ShutterPosition position : kShutterPositions)
        if (text == name(position)) return position;
    throw Error(subject, "expects start, centre or end, not '{}'", text);
}

namespace {

/// Returns what emits light, or is unlit, and would be seen without an exposure, but is black in a picture of that
/// exposure.
std::vector<std::string> black_lights(const LoadedScene& loaded, float stops) {
    constexpr float kBlack = 1.0f / 1024;  // radiance after exposure, 3 of 255 in sRGB
    const auto is_black = [&](const vec3& radiance) {
        const float most = std::max({radiance.r, radiance.g, radiance.b});
        return most >= kBlack && most * std::exp2(stops) < kBlack;
    };
    std::vector<std::string> black;
    const Scene& scene = loaded.scene();
    const Environment& environment = scene.environment;
    const std::vector<float>& map = environment.map.pixels;
    if (is_black(environment.color * (map.empty() ? 1 : *std::ranges::max_element(map))))
        black.push_back(fmt::format("the environment {}", environment.name));
    const std::vector<bool> used = loaded.used_materials();
    for (std::size_t i = 0; i < used.size(); ++i) {
        const Material& m = scene.materials[i];
        if (used[i] && is_black(m.unlit ? vec3(m.base_color) : m.emission))
            black.push_back(m.name.empty() ? fmt::format("material {}", i) : fmt::format("material '{}'", m.name));
    }
    return black;
}

}  // namespace

gpu::ContextOptions default_device(std::string device) {
    return {.device = std::move(device), .binaries_folder = gpu::default_binaries_folder()};
}

void note_exposure(const ViewTransform& requested, const RenderSettings& used, const LoadedScene& scene,
                   const Log& log) {
    const auto has_size = [](const PunctualLight& light) { return light.radius > 0 || light.angle > 0; };
    const bool sized = std::ranges::any_of(scene.scene().lights, has_size);
    if (used.show_lamps && !sized) log.note("no lamp has a size, so none is seen (--lamp-radius gives sizes)");
    if (!used.want_view) return;
    const float stops = used.view.stops();
    if (used.view.camera.exposes())
        log.note("exposure {:.2f} stops by the physical camera (--iso, --shutter-speed, --fstop, --exposure)", stops);
    else if (requested.metered() && !used.view.metered() && stops != 0)
        log.note("exposure {0:.2f} stops by metering (--exposure {0:.2f} fixes it, --exposure 0 leaves it out)", stops);
    if (used.transparent && used.show_lamps && sized)
        log.warn(
            "pictures whose colours are divided by alpha lose lamps that have no surface behind; an .exr has them");
    const std::vector<std::string> black = black_lights(scene, stops);
    if (black.empty()) return;
    constexpr std::size_t kNamed = 3;
    const std::size_t named = std::min(black.size(), kNamed);
    log.warn("black at this exposure, {:.2f} stops, because their light is in other units: {}{}", stops,
             fmt::join(black.begin(), black.begin() + std::ptrdiff_t(named), ", "),
             black.size() > named ? fmt::format(" and {} more", black.size() - named) : "");
}

struct FrameRenderer::State {
    LoadedScene& scene;
    RenderSettings settings;
    const std::optional<int> asked_bounces;  // settings as they were asked for, which may leave them to the scene
    const Lens asked_lens;
    Shutter shutter;
    SceneRenderer pictures;
    std::optional<DeformCounts> deformed;
    std::optional<FrameNumber> last_frame;    // number of the frame rendered last
    NearFrames near_frames;                   // noisy frames near the one rendered last
    std::shared_ptr<NoisyFiles> noisy_files;  // null: there are none
    std::optional<Checkpoint> checkpoint;
    const std::optional<FrameCheckpoints> frame_checkpoints;
    std::map<FrameNumber, Checkpoint> checkpoints;  // checkpoints of frames, by frame number
    std::string problem;                            // FrameRenderer::checkpoint_problem()
    int only_part = 0;                              // CheckpointOptions::part
    const Occasion occasion;
    std::list<Checkpoint> merged;
    std::vector<const Checkpoint*> merged_in_order;
    FrameNumber checkpoint_frame = 0;
    double load_seconds = 0;
    std::uint64_t choice = 0;         // LoadedScene::choice_revision() of take_open_settings()
    std::optional<SceneEdits> edits;  // edits at which the number of bounces was taken; empty: none yet

    State(LoadedScene& s, RenderSettings r, RendererOptions o)
        : scene(s),
          settings(std::move(r)),
          asked_bounces(settings.bounces),
          asked_lens(settings.view.camera.lens),
          shutter(o.shutter),
          pictures(scene, settings, o, [this] { near_frames.clear(); }),
          noisy_files(o.noisy_files),
          frame_checkpoints(o.frame_checkpoints),
          occasion{.shutter = shutter.open > 0,
                   .checkpoint = o.checkpoint || o.frame_checkpoints,
                   .own_checkpoint = o.checkpoint.has_value(),
                   .finished = true} {
        if (settings.texture_lod != scene.choice().mip_levels)
            throw Error("render settings", settings.texture_lod
                                               ? "texture-lod needs a scene that was loaded with mip levels"
                                               : "the scene was loaded with mip levels, which need texture-lod");
        (void)capture_date_now();  // throws for a damaged SOURCE_DATE_EPOCH
        take_open_settings();
        for (const std::string& layer : light_group_layers(settings)) check_light_group(layer);
        request_light_groups(settings, scene.scene());
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    /// Throws Error unless the scene has the light group of a layer.
    void check_light_group(const std::string& layer) const {
        const std::vector<std::string>& groups = scene.scene().light_groups;
        const std::string name = layer.substr(kLightGroupLayer.size());
        if (std::ranges::find(groups, name) == groups.end())
            throw Error("render settings", "aov: there is no light group '{}' (--light-group){}", name,
                        did_you_mean(name, groups));
    }
    /// Begins a picture by SceneRenderer::begin(), and applies light groups, glass and cameras that edits have changed.
    void begin() {
        scene.frame_for(picture_aspect());
        pictures.begin();
        if (choice == scene.choice_revision()) return;
        const RenderSettings before = settings;
        request_light_groups(settings, scene.scene());
        take_open_settings();
        const bool same_lens = settings.view.camera.lens == before.view.camera.lens;
        if (settings.aovs != before.aovs || settings.bounces != before.bounces || !same_lens) pictures.drop();
    }
    /// Takes the settings that follow from the scene at 0 s and from its camera.
    void take_open_settings() {
        choice = scene.choice_revision();
        settings.view.camera.lens = asked_lens;
        if (!asked_bounces && edits != scene.edits()) {
            scene.pose(0);  // so that it does not depend on the frames before
            settings.bounces = default_bounces(scene.scene());
            edits = scene.edits();
        }
        take_lens();
    }
    double picture_aspect() const { return eye_aspect(settings.optics, {settings.width, settings.height}); }
    /// Copies the lens of the scene's camera to the settings if these leave the focus open. An f-number then sets the
    /// blur, not the exposure.
    void take_lens() {
        Lens& lens = settings.view.camera.lens;
        const ChosenCamera& chosen = scene.chosen_camera();
        const Lens keyed = halflight::merged(lens, chosen.keyed_lens);
        if (lens.focus.kind == Focus::Kind::open && (chosen.camera.lens.blurs() || keyed.focus.chosen()))
            lens = with_lens(chosen.camera, keyed).lens;
    }
    /// Returns the camera at a frame, whole or not.
    Camera camera_at(double frame) const { return equipped(scene.camera(scene.time_of(frame)), settings); }
    /// Renders a frame and those near it that are not held yet, and denoises it with them.
    RenderResult denoised(FrameNumber frame, const ProgressCallback& progress) {
        const auto render_noisy = [&](FrameNumber n, NoisyFrame& noisy, const ProgressCallback& of_all) {
            set_frame(n);
            return from_checkpoint(n, {.noisy = &noisy}, n == frame, of_all);
        };
        const auto denoise = [&](NoisyFrame& noisy, std::span<const NearFrame> others, RenderResult& result) {
            set_frame(frame);
            pictures.denoise(noisy, others, result);
        };
        NearFrames::Steps steps{render_noisy, {}, [&](FrameNumber n) { return camera_at(n); }, noisy_files.get()};
        if (settings.denoise) steps.denoise = denoise;
        const auto render = [&] {
            return near_frames.render(scene, frame, neighbour_frames(settings), steps, progress);
        };
        try {
            RenderResult result = render();
            set_frame(frame);                     // a stop may come while a neighbour is rendered
            const Image& beauty = result.beauty;  // that of a file has no view
            if (settings.want_view && result.view.pixels.empty() && !beauty.pixels.empty())
                result.view =
                    pictures.colors().view(settings.view).apply(settings.transparent ? straight(beauty) : beauty);
            load_seconds += near_frames.load_seconds();
            return result;
        } catch (...) {
            set_frame(frame);
            throw;
        }
    }
    /// Adds the error of the frame's denoised picture to its statistics.
    void estimate_error(FrameNumber frame, RenderResult& result, const ProgressCallback& progress) {
        set_frame(frame);
        const auto render = [&](const FrameSettings& held_out, const ProgressCallback& of_all) {
            FrameSettings whole = held_out;
            whole.parts = 1;
            return pictures.picture(scene.time_of(frame), whole, {}, of_all);
        };
        estimate_denoised_error(settings, result, render, progress);
    }
    /// Throws Error for settings of a frame that cannot be combined with each other or with the shutter.
    void check(const FrameSettings& s) const {
        RenderSettings all = settings;
        static_cast<FrameSettings&>(all) = s;
        check_constraints(all, occasion);
        if (!(shutter.open >= 0 && shutter.open <= kMostShutter))
            throw Error("shutter", "expects a number from 0 to {:g}, not {:g}", kMostShutter, shutter.open);
        if (!(shutter.ramp >= 0 && shutter.ramp <= 1))
            throw Error("shutter ramp", "expects a number from 0 to 1, not {:g}", shutter.ramp);
        if (shutter.open == 0) return;
        if (shutter.times && (*shutter.times < 1 || *shutter.times > s.samples))
            throw Error("shutter times", "expects a number from 1 to {}, the number of samples, not {}", s.samples,
                        *shutter.times);
    }
    /// Returns the text that tells the checkpoint of a part, or of all samples, from those of other pictures.
    std::string checkpoint_fingerprint(FrameNumber number, int of_part) const {
        const std::string own = EditPrints(scene, settings, shutter).text(number, 0);
        KeyText keys(frame_fingerprint(sums_fingerprint(scene, settings, shutter), number, own));
        if (of_part > 0) keys.add("part", std::to_string(of_part));
        return keys.text();
    }
    /// Returns the checkpoint of a frame of the sequence, open; null if there is none. own: the frame is rendered
    /// for itself, and not as a neighbour.
    Checkpoint* checkpoint_of(FrameNumber frame, bool own) {
        const auto folder = frame_checkpoints ? frame_checkpoints->folder(frame) : std::nullopt;
        if (!folder) return nullptr;
        const auto use = own && frame_checkpoints->fresh ? Checkpoint::Use::anew : Checkpoint::Use::go_on;
        try {
            return &checkpoints
                        .try_emplace(frame, *folder, checkpoint_fingerprint(frame, 0), frame_checkpoints->interval, use,
                                     own ? 5 : 0)
                        .first->second;
        } catch (const CheckpointBusy& busy) {
            if (own) problem = busy.what();
        } catch (const Error&) {
            if (own) throw;  // the checkpoint of a neighbour is used only if it fits
        }
        return nullptr;
    }
    /// Renders a frame of the sequence at its own time, from its checkpoint if it has one.
    RenderResult saved(FrameNumber frame, PictureInputs inputs, bool own, const ProgressCallback& progress) {
        inputs.checkpoint = checkpoint_of(frame, own);
        RenderResult result = pictures.still(frame, settings, inputs, progress);
        if (own && inputs.checkpoint) problem = inputs.checkpoint->problem();
        if (!own) checkpoints.erase(frame);  // another process may make the frame
        return result;
    }
    void open_checkpoint(const CheckpointOptions& options) {
        if (options.part < 0 || options.part > settings.parts)
            throw Error("checkpoint", "there is no part {} of {}", options.part, settings.parts);
        only_part = options.part;
        checkpoint.emplace(options.folder, checkpoint_fingerprint(settings.frame, only_part), options.interval,
                           options.fresh ? Checkpoint::Use::anew : Checkpoint::Use::go_on);
        checkpoint_frame = settings.frame;
    }
    void open_merged(const std::vector<std::filesystem::path>& folders) {
        if (folders.size() != static_cast<std::size_t>(settings.parts))
            throw Error("merge", "has {} folders of {} parts", folders.size(), settings.parts);
        for (const auto& folder : folders) {
            const int number = static_cast<int>(merged.size()) + 1;
            if (!std::filesystem::exists(folder))
                throw Error(folder.string(), "is missing: part {} of {} was not rendered", number, settings.parts);
            merged.emplace_back(folder, checkpoint_fingerprint(settings.frame, number), 1e9, Checkpoint::Use::merge);
            merged_in_order.push_back(&merged.back());
        }
        checkpoint_frame = settings.frame;
    }
    /// Renders a frame, from its checkpoint if it has one. own: as for saved().
    RenderResult from_checkpoint(FrameNumber frame, PictureInputs inputs, bool own_frame,
                                 const ProgressCallback& progress) {
        if (frame_checkpoints) return saved(frame, inputs, own_frame, progress);
        FrameSettings own = settings;
        if (frame == checkpoint_frame) {
            if (checkpoint) inputs.checkpoint = &*checkpoint;
            inputs.merged = merged_in_order;
            if (only_part > 0) own = settings_of_part(own, only_part, settings.adaptive);
            if (only_part > 0) own.stays_noisy = true;
        }
        return pictures.still(frame, own, std::move(inputs), progress);
    }
    /// Sets the properties that differ between frames: number, camera and, for the layer "motion", the camera of the
    /// frame before.
    void set_frame(FrameNumber frame) {
        scene.frame_for(picture_aspect());
        settings.frame = frame;
        settings.camera = camera_at(frame);
        if (std::ranges::find(settings.aovs, "motion") != settings.aovs.end())
            settings.previous_camera = camera_at(static_cast<double>(frame) - 1);
    }
};

FrameRenderer::FrameRenderer(LoadedScene& scene, RenderSettings settings, RendererOptions options)
    : state_(std::make_unique<State>(scene, std::move(settings), options)) {
    state_->check(state_->settings);
    state_->set_frame(state_->settings.frame);
    if (!options.merged.empty()) state_->open_merged(options.merged);
    if (options.checkpoint) state_->open_checkpoint(*options.checkpoint);
}

FrameRenderer::FrameRenderer(FrameRenderer&&) noexcept = default;
FrameRenderer& FrameRenderer::operator=(FrameRenderer&& other) noexcept {
    std::swap(state_, other.state_);
    return *this;
}
FrameRenderer::~FrameRenderer() {
    if (!state_) return;
    const gpu::KeepCurrent keep;  // another renderer's callback may delete this one
    try {
        state_->pictures.context().make_current();
        state_.reset();
    } catch (const Error&) {
        // The context is current on another thread. OpenGL names of its objects must not be deleted in the context of
        // this thread, so the renderer is leaked instead.
        (void)state_.release();
    }
}

std::optional<Estimator> FrameRenderer::find_estimator(const std::function<bool(double)>& asked) {
    const auto progress = keeping_context(asked);
    State& s = *state_;
    if (!leaves_open(s.settings.estimator)) return s.settings.estimator;
    if (s.pictures.found()) return s.pictures.found();
    s.begin();
    return s.pictures.find_estimator(progress);
}

std::optional<float> FrameRenderer::find_exposure(const std::function<bool(double)>& asked) {
    const auto progress = keeping_context(asked);
    State& s = *state_;
    const bool wanted = s.settings.want_view || (s.settings.keep_noisy && s.noisy_files);
    if (!wanted || !s.settings.view.metered()) return s.settings.view.stops();
    s.begin();
    const std::optional<float> stops = s.pictures.find_exposure(progress);
    if (stops) s.settings.view.exposure = *stops;
    return stops;
}

RenderResult FrameRenderer::render(FrameNumber frame, const ProgressCallback& asked) {
    const ProgressCallback progress = keeping_context(asked);
    State& s = *state_;
    find_exposure();
    s.begin();
    s.load_seconds = 0;
    s.problem.clear();
    GpuDeformer* const deformer = s.pictures.deformer();
    (void)s.pictures.take_load_seconds();       // discards the time of other calls,
    if (deformer) deformer->take_statistics();  // and the counts of a frame that has failed
    s.set_frame(frame);
    // The history is valid only if the last picture showed the frame before this one.
    if (s.scene.surfaces_move() && s.last_frame != frame - 1) s.pictures.history().forget();
    s.last_frame.reset();  // set again when this frame is complete
    RenderResult result = neighbour_frames(s.settings) > 0 || (s.settings.keep_noisy && s.only_part == 0)
                              ? s.denoised(frame, progress)
                              : s.from_checkpoint(frame, {}, true, progress);
    if (s.settings.denoise_error > 0 && s.only_part == 0) s.estimate_error(frame, result, progress);
    s.last_frame = frame;
    s.load_seconds += s.pictures.take_load_seconds();
    if (deformer) {
        const DeformStatistics d = deformer->take_statistics();
        s.deformed = DeformCounts{d.vertices, d.vertices_on_cpu, d.seconds};
        result.stats.gpu_bytes += deformer->bytes();
    }
    return result;
}

const RenderSettings& FrameRenderer::settings() const {
    return state_->settings;
}

void FrameRenderer::set_frame_settings(const FrameSettings& settings) {
    state_->check(settings);
    const FrameNumber frame = state_->settings.frame;
    static_cast<FrameSettings&>(state_->settings) = settings;
    const gpu::KeepCurrent keep;
    state_->pictures.context().make_current();  // this context has the textures of the frames
    state_->near_frames.clear();
    state_->set_frame(frame);
}

LoadedScene& FrameRenderer::scene() const {
    return state_->scene;
}

const Shutter& FrameRenderer::shutter() const {
    return state_->shutter;
}

const ColorConfig& FrameRenderer::colors() const {
    return state_->pictures.colors();
}

gpu::Context& FrameRenderer::context() const {
    return state_->pictures.context();
}

Checkpoint* FrameRenderer::checkpoint() const {
    return state_->checkpoint ? &*state_->checkpoint : nullptr;
}

void FrameRenderer::remove_checkpoint(FrameNumber frame) {
    const auto& checkpoints = state_->frame_checkpoints;
    state_->checkpoints.erase(frame);
    if (const auto folder = checkpoints ? checkpoints->folder(frame) : std::nullopt) Checkpoint::discard(*folder);
}

const std::string& FrameRenderer::checkpoint_problem() const {
    return state_->problem;
}

double FrameRenderer::load_seconds() const {
    return state_->load_seconds;
}

const std::optional<DeformCounts>& FrameRenderer::deformed() const {
    return state_->deformed;
}

std::string FrameRenderer::graph_dot() const {
    if (!state_->pictures.has_picture()) throw Error("frame graph", "there is none before the first picture");
    return state_->pictures.graph_dot();
}

}  // namespace halflight
