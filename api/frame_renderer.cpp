#include "api/halflight/frame_renderer.h"

#include <algorithm>
#include <list>
#include <span>
#include <utility>

#include "api/fingerprint.h"
#include "api/near_frames.h"
#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/core/suggestion.h"
#include "engine/device/deform.h"
#include "engine/device/prepared_scene.h"
#include "engine/gpu/program_binaries.h"
#include "engine/rays/batch_server.h"
#include "engine/scene/material_lobes.h"
#include "engine/scene/motion.h"
#include "passes/light/radiance_cache.h"
#include "renderer/film.h"
#include "renderer/held_out.h"
#include "renderer/memory.h"
#include "renderer/metering.h"
#include "renderer/noisy_frame.h"
#include "renderer/pilot.h"
#include "renderer/preview_picture.h"
#include "renderer/render.h"
#include "renderer/shutter.h"

namespace halflight {

namespace {

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

int shutter_count(const Shutter& shutter, const std::vector<std::string>& aovs, int samples) {
    constexpr int kDefaultTimes = 8;
    if (shutter.open == 0) return 1;
    const bool variance = std::ranges::find(aovs, "variance") != aovs.end();
    return shutter.times.value_or(std::clamp(variance ? samples / 2 : samples, 1, kDefaultTimes));
}

int default_bounces(const Scene& scene) {
    return std::ranges::any_of(scene.materials, is_solid) ? kBouncesOfSolids : kBounces;
}

void request_light_groups(RenderSettings& settings, const Scene& scene) {
    for (const std::string& layer : light_group_layers(settings)) std::erase(settings.aovs, layer);
    for (const std::string& group : scene.light_groups) settings.aovs.push_back(std::string(kLightGroupLayer) + group);
}

std::string shutter_text(const Shutter& shutter, const RenderSettings& settings) {
    if (shutter.open == 0) return "";
    return fmt::format("open for {:g} of a frame, {} times", shutter.open,
                       shutter_count(shutter, settings.aovs, settings.samples));
}

gpu::ContextOptions default_device(std::string device) {
    return {.device = std::move(device), .binaries_folder = gpu::default_binaries_folder()};
}

void note_exposure(const ViewTransform& requested, const RenderSettings& used, const Log& log) {
    const float stops = used.view.stops();
    if (used.want_view && used.view.camera.exposes())
        log.note("exposure {:.2f} stops by the physical camera (--iso, --shutter-speed, --fstop, --exposure)", stops);
    else if (requested.metered() && !used.view.metered() && stops != 0)
        log.note("exposure {0:.2f} stops by metering (--exposure {0:.2f} fixes it, --exposure 0 leaves it out)", stops);
}

namespace {

/// Returns whether textures are loaded in tiles.
bool in_tiles(const Scene& scene) {
    return std::ranges::any_of(scene.images, [](const TextureImage& image) { return image.tiles != nullptr; });
}

}  // namespace

struct FrameRenderer::State {
    LoadedScene& scene;
    RenderSettings settings;
    Shutter shutter;
    int exr_tile;  // RendererOptions::exr_tile
    RayServerFactory ray_server;
    bool frees_scene;
    ColorConfig colors;
    std::shared_ptr<gpu::Context> context;
    std::optional<GpuDeformer> deformer;  // deformer on the device; none where no mesh deforms
    std::optional<DeformCounts> deformed;
    // The uploaded scene and the objects that render it; without them the next picture makes new ones.
    std::unique_ptr<PreparedScene> prepared;
    std::shared_ptr<rays::BatchServer> server;
    std::shared_ptr<RadianceCache> cache;  // radiance cache; null without RenderSettings::preview.cache
    std::optional<Renderer> renderer;
    MemoryLedger::Entry tables_memory, pages_memory, pool_memory, textures_memory, picture_memory, bands_memory,
        visibility_memory;
    std::size_t pool_size = 0;                // memory for pages, bytes; 0: not chosen yet
    std::uint64_t uploaded = 0;               // LoadedScene::revision() of the uploaded scene
    std::uint64_t transforms = 0;             // LoadedScene::transform_revision() of the uploaded scene
    std::optional<Estimator> found;           // result of the pilot
    PictureHistory history;                   // light and geometry of the last frame, for RenderSettings::preview
    std::optional<std::uint32_t> last_frame;  // number of the frame rendered last
    NearFrames near_frames;                   // noisy frames near the one rendered last
    std::optional<Checkpoint> checkpoint;
    int only_part = 0;  // CheckpointOptions::part
    std::list<Checkpoint> merged;
    std::vector<const Checkpoint*> merged_in_order;
    std::uint32_t checkpoint_frame = 0;
    double load_seconds = 0;
    double reference_seconds = 0;  // time to prepare the reference pose, counted with the next picture
    bool at_reference = false;     // `prepared` holds the reference pose

    State(LoadedScene& s, RenderSettings r, RendererOptions o)
        : scene(s),
          settings(std::move(r)),
          shutter(o.shutter),
          exr_tile(o.exr_tile),
          ray_server(std::move(o.ray_server)),
          frees_scene(o.frees_scene && !s.surfaces_move()),
          colors(o.colors ? std::move(*o.colors) : ColorConfig::load()),
          context(o.context ? std::move(o.context) : std::make_shared<gpu::Context>(gpu::Context::create(o.device))) {
        if (settings.texture_lod != scene.choice().mip_levels)
            throw Error("render settings", settings.texture_lod
                                               ? "texture-lod needs a scene that was loaded with mip levels"
                                               : "the scene was loaded with mip levels, which need texture-lod");
        context->make_current();
        if (!settings.bounces) settings.bounces = default_bounces(scene.scene());
        take_lens();
        for (const std::string& layer : light_group_layers(settings)) check_light_group(layer);
        request_light_groups(settings, scene.scene());
        if (settings.preview.cache) cache = std::make_shared<RadianceCache>();
        if (scene.surfaces_move() && std::ranges::any_of(scene.scene().meshes, &Mesh::deforms))
            deformer.emplace(*context);
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() {
        if (deformer && scene.deformer() == &*deformer) scene.deform_by(nullptr);
    }

    /// Throws Error unless the scene has the light group of a layer.
    void check_light_group(const std::string& layer) const {
        const std::vector<std::string>& groups = scene.scene().light_groups;
        const std::string name = layer.substr(kLightGroupLayer.size());
        if (std::ranges::find(groups, name) == groups.end())
            throw Error("render settings", "aov: there is no light group '{}' (--light-group){}", name,
                        did_you_mean(name, groups));
    }
    /// Makes this renderer's context and deformer current; others may have used the scene or the thread.
    void begin() {
        context->make_current();
        if (scene.surfaces_move()) scene.deform_by(deformer ? &*deformer : nullptr);
        const std::vector<std::string> layers = settings.aovs;
        request_light_groups(settings, scene.scene());  // edits may have changed them
        if (transforms != scene.transform_revision() || settings.aovs != layers) drop();
        transforms = scene.transform_revision();
    }
    void drop() {
        renderer.reset();
        server.reset();
        prepared.reset();
        history.forget();
        near_frames.clear();
    }
    /// Calls f(); where that throws, the next picture prepares the scene anew.
    template <class F>
    auto guarded(F f) {
        try {
            return f();
        } catch (...) {
            drop();  // an exception leaves the state undefined
            throw;
        }
    }
    /// Takes the lens of the scene's camera where the settings leave the focus open. An f-number then sets the blur,
    /// not the exposure.
    void take_lens() {
        Lens& lens = settings.view.camera.lens;
        const Camera& camera = scene.chosen_camera().camera;
        if (lens.focus.kind == Focus::Kind::open && camera.lens.blurs()) lens = with_lens(camera, lens).lens;
    }
    /// Returns a camera with lens and optics of the settings.
    Camera equipped(const ChosenCamera& chosen) const {
        return with_optics(with_lens(chosen.camera, settings.view.camera.lens), settings.optics);
    }
    /// Returns the camera at a frame, whole or not.
    Camera camera_at(double frame) const { return equipped(scene.camera(scene.frame_rate().seconds(frame))); }
    RenderSettings renderer_settings(const FrameSettings& frame) const {
        RenderSettings s = settings;
        static_cast<FrameSettings&>(s) = frame;
        s.camera = equipped(scene.chosen_camera());  // camera of the pilot's pictures
        s.previous_surfaces = nullptr;               // the pointer is valid for one picture
        s.history = nullptr;
        s.checkpoint = nullptr;
        s.radiance_cache = cache;
        s.want_view = s.want_view && shutter.open == 0;  // with motion blur, the view is made from the mean
        return s;
    }
    /// Prepares the scene at 0 s, the reference pose on which hierarchies of all poses depend.
    void prepare() {
        if (prepared) return;
        Stopwatch clock;
        scene.check_surfaces();
        scene.pose(0);
        load_seconds += clock.lap();
        PrepareOptions options{row_of(settings.culling).needs_cull_tree, settings.kept, settings.estimator};
        if (frees_scene) {
            options.single_pose = true;
            options.scene_read = [this] { scene.free_surfaces(); };
        }
        MemoryLedger& ledger = MemoryLedger::process();
        tables_memory = {ledger, MemoryPart::tables, scene_bytes(scene.size()) - scene.size().contents()};
        if (scene.pages()) {
            options.pages = scene.pages();
            const paging::PageIndex& index = scene.pages()->index();
            const std::size_t reading = paging::PagePool::reading_bytes(index);
            const std::size_t lamps = index.geometry.emitters.size() * paging::kEmitterBytes;
            const std::size_t fixed = paging::PagePool::fixed_bytes(index);
            ledger.check(reading + lamps + fixed, scene.choice().scene.string() + ": pages",
                         fmt::format("pages that are read {}, emissive triangles {}, their hierarchy {}",
                                     text_of_bytes(reading), text_of_bytes(lamps), text_of_bytes(fixed)));
            pages_memory = {ledger, MemoryPart::pages, reading + lamps + fixed};
            options.pool_bytes = [&](const SceneNeeds& needs) {
                if (pool_size > 0) return pool_size;  // pools of later poses
                // Pages take what the picture leaves. Bands become smaller where it would take more than half.
                const std::size_t free = ledger.free();
                RenderSettings s = settings;
                std::size_t picture = fit_into_memory(needs, scene.size(), s, picture_use(), free / 2).picture();
                if (scene.size().moves) picture += picture / 4;  // lights and lobes of other poses
                const std::size_t most = std::max(free / 2, free - std::min(free, picture));
                pool_size = settings.pool_bytes > 0 ? settings.pool_bytes : most;
                if (!scene.size().moves)
                    pool_size = std::min(
                        pool_size, std::max<std::size_t>(index.pages.size(), 1) * paging::PagePool::slot_bytes(index));
                if (settings.pool_bytes > 0) ledger.check(pool_size, "page pool", "--page-pool");
                pool_memory = {ledger, MemoryPart::pages, pool_size};
                return pool_size;
            };
        }
        if (in_tiles(scene.scene())) {
            const std::size_t batch = paging::TilePool::bytes_of_batch(
                std::min(settings.band_pixels, std::size_t(settings.width) * std::size_t(settings.height)));
            ledger.check(batch, "hits that wait for textures", text_of_bytes(batch));
            textures_memory = {ledger, MemoryPart::textures, batch};
            options.tile_bytes =
                settings.tile_bytes > 0 ? settings.tile_bytes : ledger.free() / (scene.pages() ? 4 : 2);
        }
        guarded([&] { prepared = std::make_unique<PreparedScene>(*context, scene.scene(), options); });
        if (found) prepared->settle(*found, 0);
        uploaded = scene.revision();
        at_reference = true;
        reference_seconds = clock.lap();
    }
    void make_renderer(const FrameSettings& frame) {
        if (ray_server && !server) server = ray_server(prepared->trace());
        RenderSettings s = renderer_settings(frame);
        take_memory(s);
        renderer.emplace(*prepared, colors, s, server.get());
    }
    PictureUse picture_use() const {
        return {.png = settings.want_view, .shutter = shutter.open > 0, .exr_tile = exr_tile};
    }
    /// Chooses bands that fit into the memory budget, and enters the picture into the ledger.
    void take_memory(RenderSettings& s) {
        for (MemoryLedger::Entry* entry : {&picture_memory, &bands_memory, &visibility_memory}) *entry = {};
        MemoryLedger& ledger = MemoryLedger::process();
        const MemoryEstimate m =
            fit_into_memory(prepared->buffers().needs(), scene.size(), s, picture_use(), ledger.free());
        const std::size_t whole = m.film + m.preview + m.shutter + m.writing;
        const std::string near = neighbour_frames(s) > 0
                                     ? fmt::format(" with {} frames before and after", neighbour_frames(s))
                                     : std::string();
        ledger.check(m.picture(), "render settings",
                     fmt::format("{} x {} pixels: picture{} {}, the smallest bands {}", s.width, s.height, near,
                                 text_of_bytes(whole), text_of_bytes(m.picture() - whole)));
        picture_memory = {ledger, MemoryPart::picture, whole};
        bands_memory = {ledger, MemoryPart::bands, m.band + m.reading};
        visibility_memory = {ledger, MemoryPart::visibility, m.visibility};
    }
    /// Poses the scene at a time, and updates the renderer.
    void pose(double seconds, const FrameSettings& frame) {
        Stopwatch clock;
        prepare();
        if (!renderer) {
            clock.lap();
            guarded([&] { make_renderer(frame); });
            reference_seconds += clock.lap();
        }
        scene.pose(seconds);
        if (scene.revision() == uploaded) {
            if (at_reference) reference_seconds = 0;  // RenderStats::prepare_seconds is that of the reference
            return;
        }
        scene.check_surfaces();
        load_seconds += clock.lap();
        at_reference = false;
        guarded([&] {
            if (prepared->update(scene.scene())) {
                renderer->follow_scene();
            } else {
                renderer.reset();
                server.reset();
                make_renderer(frame);
            }
        });
        uploaded = scene.revision();
    }
    RenderResult picture(double seconds, const FrameSettings& frame, const ProgressCallback& progress) {
        pose(seconds, frame);
        if (cache) cache->clear();  // makes frames independent of earlier ones
        const std::uint64_t before = interruptions();
        RenderResult result;
        try {
            result = renderer->render(frame, progress);
        } catch (...) {
            history.forget();                       // the picture may be in it
            if (interruptions() == before) drop();  // the state is undefined
            throw;
        }
        result.stats.prepare_seconds += std::exchange(reference_seconds, 0);
        return result;
    }
    /// Renders a frame at its own time, with the motion of surfaces where a layer needs it.
    RenderResult still(std::uint32_t frame, const FrameSettings& frame_settings, const ProgressCallback& progress) {
        const double seconds = scene.frame_rate().seconds(frame);
        const bool motion =
            settings.preview.temporal || std::ranges::find(settings.aovs, "motion") != settings.aovs.end();
        if (!scene.surfaces_move() || !motion) return picture(seconds, frame_settings, progress);
        Stopwatch clock;
        Scene before = scene.posed(scene.frame_rate().seconds(static_cast<double>(frame) - 1));
        load_seconds += clock.lap();
        pose(seconds, frame_settings);
        const PreviousSurfaces surfaces(scene.scene(), std::move(before));
        FrameSettings moving = frame_settings;
        moving.previous_surfaces = &surfaces;
        return picture(seconds, moving, progress);
    }
    /// Renders a frame and those near it that are not held yet, and denoises it with them.
    RenderResult denoised(std::uint32_t frame, const ProgressCallback& progress) {
        const auto render_noisy = [&](std::uint32_t n, NoisyFrame& noisy, const ProgressCallback& of_all) {
            set_frame(n);
            FrameSettings own = settings;
            own.noisy = &noisy;
            return still(n, own, of_all);
        };
        const auto denoise = [&](NoisyFrame& noisy, std::span<const NearFrame> others, RenderResult& result) {
            set_frame(frame);
            guarded([&] { renderer->denoise(noisy, others, result); });
        };
        const auto render = [&] {
            return near_frames.render(scene, frame, neighbour_frames(settings),
                                      {render_noisy, denoise, [&](std::uint32_t n) { return camera_at(n); }}, progress);
        };
        try {
            RenderResult result = render();
            set_frame(frame);  // a stop may come while a neighbour is rendered
            load_seconds += near_frames.load_seconds();
            return result;
        } catch (...) {
            set_frame(frame);
            throw;
        }
    }
    /// Adds the error of the frame's denoised picture to its statistics.
    void estimate_error(std::uint32_t frame, RenderResult& result, const ProgressCallback& progress) {
        set_frame(frame);
        const auto render = [&](const FrameSettings& held_out, const ProgressCallback& of_all) {
            FrameSettings whole = held_out;
            whole.parts = 1;
            return picture(scene.frame_rate().seconds(frame), whole, of_all);
        };
        estimate_denoised_error(settings, result, render, progress);
    }
    RenderResult blurred(std::uint32_t frame, const ProgressCallback& progress) {
        const FrameSettings own = settings;
        const Stopwatch clock;
        ShutterMean mean(settings.aovs, own.samples);
        const int times = shutter_count(shutter, settings.aovs, own.samples);
        for (const ShutterTime& time : shutter_times(own.samples, times, own.seed, frame)) {
            const double seconds = scene.frame_rate().seconds(frame + shutter.open * (time.at - 0.5));
            FrameSettings part = own;
            part.camera = equipped(scene.camera(seconds));
            part.first_sample = time.first_sample;
            part.samples = time.samples;
            part.of_samples = own.samples;
            const auto of_all = [&](RenderProgress p) {
                p.samples_done += time.first_sample;
                p.samples_total = own.samples;
                p.seconds = clock.seconds();
                return !progress || progress(p);
            };
            const bool was_prepared = renderer && !scene.surfaces_move();
            RenderResult result = picture(seconds, part, of_all);
            if (result.stats.interrupted) return result;
            if (was_prepared) result.stats.prepare_seconds = 0;  // the time counts for an earlier picture
            mean.add(result);
        }
        RenderResult own_time;
        if (mean.wants_still()) {
            FrameSettings one = own;
            one.samples = 1;
            own_time = still(frame, one, {});
        }
        RenderResult result = mean.take(std::move(own_time));
        if (settings.want_view)
            result.view =
                colors.view(settings.view).apply(settings.transparent ? straight(result.beauty) : result.beauty);
        return result;
    }
    void check_apart(const char* what) const {
        if (shutter.open > 0 || neighbour_frames(settings) > 0)
            throw Error(what, "cannot be combined with motion blur, or with neighbouring frames");
    }
    /// Returns the text that tells the checkpoint of a part, or of all samples, from those of other pictures.
    std::string checkpoint_fingerprint(int of_part) const {
        const std::string frame = frame_fingerprint(sums_fingerprint(scene, settings), settings.frame);
        return of_part > 0 ? fmt::format("{}, part {}", frame, of_part) : frame;
    }
    void open_checkpoint(const CheckpointOptions& options) {
        check_apart("checkpoint");
        if (options.part < 0 || options.part > settings.parts)
            throw Error("checkpoint", "there is no part {} of {}", options.part, settings.parts);
        only_part = options.part;
        checkpoint.emplace(options.folder, checkpoint_fingerprint(only_part), options.interval,
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
            merged.emplace_back(folder, checkpoint_fingerprint(number), 1e9, Checkpoint::Use::merge);
            merged_in_order.push_back(&merged.back());
        }
        checkpoint_frame = settings.frame;
    }
    /// Renders a frame without motion blur and neighbours, from its checkpoint if it has one.
    RenderResult from_checkpoint(std::uint32_t frame, const ProgressCallback& progress) {
        FrameSettings own = settings;
        if (frame == checkpoint_frame) {
            if (checkpoint) own.checkpoint = &*checkpoint;
            own.merged = merged_in_order;
            if (only_part > 0) own = settings_of_part(own, only_part);
            if (only_part > 0) own.stays_noisy = true;
        }
        return still(frame, own, progress);
    }
    /// Sets the properties that differ between frames: number, camera and, for the layer "motion", the camera of the
    /// frame before.
    void set_frame(std::uint32_t frame) {
        scene.frame_for(eye_aspect(settings.optics, {settings.width, settings.height}));
        settings.frame = frame;
        settings.camera = camera_at(frame);
        if (std::ranges::find(settings.aovs, "motion") != settings.aovs.end())
            settings.previous_camera = camera_at(static_cast<double>(frame) - 1);
    }
};

FrameRenderer::FrameRenderer(LoadedScene& scene, RenderSettings settings, RendererOptions options)
    : state_(std::make_unique<State>(scene, std::move(settings), options)) {
    const Shutter& shutter = state_->shutter;
    if (!(shutter.open >= 0 && shutter.open <= 1))
        throw Error("shutter", "expects a number from 0 to 1, not {:g}", shutter.open);
    if (shutter.open > 0 && shutter.times && (*shutter.times < 1 || *shutter.times > state_->settings.samples))
        throw Error("shutter times", "expects a number from 1 to {}, the number of samples, not {}",
                    state_->settings.samples, *shutter.times);
    state_->set_frame(state_->settings.frame);
    if (state_->settings.parts > 1) state_->check_apart("sample-parts");
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
        state_->context->make_current();
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
    if (s.found) return s.found;
    s.begin();
    s.prepare();
    const bool settled = s.guarded(
        [&] { return halflight::find_estimator(*s.prepared, s.colors, s.renderer_settings(s.settings), progress); });
    if (!settled) return std::nullopt;
    s.found = s.prepared->estimator();
    return s.found;
}

std::optional<float> FrameRenderer::find_exposure(const std::function<bool(double)>& asked) {
    const auto progress = keeping_context(asked);
    State& s = *state_;
    if (!s.settings.want_view || !s.settings.view.metered()) return s.settings.view.stops();
    s.begin();
    s.prepare();
    const std::optional<float> stops = s.guarded(
        [&] { return halflight::find_exposure(*s.prepared, s.colors, s.renderer_settings(s.settings), progress); });
    if (stops) s.settings.view.exposure = *stops;
    return stops;
}

RenderResult FrameRenderer::render(std::uint32_t frame, const ProgressCallback& asked) {
    const ProgressCallback progress = keeping_context(asked);
    State& s = *state_;
    find_exposure();
    s.begin();
    s.load_seconds = 0;
    if (s.deformer) s.deformer->take_statistics();  // discards the counts of a frame that has failed
    s.set_frame(frame);
    // The history is valid only if the last picture showed the frame before this one.
    if (s.scene.surfaces_move() && s.last_frame != frame - 1) s.history.forget();
    s.last_frame.reset();  // set again when this frame is complete
    s.settings.history = &s.history;
    RenderResult result = s.shutter.open > 0                 ? s.blurred(frame, progress)
                          : neighbour_frames(s.settings) > 0 ? s.denoised(frame, progress)
                                                             : s.from_checkpoint(frame, progress);
    if (s.settings.denoise_error > 0 && s.only_part == 0) s.estimate_error(frame, result, progress);
    s.last_frame = frame;
    if (s.deformer) {
        const DeformStatistics d = s.deformer->take_statistics();
        s.deformed = DeformCounts{d.vertices, d.vertices_on_cpu, d.seconds};
        result.stats.gpu_bytes += s.deformer->bytes();
    }
    return result;
}

const RenderSettings& FrameRenderer::settings() const {
    return state_->settings;
}

void FrameRenderer::set_frame_settings(const FrameSettings& settings) {
    const std::uint32_t frame = state_->settings.frame;
    static_cast<FrameSettings&>(state_->settings) = settings;
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
    return state_->colors;
}

gpu::Context& FrameRenderer::context() const {
    return *state_->context;
}

Checkpoint* FrameRenderer::checkpoint() const {
    return state_->checkpoint ? &*state_->checkpoint : nullptr;
}

double FrameRenderer::load_seconds() const {
    return state_->load_seconds;
}

const std::optional<DeformCounts>& FrameRenderer::deformed() const {
    return state_->deformed;
}

std::string FrameRenderer::graph_dot() const {
    if (!state_->renderer) throw Error("frame graph", "there is none before the first picture");
    return state_->renderer->graph_dot();
}

}  // namespace halflight
