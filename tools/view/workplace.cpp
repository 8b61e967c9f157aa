#include "tools/view/workplace.h"

namespace halflight::view {
namespace {

// Bands end soon on a software driver: what is not wanted any more is not waited for.
constexpr std::size_t kSoftwareBand = std::size_t{1} << 16;  // pixels
constexpr std::size_t kHardwareBand = std::size_t{1} << 20;

}  // namespace

bool Workplace::needs_scene(const Request& r) const {
    const bool raster = r.culling == rays::Culling::raster;
    return !scene_ || r.scene != request_.scene || r.edits != request_.edits || (raster && !raster_);
}

bool Workplace::reload_shaders() {
    if (!scene_ || scene_->programs().reload() == 0) return false;
    reloaded_ = true;  // renderers may be at work
    return true;
}

void Workplace::prepare(const Request& r) {
    const bool new_scene = needs_scene(r);
    Request still = request_;
    still.camera = r.camera;
    const bool new_light = new_scene || reloaded_ || r.bounces != request_.bounces;
    if (!r.modes.preview.cache)
        radiance_cache_.reset();
    else if (!radiance_cache_)
        radiance_cache_ = std::make_shared<RadianceCache>();
    else if (new_light)
        radiance_cache_->clear();
    if (new_scene || reloaded_ || !serves(still, r)) {
        renderers_.clear();
        history_.forget();
        resolution_.forget();
        request_ = r;
    }
    request_.camera = r.camera;
    reloaded_ = false;
    if (!new_scene) return;
    scene_.reset();  // two might not fit together
    raster_ = r.culling == rays::Culling::raster;
    const PrepareOptions options{.raster_culling = raster_};
    if (r.edits == SceneEdits()) {
        scene_ = std::make_unique<PreparedScene>(context_, *r.scene, options);
    } else {
        Scene edited = *r.scene;
        apply(r.edits, edited);
        scene_ = std::make_unique<PreparedScene>(context_, edited, options);
    }
}

Renderer& Workplace::renderer(int divisor) {
    const auto known = renderers_.find(divisor);
    if (known != renderers_.end()) return known->second;
    const ivec2 size = divided(request_.size, divisor);
    RenderSettings s;
    s.width = size.x, s.height = size.y;
    s.camera = request_.camera;
    s.bounces = request_.bounces;
    s.aovs = gathered(request_);
    s.clamp = request_.modes.clamp;
    s.preview = request_.modes.preview;
    s.radiance_cache = radiance_cache_;
    s.culling = request_.culling;
    s.measure = request_.measure;
    s.band_pixels = context_.software() ? kSoftwareBand : kHardwareBand;
    s.in_turns = true;
    return renderers_.try_emplace(divisor, *scene_, colors_, s).first->second;
}

}  // namespace halflight::view
