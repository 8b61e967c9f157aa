#include "api/picture/scene_renderer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/rays/batch_server.h"
#include "engine/scene/motion.h"
#include "renderer/metering.h"
#include "renderer/pilot.h"

namespace halflight {
namespace {

/// Returns whether textures are loaded in tiles.
bool in_tiles(const Scene& scene) {
    return std::ranges::any_of(scene.images, [](const TextureImage& image) { return image.tiles != nullptr; });
}

}  // namespace

Camera equipped(const ChosenCamera& chosen, const RenderSettings& settings) {
    const Lens lens = halflight::merged(settings.view.camera.lens, chosen.keyed_lens);
    return with_optics(with_lens(chosen.camera, lens), settings.optics);
}

SceneRenderer::SceneRenderer(LoadedScene& scene, const RenderSettings& settings, RendererOptions& options,
                             std::function<void()> dropped)
    : scene_(scene),
      settings_(settings),
      shutter_(options.shutter),
      exr_tile_(options.exr_tile),
      ray_server_(std::move(options.ray_server)),
      frees_scene_(options.frees_scene && !scene.surfaces_move()),
      dropped_(std::move(dropped)),
      colors_(options.colors ? std::move(*options.colors) : ColorConfig::load()),
      context_(options.context ? std::move(options.context)
                               : std::make_shared<gpu::Context>(gpu::Context::create(options.device))) {
    context_->make_current();
    if (settings.preview.cache) cache_ = std::make_shared<RadianceCache>();
    if (scene.surfaces_move() && std::ranges::any_of(scene.scene().meshes, &Mesh::deforms))
        deformer_.emplace(*context_);
}

SceneRenderer::~SceneRenderer() {
    if (deformer_ && scene_.deformer() == &*deformer_) scene_.deform_by(nullptr);
}

void SceneRenderer::begin() {
    context_->make_current();
    if (scene_.surfaces_move()) scene_.deform_by(deformer());
    if (transforms_ != scene_.transform_revision()) drop();
    transforms_ = scene_.transform_revision();
    if (edits_ == scene_.edits()) return;
    edits_ = scene_.edits();
    history_.forget();  // it holds light of other lights and materials
}

void SceneRenderer::drop() {
    renderer_.reset();
    server_.reset();
    prepared_.reset();
    history_.forget();
    dropped_();
}

/// Calls f(); if that throws, the next picture prepares the scene anew.
template <class F>
auto SceneRenderer::guarded(F f) {
    try {
        return f();
    } catch (...) {
        drop();  // an exception leaves the state undefined
        throw;
    }
}

std::optional<Estimator> SceneRenderer::find_estimator(const std::function<bool(double)>& progress) {
    prepare();
    const bool settled =
        guarded([&] { return halflight::find_estimator(*prepared_, colors_, renderer_settings(settings_), progress); });
    if (!settled) return std::nullopt;
    return found_ = prepared_->estimator();
}

std::optional<float> SceneRenderer::find_exposure(const std::function<bool(double)>& progress) {
    prepare();
    return guarded(
        [&] { return halflight::find_exposure(*prepared_, colors_, renderer_settings(settings_), progress); });
}

RenderSettings SceneRenderer::renderer_settings(const FrameSettings& frame) const {
    RenderSettings s = settings_;
    static_cast<FrameSettings&>(s) = frame;
    s.camera = equipped(scene_.chosen_camera(), settings_);  // camera of the pilot's pictures
    return s;
}

PictureUse SceneRenderer::picture_use() const {
    return {.png = settings_.want_view, .exr_tile = exr_tile_};
}

/// Prepares the scene at 0 s, the reference pose on which hierarchies of all poses depend.
void SceneRenderer::prepare() {
    if (prepared_) return;
    Stopwatch clock;
    scene_.check_surfaces();
    scene_.pose(0);
    load_seconds_ += clock.lap();
    PrepareOptions options{row_of(settings_.culling).needs_cull_tree, settings_.kept, settings_.estimator};
    if (frees_scene_) {
        options.single_pose = true;
        options.scene_read = [this] { scene_.free_surfaces(); };
    }
    MemoryLedger& ledger = MemoryLedger::process();
    tables_memory_ = {ledger, MemoryPart::tables, scene_bytes(scene_.size()) - scene_.size().contents()};
    if (scene_.pages()) {
        options.pages = scene_.pages();
        const paging::PageIndex& index = scene_.pages()->index();
        const std::size_t reading = paging::PagePool::reading_bytes(index);
        const std::size_t lamps = index.geometry.resident.size() * paging::kEmitterBytes;
        const std::size_t fixed = paging::PagePool::fixed_bytes(index);
        ledger.check(reading + lamps + fixed, scene_.choice().scene.string() + ": pages",
                     fmt::format("pages that are read {}, emissive triangles and panes {}, their hierarchy {}",
                                 text_of_bytes(reading), text_of_bytes(lamps), text_of_bytes(fixed)));
        pages_memory_ = {ledger, MemoryPart::pages, reading + lamps + fixed};
        options.pool_bytes = [&](const SceneNeeds& needs) { return choose_pool(index, needs); };
    }
    if (in_tiles(scene_.scene())) {
        const std::size_t batch = paging::TilePool::bytes_of_batch(
            std::min(settings_.band_pixels, std::size_t(settings_.width) * std::size_t(settings_.height)));
        ledger.check(batch, "hits that wait for textures", text_of_bytes(batch));
        textures_memory_ = {ledger, MemoryPart::textures, batch};
        options.tile_bytes = settings_.tile_bytes > 0 ? settings_.tile_bytes : ledger.free() / (scene_.pages() ? 4 : 2);
    }
    guarded([&] { prepared_ = std::make_unique<PreparedScene>(*context_, scene_.scene(), options); });
    if (found_) prepared_->settle(*found_, 0);
    uploaded_ = scene_.revision();
    at_reference_ = true;
    reference_seconds_ = clock.lap();
}

/// Chooses the memory for pages, bytes, before the first pose.
std::size_t SceneRenderer::choose_pool(const paging::PageIndex& index, const SceneNeeds& needs) {
    if (pool_size_ > 0) return pool_size_;  // later poses keep the size
    MemoryLedger& ledger = MemoryLedger::process();
    // Pages take what the picture leaves. Bands become smaller if it would take more than half.
    const std::size_t free = ledger.free();
    RenderSettings s = settings_;
    std::size_t picture = fit_into_memory(needs, scene_.size(), s, picture_use(), free / 2).picture();
    if (scene_.size().moves) picture += picture / 4;  // lights and lobes of other poses
    const std::size_t most = std::max(free / 2, free - std::min(free, picture));
    pool_size_ = settings_.pool_bytes > 0 ? settings_.pool_bytes : most;
    if (!scene_.size().moves)
        pool_size_ =
            std::min(pool_size_, std::max<std::size_t>(index.pages.size(), 1) * paging::PagePool::slot_bytes(index));
    if (settings_.pool_bytes > 0) ledger.check(pool_size_, "page pool", "--page-pool");
    pool_memory_ = {ledger, MemoryPart::pages, pool_size_};
    return pool_size_;
}

void SceneRenderer::make_renderer(const FrameSettings& frame) {
    if (ray_server_ && !server_) server_ = ray_server_(prepared_->trace());
    RenderSettings s = renderer_settings(frame);
    take_memory(s);
    renderer_.emplace(*prepared_, colors_, s, server_.get(), cache_);
}

/// Chooses bands that fit into the memory budget, and enters the picture into the ledger.
void SceneRenderer::take_memory(RenderSettings& s) {
    for (MemoryLedger::Entry* entry : {&picture_memory_, &bands_memory_, &visibility_memory_}) *entry = {};
    MemoryLedger& ledger = MemoryLedger::process();
    const MemoryEstimate m =
        fit_into_memory(prepared_->buffers().needs(), scene_.size(), s, picture_use(), ledger.free());
    const std::size_t whole = m.film + m.preview + m.writing;
    const std::string near =
        neighbour_frames(s) > 0 ? fmt::format(" with {} frames before and after", neighbour_frames(s)) : std::string();
    ledger.check(m.picture(), "render settings",
                 fmt::format("{} x {} pixels: picture{} {}, the smallest bands {}", s.width, s.height, near,
                             text_of_bytes(whole), text_of_bytes(m.picture() - whole)));
    picture_memory_ = {ledger, MemoryPart::picture, whole};
    bands_memory_ = {ledger, MemoryPart::bands, m.band + m.reading};
    visibility_memory_ = {ledger, MemoryPart::visibility, m.visibility};
}

/// Poses the scene at a time, and updates the renderer.
void SceneRenderer::pose(double seconds, const FrameSettings& frame) {
    Stopwatch clock;
    prepare();
    if (!renderer_) {
        clock.lap();
        guarded([&] { make_renderer(frame); });
        reference_seconds_ += clock.lap();
    }
    scene_.pose(seconds);
    if (scene_.revision() == uploaded_) {
        if (at_reference_) reference_seconds_ = 0;  // RenderStats::prepare_seconds is that of the reference
        return;
    }
    scene_.check_surfaces();
    load_seconds_ += clock.lap();
    at_reference_ = false;
    guarded([&] {
        if (prepared_->update(scene_.scene())) {
            renderer_->follow_scene();
        } else {
            renderer_.reset();
            server_.reset();
            make_renderer(frame);
        }
    });
    uploaded_ = scene_.revision();
}

namespace {

/// Start of the opening relative to the time of the frame, in opening times.
double begin_of(ShutterPosition position) {
    return position == ShutterPosition::start ? 0 : position == ShutterPosition::centre ? -0.5 : -1;
}

/// Returns the share of the opening time at which `at` of the light has come in: the inverse of the integral of a
/// trapezoid, whose sides are `ramp` / 2 wide each.
double opened(const Shutter& shutter, double at) {
    if (at > 0.5) return 1 - opened(shutter, 1 - at);
    const double side = shutter.ramp / 2;  // width of the rising side
    const double light = at * (1 - side);  // area of the trapezoid up to the result
    return light < side / 2 ? std::sqrt(2 * side * light) : light + side / 2;
}

/// Ends a picture whose poses cannot share a renderer.
struct OtherKernels {};

void add(rays::HierarchyCounts& all, const rays::HierarchyCounts& more) {
    all.kept += more.kept, all.refitted += more.refitted, all.built += more.built;
}

}  // namespace

/// Poses the scene at a time while a picture is rendered.
void SceneRenderer::pose_within(double seconds) {
    Stopwatch clock;
    scene_.pose(seconds);
    if (scene_.revision() == uploaded_) return;
    scene_.check_surfaces();
    load_seconds_ += clock.lap();
    at_reference_ = false;
    posed_ = false;
    prepared_->update(scene_.scene());
    uploaded_ = scene_.revision();
    if (prepared_->same_kernels()) renderer_->follow_scene();
    posed_ = true;
    if (!prepared_->same_kernels()) throw OtherKernels();
    posing_seconds_ += clock.lap();
    add(posed_hierarchies_, prepared_->hierarchies());
}

/// Makes the renderer anew for poses that share what they need, in the pose of a time.
void SceneRenderer::share_parts(const SceneNeeds& needs, double seconds, const FrameSettings& frame) {
    guarded([&] {
        prepared_->share(needs);
        shares_ = true;
        renderer_.reset();
        server_.reset();
        scene_.pose(seconds);
        prepared_->update(scene_.scene());
        uploaded_ = scene_.revision();
        make_renderer(frame);
    });
}

/// Renders a picture whose samples have times while the shutter is open.
RenderResult SceneRenderer::blurred(const FrameSettings& frame, PictureInputs inputs,
                                    const ProgressCallback& progress) {
    const double own_time = scene_.time_of(frame.frame);
    const auto [first, last] = scene_.shot(own_time);
    const auto seconds = [&, first = first, last = last](double at) {
        const double frames = shutter_.open * (opened(shutter_, at) + begin_of(shutter_.position));
        return std::clamp(scene_.time_of(frame.frame + frames), first, last);
    };
    inputs.pose = [&](std::optional<double> at) {
        const double when = at ? seconds(*at) : own_time;
        pose_within(when);
        return equipped(scene_.camera(when), settings_);
    };
    FrameSettings own = frame;
    own.shutter_times = shutter_times(shutter_, scene_, settings_, frame.samples);
    // All poses of a picture share a renderer, whichever of them this run meets: parts and resumed pictures have the
    // same bits. So what the poses need together is found before.
    if (scene_.parts_come_and_go() && !scene_.pages()) {
        constexpr int kLooks = 16;
        const SceneNeeds alone = prepared_->buffers().needs();
        SceneNeeds all = alone;
        for (int i = 0; i < kLooks; ++i) {
            scene_.pose(seconds((i + 0.5) / kLooks));
            all = united(all, prepared_->needs_of(scene_.scene()));
        }
        scene_.pose(own_time);
        uploaded_ = scene_.revision();
        if (all != alone) share_parts(all, own_time, frame);
    }
    // A pose between those may need still more, and the picture begins anew.
    constexpr int kMostTries = 4;
    for (int tries = 1;; ++tries) {
        const SceneNeeds needs = prepared_->buffers().needs();
        const double prepared = prepared_->seconds(), loading = load_seconds_;
        posing_seconds_ = 0, posed_hierarchies_ = prepared_->hierarchies();
        try {
            RenderResult result = renderer_->render(own, inputs, progress);
            result.stats.prepare_seconds = prepared + posing_seconds_;
            result.stats.render_seconds -= posing_seconds_ + load_seconds_ - loading;
            if (posing_seconds_ > 0) result.stats.hierarchies = posed_hierarchies_;
            // Statistics, warnings and the next update refer to the frame's own time.
            if (scene_.surfaces_move()) pose_within(own_time);
            return result;
        } catch (const OtherKernels&) {
            if (tries == kMostTries)
                throw Error("shutter", "the scene changes too much at frame {} while the shutter is open", frame.frame);
            share_parts(needs, own_time, frame);
        }
    }
}

RenderResult SceneRenderer::picture(double seconds, const FrameSettings& frame, PictureInputs inputs,
                                    const ProgressCallback& progress) {
    if (std::exchange(shares_, false) && prepared_) prepared_->share(std::nullopt), uploaded_ = 0;
    pose(seconds, frame);
    posed_ = true;
    if (cache_) cache_->clear();  // makes frames independent of earlier ones
    inputs.history = &history_;
    const std::uint64_t before = interruptions();
    RenderResult result;
    try {
        result = shutter_.open > 0 ? blurred(frame, std::move(inputs), progress)
                                   : renderer_->render(frame, inputs, progress);
    } catch (...) {
        history_.forget();                                 // the picture may be in it
        if (interruptions() == before || !posed_) drop();  // the state is undefined
        throw;
    }
    result.stats.prepare_seconds += std::exchange(reference_seconds_, 0);
    return result;
}

RenderResult SceneRenderer::still(FrameNumber frame, const FrameSettings& frame_settings, PictureInputs inputs,
                                  const ProgressCallback& progress) {
    const double seconds = scene_.time_of(frame);
    const bool motion =
        settings_.preview.temporal || std::ranges::find(settings_.aovs, "motion") != settings_.aovs.end();
    if (!scene_.surfaces_move() || !motion) return picture(seconds, frame_settings, std::move(inputs), progress);
    Stopwatch clock;
    Scene before = scene_.posed(scene_.time_of(static_cast<double>(frame) - 1));
    load_seconds_ += clock.lap();
    pose(seconds, frame_settings);
    const PreviousSurfaces surfaces(scene_.scene(), std::move(before));
    inputs.previous_surfaces = &surfaces;
    return picture(seconds, frame_settings, std::move(inputs), progress);
}

void SceneRenderer::denoise(NoisyFrame& noisy, std::span<const NearFrame> others, RenderResult& result) {
    if (!renderer_) pose(scene_.time_of(settings_.frame), settings_);  // all frames come from files
    guarded([&] { renderer_->denoise(noisy, others, result); });
}

}  // namespace halflight
