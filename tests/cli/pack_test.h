// Converts scenes to page files and renders them, for tests of pages.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tests/cli/command_test.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {

/// Returns the vertices of a square field, whose heights are products of the coordinates modulo `period`, and the
/// corners of its 2 side^2 triangles, which face upwards.
inline std::pair<std::vector<float>, std::vector<std::uint32_t>> field(int side, int period, float height) {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    for (int y = 0; y <= side; ++y)
        for (int x = 0; x <= side; ++x)
            positions.insert(positions.end(), {float(x), height * float((x * y) % period), float(y)});
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const auto i = static_cast<std::uint32_t>(y * (side + 1) + x);
            indices.insert(indices.end(), {i, i + side + 1, i + 1, i + 1, i + side + 1, i + side + 2});
        }
    return {positions, indices};
}

class Pack : public CommandTest {
  protected:
    /// Returns the name of a page file of the scene, which replaces the last one.
    std::string packed(const std::string& scene) const {
        std::filesystem::remove(file("a.pages"));
        done(words("pack", scene, file("a.pages"), "--quiet"));
        return file("a.pages");
    }
    /// Renders a scene in memory or from pages, which gives the same file. Returns the file.
    template <class... Parts>
    std::string picture(const std::string& scene, const Parts&... more) const {
        done(words("render", scene, file("a.exr"), "--primary traced --reproducible --quiet", more...));
        return read_text(file("a.exr"));
    }
    /// Writes a field of 2 side^2 triangles for each instance, and returns its name. 200 of them take some seconds.
    /// Further meshes have one instance each. If `lifts` is set, an animation of two seconds moves the last of them.
    std::string large_scene(int instances = 200, int side = 71, int meshes = 1, bool lifts = false) const {
        GltfBuilder b;
        const auto [positions, indices] = field(side, 7, 1);
        std::vector<float> places;
        for (int i = 0; i < instances; ++i)
            places.insert(places.end(), {float(side * (i % 14)), 0, float(side * (i / 14))});
        Json& primitive = b.add_mesh({{"POSITION", b.floats("VEC3", positions)}});
        primitive["indices"] = b.accessor("SCALAR", kU32, indices);
        const Json attributes = {{"TRANSLATION", b.floats("VEC3", places)}};
        b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = attributes;
        b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
        for (int m = 1; m < meshes; ++m) {
            b.push("meshes", b.json["meshes"][0]);
            b.push("nodes", {{"mesh", m}, {"translation", {0, 10 * m, 0}}});
        }
        if (lifts) {
            const float high = float(10 * (meshes - 1));
            const Json target = {{"node", meshes - 1}, {"path", "translation"}};
            const Json sampler = {{"input", b.floats("SCALAR", {0, 2})},
                                  {"output", b.floats("VEC3", {0, high, 0, 100, high, 100})}};
            b.push("animations",
                   {{"name", "lift"}, {"channels", {{{"sampler", 0}, {"target", target}}}}, {"samplers", {sampler}}});
        }
        write_text(file("field.glb"), b.glb());
        return file("field.glb");
    }
};

}  // namespace halflight::test
