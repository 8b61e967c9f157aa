#include "renderer/noisy_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "renderer/frame_constants.h"
#include "shaders/shared/denoise.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

/// Returns the depth of a point (shaders/lib/camera.glsl, camera_depth()), as seen from the middle between the eyes.
double depth_of(const Camera& camera, const dvec3& point) {
    const dmat4& m = camera.camera_to_world;
    const dvec3 away = point - dvec3(m[3]);
    const bool planar = camera.optics.projection == Projection::camera;
    return std::max(planar ? -glm::dot(away, dvec3(m[2])) : glm::length(away), double{shared::kLeastDepth});
}

gpu::Texture* find_motion(std::map<int, gpu::Texture>& motion, int offset) {
    const auto found = motion.find(offset);
    return found == motion.end() ? nullptr : &found->second;
}

/// Least quotient of an image's distance without and with the curvature of its mirror. Below, the image is near
/// infinity or in front of the mirror.
constexpr double kLeastBent = 0.2;

}  // namespace

DenoiserTextures::DenoiserTextures(const gpu::TextureDesc& desc, const Present& present, bool chains)
    : mean_("denoiser mean", desc),
      guide_("denoiser guide", desc),
      reflectance_("denoiser reflectance", desc),
      diffuse_albedo_("denoiser diffuse albedo", desc),
      glossy_albedo_("denoiser glossy albedo", desc) {
    for (std::size_t i = 0; i < light_.size(); ++i)
        if (present[i]) light_[i].emplace(desc);
    if (!chains) return;
    glossy_guide_.emplace("denoiser glossy guide", desc);
    glossy_reflectance_.emplace("denoiser glossy reflectance", desc);
}

DenoiserPixels DenoiserTextures::import_pixels(graph::Graph& graph) {
    const auto import = [&](gpu::Texture& texture) { return graph.import_texture(texture.name(), texture); };
    DenoiserPixels pixels{import(mean_), import(guide_), import(reflectance_), import(diffuse_albedo_),
                          import(glossy_albedo_)};
    for (std::size_t i = 0; i < light_.size(); ++i)
        if (light_[i]) pixels.light[i] = {import(light_[i]->first), import(light_[i]->second)};
    if (glossy_guide_)
        pixels.glossy_guide = import(*glossy_guide_), pixels.glossy_reflectance = import(*glossy_reflectance_);
    return pixels;
}

NamedTextures DenoiserTextures::named() {
    constexpr std::array kNames = {"direct_diffuse", "indirect_diffuse", "glossy"};
    static_assert(kNames.size() == kFilteredLights.size());
    NamedTextures all{{"mean", &mean_},
                      {"guide", &guide_},
                      {"reflectance", &reflectance_},
                      {"diffuse_albedo", &diffuse_albedo_},
                      {"glossy_albedo", &glossy_albedo_}};
    for (std::size_t i = 0; i < light_.size(); ++i) {
        if (!light_[i]) continue;
        all.emplace_back(fmt::format("{}_first", kNames[i]), &light_[i]->first);
        all.emplace_back(fmt::format("{}_second", kNames[i]), &light_[i]->second);
    }
    if (glossy_guide_) all.emplace_back("glossy_guide", &*glossy_guide_);
    if (glossy_reflectance_) all.emplace_back("glossy_reflectance", &*glossy_reflectance_);
    return all;
}

DenoiserTextures::Present DenoiserTextures::present() const {
    Present present{};
    std::ranges::transform(light_, present.begin(), [](const auto& light) { return light.has_value(); });
    return present;
}

std::size_t DenoiserTextures::bytes() const {
    const auto lights = std::ranges::count_if(light_, [](const auto& light) { return light.has_value(); });
    return (5 + (glossy_guide_ ? 2 : 0) + 2 * static_cast<std::size_t>(lights)) * gpu::texture_bytes(mean_.desc());
}

void NoisyFrame::add_places(const Band& band, std::span<const shared::AovRecord> records,
                            std::span<const shared::ChainPlace> chains, const TraceTables& tables) {
    size_ = band.image;
    const std::size_t count = std::size_t(size_.x) * std::size_t(size_.y);
    places_.resize(count);
    if (!chains.empty()) mirrored_.resize(count);
    const auto place_of = [&](const vec3& position, std::uint32_t instance, std::uint32_t triangle) -> Place {
        if (triangle == shared::kMiss) return {};
        const TriangleSource source = source_of(tables, instance, triangle);
        return {dvec3(position) + tables.origin, source.instance + 1, source.triangle};
    };
    for (int y = band.y; y < std::min(band.y + band.rows, size_.y); ++y) {
        for (int x = 0; x < size_.x; ++x) {
            const std::size_t path = shared::path_of_pixel({x, y - band.y}, band.tiles());
            const std::size_t pixel = std::size_t(y) * std::size_t(size_.x) + std::size_t(x);
            const shared::AovRecord& r = records[path];
            places_[pixel] = place_of(r.position, r.instance, r.triangle);
            if (chains.empty()) continue;
            const shared::ChainPlace& c = chains[path];
            mirrored_[pixel] = {place_of(c.position, c.instance, c.triangle), dvec3(c.seen) + tables.origin,
                                mat3(c.turned_x, c.turned_y, c.turned_z), c.bounces == 1 ? c.facet : vec3(0),
                                c.bounces > 0};
        }
    }
}

double NoisyFrame::curvature(int x, int y) const {
    const std::size_t own = std::size_t(y) * std::size_t(size_.x) + std::size_t(x);
    double sum = 0;
    int count = 0;
    for (const ivec2& step : {ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1)}) {
        const ivec2 at = ivec2(x, y) + step;
        if (at.x < 0 || at.y < 0 || at.x >= size_.x || at.y >= size_.y) continue;
        const std::size_t other = std::size_t(at.y) * std::size_t(size_.x) + std::size_t(at.x);
        if (places_[other].object != places_[own].object || mirrored_[other].facet == vec3(0)) continue;
        const dvec3 way = places_[other].position - places_[own].position;
        const double square = glm::dot(way, way);
        if (!(square > 0)) continue;
        sum += glm::dot(dvec3(mirrored_[other].facet - mirrored_[own].facet), way) / square;
        ++count;
    }
    return count > 0 ? sum / count : 0;
}

Image NoisyFrame::motion_image(const Camera& own, const Camera& other, const PreviousSurfaces* surfaces,
                               bool mirrored) const {
    const CameraPlaces places(other, size_);
    const double farthest = 2.0 * std::max(size_.x, size_.y);
    Image motion(size_.x, size_.y, 4);
    std::size_t i = 0;
    for (int y = 0; y < size_.y; ++y) {
        for (int x = 0; x < size_.x; ++x, ++i) {
            const Mirrored* end = mirrored && mirrored_[i].follows ? &mirrored_[i] : nullptr;
            const Place& place = end ? end->place : places_[i];
            if (place.object == 0) continue;
            const std::uint32_t instance = place.object - 1;
            dvec3 here = end ? end->seen : place.position;
            double magnification = 1;
            if (end && end->facet != vec3(0)) {
                // The mirror equation: a curved mirror moves the image towards its surface, or away from it.
                const dvec3& mirror = places_[i].position;
                const double bent = 1 + 2 * curvature(x, y) * glm::distance(mirror, here);
                if (bent > kLeastBent) magnification = 1 / bent;
                here = mirror + magnification * (here - mirror);
            }
            dvec3 there = place.position;
            if (surfaces && surfaces->moved(instance)) there = surfaces->before(instance, place.triangle, there);
            if (end) there = here + magnification * (dmat3(end->turned) * (there - place.position));
            // A point behind the camera, or far outside the picture, has no place in the other frame.
            const auto pixel = places.place(there, {x, y});
            if (!pixel) continue;
            const dvec2 way = *pixel - dvec2(x + 0.5, y + 0.5);
            if (!(std::abs(way.x) < farthest && std::abs(way.y) < farthest)) continue;
            const double nearer = std::log(depth_of(other, there) / depth_of(own, here));
            // An object that is seen in a mirror is another one than the object itself.
            const vec4 value(way, nearer, static_cast<float>(place.object) + (end ? 0.5f : 0.0f));
            std::copy_n(&value.x, 4, motion.at(x, y));
        }
    }
    return motion;
}

void NoisyFrame::add_motion(int offset, const Camera& own, const Camera& other, const PreviousSurfaces* surfaces) {
    for (const bool mirrored : {false, true}) {
        if (mirrored && mirrored_.empty()) continue;
        const Image motion = motion_image(own, other, surfaces, mirrored);
        const auto [at, is_new] =
            (mirrored ? glossy_motion_ : motion_)
                .try_emplace(offset, "denoiser motion", gpu::TextureDesc{size_.x, size_.y, GL_RGBA32F});
        at->second.upload(std::span<const float>(motion.pixels));
    }
}

void NoisyFrame::reserve_motion(const ivec2& size, std::span<const int> offsets, std::span<const int> glossy_offsets) {
    const gpu::TextureDesc desc{size.x, size.y, GL_RGBA32F};
    for (const int offset : offsets) motion_.try_emplace(offset, "denoiser motion", desc);
    for (const int offset : glossy_offsets) glossy_motion_.try_emplace(offset, "denoiser motion", desc);
}

NamedTextures NoisyFrame::named() {
    NamedTextures all = pixels->named();
    for (auto& [offset, texture] : motion_) all.emplace_back(fmt::format("motion{:+}", offset), &texture);
    for (auto& [offset, texture] : glossy_motion_) all.emplace_back(fmt::format("glossy_motion{:+}", offset), &texture);
    return all;
}

std::vector<int> NoisyFrame::offsets(bool glossy) const {
    std::vector<int> offsets;
    for (const auto& [offset, texture] : glossy ? glossy_motion_ : motion_) offsets.push_back(offset);
    return offsets;
}

gpu::Texture* NoisyFrame::motion(int offset) {
    return find_motion(motion_, offset);
}

gpu::Texture* NoisyFrame::glossy_motion(int offset) {
    return find_motion(glossy_motion_, offset);
}

std::size_t NoisyFrame::bytes() const {
    std::size_t sum = pixels ? pixels->bytes() : 0;
    for (const auto* all : {&motion_, &glossy_motion_})
        for (const auto& [offset, texture] : *all) sum += gpu::texture_bytes(texture.desc());
    return sum;
}

}  // namespace halflight
