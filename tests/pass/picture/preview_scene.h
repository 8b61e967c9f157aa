// Makes the texels that preview passes read for planes seen by a camera.
#pragma once

#include <functional>
#include <vector>

#include "passes/preview/preview_texels.h"
#include "tests/pass/stage.h"

namespace halflight::test {

/// Contents of PreviewTexels, row by row.
struct TexelData {
    ivec2 size{0};
    std::vector<vec4> first, second, guide, place;

    vec4& light_at(int x, int y) { return first[std::size_t(y) * std::size_t(size.x) + std::size_t(x)]; }
    const vec4& light_at(int x, int y) const { return const_cast<TexelData*>(this)->light_at(x, y); }
    const vec4& place_at(int x, int y) const { return place[std::size_t(y) * std::size_t(size.x) + std::size_t(x)]; }
};

/// The plane of all p with dot(normal, p) = distance.
struct Plane {
    vec3 normal{0, 0, 1};  // unit length
    float distance = -5;
};

/// Returns the frame constants of a whole picture through the pixels' centres. The previous camera equals the current
/// one, and the origin is 0.
shared::Frame constants_of(const Camera& camera, const ivec2& size);
/// Returns a camera at `from` that looks along -z.
Camera camera_at(const dvec3& from);

/// Returns the texels of a camera that sees the plane at(x, y) in each pixel. light(x, y, place) is the radiance there.
/// All samples are in the first half.
TexelData seen_planes(const shared::Frame& frame, const std::function<Plane(int, int)>& at,
                      const std::function<vec3(int, int, const vec3&)>& light, float samples);

/// Imports textures with the given contents into a graph.
class TexelTextures {
  public:
    explicit TexelTextures(const TexelData& data);
    explicit TexelTextures(const ivec2& size);
    PreviewTexels import(graph::Graph& graph);
    TexelData read() const;

  private:
    gpu::Texture first_, second_, guide_, place_;
};

std::vector<vec4> texels_of(const gpu::Texture& texture);
gpu::Texture texture_of(const std::vector<vec4>& texels, const ivec2& size);

}  // namespace halflight::test
