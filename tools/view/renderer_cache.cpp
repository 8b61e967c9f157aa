#include "tools/view/renderer_cache.h"

#include <algorithm>
#include <span>

#include "api/scene/paged_edits.h"
#include "engine/core/memory_ledger.h"
#include "engine/core/release.h"
#include "engine/settings/layers.h"
#include "renderer/hand_over.h"

namespace halflight::view {
namespace {

// Bands are shorter on software drivers, because an outdated request is only given up between batches of rays.
constexpr std::size_t kSoftwareBand = std::size_t{1} << 18;  // pixels
constexpr std::size_t kHardwareBand = std::size_t{1} << 20;

/// Returns the scene with edits; the scene itself if there are none.
std::shared_ptr<const Scene> edited(const std::shared_ptr<const Scene>& scene,
                                    const std::shared_ptr<const SceneTree>& tree, const SceneEdits& edits) {
    if (edits == SceneEdits()) return scene;
    auto other = std::make_shared<Scene>(*scene);
    apply(edits, *other, tree ? *tree : tree_of(*scene));
    return other;
}

std::vector<std::string> names_of(std::span<const AovInfo> aovs) {
    std::vector<std::string> names;
    for (const AovInfo& aov : aovs) names.emplace_back(aov.name);
    return names;
}

}  // namespace

bool RendererCache::needs_scene(const Request& r) const {
    const bool raster = row_of(r.culling).needs_cull_tree;
    return !scene_ || r.reference != request_.reference || r.scene != request_.scene || r.edits != request_.edits ||
           (raster && !raster_);
}

bool RendererCache::reload_shaders() {
    if (programs_->reload() == 0) return false;
    reloaded_ = true;  // renderers may be in use
    return true;
}

void RendererCache::prepare_scene(const Request& r) {
    if (r.pages) check_paged_edits(r.edits, *r.reference, r.pages->index(), r.reference->name);
    const bool raster = row_of(r.culling).needs_cull_tree;
    const bool known = scene_ && r.reference == request_.reference && (!raster || raster_) &&
                       surface_edits(r.edits) == surface_edits(request_.edits);
    try {
        if (!known) {
            clear_renderers();
            scene_.reset();  // frees the old scene first: two may not fit into memory
            programs_->end_period();
            trim_memory();
            raster_ = raster;
            PrepareOptions options{.raster_culling = raster, .pages = r.pages, .programs = programs_};
            const std::size_t pool = r.pool_bytes > 0 ? r.pool_bytes : MemoryLedger::process().free() / 2;
            options.pool_bytes = [pool](const SceneNeeds&) { return pool; };
            scene_ =
                std::make_unique<PreparedScene>(context_, *edited(r.reference, r.reference_tree, r.edits), options);
        }
        if (!known && r.scene == r.reference) return;
        if (!scene_->update(*edited(r.scene, r.tree, r.edits))) return clear_renderers();
        for (auto& [kind, renderer] : renderers_) renderer.follow_scene();
        for (auto& [divisor, renderer] : matte_renderers_) renderer.follow_scene();
        region_renderer_.reset();
    } catch (...) {
        clear_renderers();
        scene_.reset();
        throw;
    }
}

void RendererCache::remember_previous_view(const Request& r) {
    if (r.reference != request_.reference || surface_edits(r.edits) != surface_edits(request_.edits)) {
        previous_camera_.reset();
        previous_scene_.reset();
    } else if (r.scene != request_.scene || !same(r.camera, request_.camera)) {
        previous_camera_ = request_.camera;
        previous_scene_ = request_.scene;
        previous_tree_ = request_.tree;
    }
}

void RendererCache::fill_frame_settings(FrameSettings& frame) const {
    frame.camera = request_.camera;
    frame.frame = request_.frame;
    frame.previous_camera = previous_camera_;
}

PictureInputs RendererCache::inputs() {
    // Temporal preview modes accumulate pictures of the same pose only.
    surfaces_.reset();
    if (wants_motion(request_) && !request_.modes.preview.temporal && pose_is_new()) {
        const SceneEdits moves = surface_edits(request_.edits);
        moved_scene_ = edited(request_.scene, request_.tree, moves);
        moved_previous_scene_ = edited(previous_scene_, previous_tree_, moves);
        surfaces_.emplace(*moved_scene_, *moved_previous_scene_);
    }
    return {.previous_surfaces = surfaces_ ? &*surfaces_ : nullptr, .history = &history_};
}

void RendererCache::prepare(const Request& r) {
    const bool new_scene = needs_scene(r);
    const bool new_light = new_scene || reloaded_ || r.bounces != request_.bounces;
    if (!r.modes.preview.cache)
        radiance_cache_.reset();
    else if (!radiance_cache_)
        radiance_cache_ = std::make_shared<RadianceCache>();
    else if (new_light)
        radiance_cache_->clear();
    remember_previous_view(r);
    if (new_scene) {
        history_.forget();
        prepare_scene(r);
    }
    // Renderers do not depend on these members, which are set for each picture.
    Request known = request_;
    known.reference = r.reference, known.scene = r.scene, known.edits = r.edits;
    known.reference_tree = r.reference_tree, known.tree = r.tree;
    known.frame = r.frame, known.camera = r.camera, known.aovs = r.aovs, known.region = r.region;
    if (reloaded_ || renderers_.empty() || !serves(known, r)) {
        clear_renderers();
        history_.forget();
        resolution_.reset();
        known = r;
    }
    request_ = std::move(known);
    reloaded_ = false;
}

void RendererCache::clear_renderers() {
    renderers_.clear();
    matte_renderers_.clear();
    region_renderer_.reset();
}

RenderSettings RendererCache::settings(const Kind& kind) const {
    const ivec2 size = divided(request_.size, kind.divisor);
    RenderSettings s;
    s.width = size.x, s.height = size.y;
    s.camera = request_.camera;
    s.bounces = request_.bounces;
    s.aovs = sampled_aovs();
    s.clamp = request_.modes.clamp;
    s.backfaces = request_.modes.backfaces;
    s.show_lamps = request_.modes.show_lamps;
    s.preview = request_.modes.preview;
    s.preview.filter = kind.filtered;
    s.denoise = kind.denoised;
    s.culling = request_.culling;
    s.measure = request_.measure;
    s.band_pixels = context_.software() ? kSoftwareBand : kHardwareBand;
    s.in_turns = true;
    return s;
}

Renderer& RendererCache::renderer(const Kind& kind) {
    const auto known = renderers_.find(kind);
    if (known != renderers_.end()) return known->second;
    return renderers_.try_emplace(kind, *scene_, colors_, settings(kind), nullptr, radiance_cache_).first->second;
}

Renderer& RendererCache::region_renderer(const PixelWindow& window) {
    if (region_renderer_ && region_renderer_->first == window) return region_renderer_->second;
    region_renderer_.reset();
    RenderSettings s = settings({});
    s.crop = window;
    s.preview = {};
    return region_renderer_.emplace(window, Renderer(*scene_, colors_, s)).second;
}

RenderResult RendererCache::mattes(int divisor, int samples, const std::vector<std::string>& aovs) {
    auto known = matte_renderers_.find(divisor);
    if (known == matte_renderers_.end()) {
        RenderSettings s = settings({divisor});
        s.bounces = 0;
        s.preview = {};
        s.aovs = mattes_of(names_of(known_aovs()));
        s.measure = false;
        known = matte_renderers_.try_emplace(divisor, *scene_, colors_, s).first;
    }
    FrameSettings frame;
    frame.camera = request_.camera;
    frame.frame = request_.frame;
    // The mean of a picture lacks its cached samples.
    const int cached = request_.modes.preview.cache ? kCachedSamples : 0;
    frame.samples = std::clamp(samples - cached, 1, kMatteSamples);
    RenderResult all = known->second.render(frame);
    std::vector<ExrLayer> wanted;
    const std::vector<std::string> made = mattes_of(names_of(known_aovs()));
    for (const std::string& aov : aovs)
        wanted.push_back(all.aovs[static_cast<std::size_t>(std::ranges::find(made, aov) - made.begin())]);
    all.aovs = std::move(wanted);
    return all;
}

}  // namespace halflight::view
