#include "tools/view/workplace.h"

namespace halflight::view {
namespace {

// Bands end soon on a software driver: what is not wanted any more is not waited for.
constexpr std::size_t kSoftwareBand = std::size_t{1} << 16;  // pixels
constexpr std::size_t kHardwareBand = std::size_t{1} << 20;

}  // namespace

bool Workplace::needs_scene(const Request& r) const {
    return !scene_ || r.scene != request_.scene || r.edits != request_.edits;
}

void Workplace::prepare(const Request& r) {
    const bool new_scene = needs_scene(r);
    const bool same = !new_scene && r.size == request_.size && r.bounces == request_.bounces &&
                      r.aovs == request_.aovs && r.measure == request_.measure;
    if (!same) {
        renderers_.clear();
        resolution_.forget();
    }
    request_ = r;
    if (!new_scene) return;
    scene_.reset();  // two might not fit together
    if (r.edits == SceneEdits()) {
        scene_ = std::make_unique<PreparedScene>(context_, *r.scene, PrepareOptions{.raster_culling = false});
    } else {
        Scene edited = *r.scene;
        apply(r.edits, edited);
        scene_ = std::make_unique<PreparedScene>(context_, edited, PrepareOptions{.raster_culling = false});
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
    s.aovs = request_.aovs;
    s.measure = request_.measure;
    s.band_pixels = context_.software() ? kSoftwareBand : kHardwareBand;
    s.in_turns = true;
    return renderers_.try_emplace(divisor, *scene_, colors_, s).first->second;
}

}  // namespace halflight::view
