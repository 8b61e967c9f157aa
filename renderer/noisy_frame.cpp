#include "renderer/noisy_frame.h"

#include <algorithm>
#include <cmath>

#include "renderer/frame_constants.h"
#include "shaders/shared/denoise.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/rays.h"

namespace halflight {
namespace {

/// Returns the distance of a point along the axis of a camera.
double depth_of(const Camera& camera, const dvec3& point) {
    const dmat4& m = camera.camera_to_world;
    return std::max(-glm::dot(point - dvec3(m[3]), dvec3(m[2])), double{shared::kLeastDepth});
}

}  // namespace

DenoiserTextures::DenoiserTextures(const gpu::TextureDesc& desc, const Present& present)
    : mean_("denoiser mean", desc),
      guide_("denoiser guide", desc),
      reflectance_("denoiser reflectance", desc),
      diffuse_albedo_("denoiser diffuse albedo", desc),
      glossy_albedo_("denoiser glossy albedo", desc) {
    for (std::size_t i = 0; i < light_.size(); ++i)
        if (present[i]) light_[i].emplace(desc);
}

DenoiserPixels DenoiserTextures::import_pixels(graph::Graph& graph) {
    const auto import = [&](gpu::Texture& texture) { return graph.import_texture(texture.name(), texture); };
    DenoiserPixels pixels{import(mean_), import(guide_), import(reflectance_), import(diffuse_albedo_),
                          import(glossy_albedo_)};
    for (std::size_t i = 0; i < light_.size(); ++i)
        if (light_[i]) pixels.light[i] = {import(light_[i]->first), import(light_[i]->second)};
    return pixels;
}

std::size_t DenoiserTextures::bytes() const {
    const auto lights = std::ranges::count_if(light_, [](const auto& light) { return light.has_value(); });
    return (5 + 2 * static_cast<std::size_t>(lights)) * gpu::texture_bytes(mean_.desc());
}

void NoisyFrame::add_places(const Band& band, std::span<const shared::AovRecord> records, const TraceTables& tables) {
    size_ = band.image;
    places_.resize(std::size_t(size_.x) * std::size_t(size_.y));
    for (int y = band.y; y < std::min(band.y + band.rows, size_.y); ++y) {
        for (int x = 0; x < size_.x; ++x) {
            const shared::AovRecord& r = records[shared::path_of_pixel({x, y - band.y}, band.tiles())];
            Place& place = places_[std::size_t(y) * std::size_t(size_.x) + std::size_t(x)];
            place = {};
            if (r.triangle == shared::kMiss) continue;
            const TriangleSource source = source_of(tables, r.instance, r.triangle);
            place = {dvec3(r.position) + tables.origin, source.instance + 1, source.triangle};
        }
    }
}

void NoisyFrame::add_motion(int offset, const Camera& own, const Camera& other, const PreviousSurfaces* surfaces) {
    const dmat4 to_clip = world_to_clip(other, size_, 1);  // depth is not used
    const double farthest = 2.0 * std::max(size_.x, size_.y);
    Image motion(size_.x, size_.y, 4);
    std::size_t i = 0;
    for (int y = 0; y < size_.y; ++y) {
        for (int x = 0; x < size_.x; ++x) {
            const Place& place = places_[i++];
            if (place.object == 0) continue;
            const std::uint32_t instance = place.object - 1;
            dvec3 there = place.position;
            if (surfaces && surfaces->moved(instance)) there = surfaces->before(instance, place.triangle, there);
            const dvec4 clip = to_clip * dvec4(there, 1);
            const dvec2 pixel = dvec2(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * dvec2(size_);
            const dvec2 way = pixel - dvec2(x + 0.5, y + 0.5);
            // A point behind the camera, or far outside the picture, has no place in the other frame.
            if (!(clip.w > 0 && std::abs(way.x) < farthest && std::abs(way.y) < farthest)) continue;
            const double nearer = std::log(depth_of(other, there) / depth_of(own, place.position));
            const vec4 value(way, nearer, place.object);
            std::copy_n(&value.x, 4, motion.at(x, y));
        }
    }
    const auto [at, is_new] =
        motion_.try_emplace(offset, "denoiser motion", gpu::TextureDesc{size_.x, size_.y, GL_RGBA32F});
    at->second.upload(std::span<const float>(motion.pixels));
}

gpu::Texture* NoisyFrame::motion(int offset) {
    const auto found = motion_.find(offset);
    return found == motion_.end() ? nullptr : &found->second;
}

std::size_t NoisyFrame::bytes() const {
    std::size_t sum = pixels ? pixels->bytes() : 0;
    for (const auto& [offset, texture] : motion_) sum += gpu::texture_bytes(texture.desc());
    return sum;
}

}  // namespace halflight
