#include "tests/pass/picture/preview_scene.h"

#include <cmath>
#include <cstring>

namespace halflight::test {
namespace {

gpu::TextureDesc of_size(const ivec2& size) {
    return {size.x, size.y, GL_RGBA32F};
}

}  // namespace

shared::Frame constants_of(const Camera& camera, const ivec2& size) {
    return frame_constants(camera, camera, dvec3(0), 100, {.band = {size, 0, size.y}});
}

Camera camera_at(const dvec3& from) {
    Camera camera;
    camera.camera_to_world[3] = dvec4(from, 1);
    return camera;
}

TexelData seen_planes(const shared::Frame& frame, const std::function<Plane(int, int)>& at,
                      const std::function<vec3(int, int, const vec3&)>& light, float samples) {
    TexelData data{frame.size, {}, {}, {}, {}};
    const vec3 eye(frame.camera_position), forward(frame.camera_forward);
    for (int y = 0; y < frame.size.y; ++y) {
        for (int x = 0; x < frame.size.x; ++x) {
            const vec2 p = 2.0f * (vec2(x, y) + 0.5f) / vec2(frame.size) - 1.0f;
            const vec3 along = forward + p.x * vec3(frame.camera_right) - p.y * vec3(frame.camera_up);
            const Plane plane = at(x, y);
            const float depth = (plane.distance - glm::dot(plane.normal, eye)) / glm::dot(plane.normal, along);
            const vec3 place = eye + depth * along;
            data.first.emplace_back(light(x, y, place), samples);
            data.second.emplace_back(0);
            data.guide.emplace_back(plane.normal, std::log(depth));
            data.place.emplace_back(place, 1);
        }
    }
    return data;
}

TexelTextures::TexelTextures(const TexelData& data)
    : first_(texture_of(data.first, data.size)),
      second_(texture_of(data.second, data.size)),
      guide_(texture_of(data.guide, data.size)),
      place_(texture_of(data.place, data.size)) {}

TexelTextures::TexelTextures(const ivec2& size)
    : first_("first", of_size(size)),
      second_("second", of_size(size)),
      guide_("guide", of_size(size)),
      place_("place", of_size(size)) {}

PreviewTexels TexelTextures::import(graph::Graph& graph) {
    return {graph.import_texture("first", first_), graph.import_texture("second", second_),
            graph.import_texture("guide", guide_), graph.import_texture("place", place_)};
}

TexelData TexelTextures::read() const {
    return {{first_.desc().width, first_.desc().height},
            texels_of(first_),
            texels_of(second_),
            texels_of(guide_),
            texels_of(place_)};
}

std::vector<vec4> texels_of(const gpu::Texture& texture) {
    const std::vector<float> values = texture.read_float();
    std::vector<vec4> texels(values.size() / 4);
    std::memcpy(texels.data(), values.data(), values.size() * sizeof(float));
    return texels;
}

gpu::Texture texture_of(const std::vector<vec4>& texels, const ivec2& size) {
    gpu::Texture texture("texels", of_size(size));
    texture.upload(std::span<const float>(&texels[0].x, 4 * texels.size()));
    return texture;
}

}  // namespace halflight::test
