// Planes seen by a camera, as texels that preview passes look at.
#pragma once

#include <functional>
#include <vector>

#include "passes/preview/preview_texels.h"
#include "tests/pass/stage.h"

namespace halflight::test {

/// Content of PreviewTexels, row by row.
struct TexelData {
    ivec2 size{0};
    std::vector<vec4> light, guide, place;

    vec4& light_at(int x, int y) { return light[std::size_t(y) * std::size_t(size.x) + std::size_t(x)]; }
    const vec4& light_at(int x, int y) const { return const_cast<TexelData*>(this)->light_at(x, y); }
    const vec4& place_at(int x, int y) const { return place[std::size_t(y) * std::size_t(size.x) + std::size_t(x)]; }
};

/// The plane of all p with dot(normal, p) = distance.
struct Plane {
    vec3 normal{0, 0, 1};  // unit
    float distance = -5;
};

/// Constants of a whole picture through the pixels' centres, its previous camera its own, the origin at 0.
shared::Frame constants_of(const Camera& camera, const ivec2& size);
/// Camera at `from` that looks along -z.
Camera camera_at(const dvec3& from);

/// What such a camera sees of the plane that at(x, y) names for a pixel; light(x, y, place) is what it sees there, of
/// so many samples that are all alike.
TexelData seen_planes(const shared::Frame& frame, const std::function<Plane(int, int)>& at,
                      const std::function<vec3(int, int, const vec3&)>& light, float samples);

/// Textures of such content, imported.
class TexelTextures {
  public:
    explicit TexelTextures(const TexelData& data);
    explicit TexelTextures(const ivec2& size);
    PreviewTexels import(graph::Graph& graph);
    TexelData read() const;

  private:
    gpu::Texture light_, guide_, place_;
};

std::vector<vec4> texels_of(const gpu::Texture& texture);
gpu::Texture texture_of(const std::vector<vec4>& texels, const ivec2& size);

}  // namespace halflight::test
