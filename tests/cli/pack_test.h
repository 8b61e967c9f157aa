// Converts scenes to page files and renders them, for tests of pages.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/unit/io/gltf_builder.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {

using Strings = std::vector<std::string>;

class Pack : public testing::Test {
  protected:
    std::string file(const std::string& name) const { return folder / name; }
    Outcome pack(const std::string& from, const std::string& to, Strings more = {},
                 const RunOptions& options = {}) const {
        Strings arguments = {"pack", from, to};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments, options);
    }
    /// Renders a scene in memory or from pages, which gives the same file.
    Outcome render(const std::string& scene, const std::string& output, Strings view, const Strings& more) const {
        Strings arguments = {"render", scene, file(output), "--primary", "traced", "--reproducible", "--quiet"};
        arguments.insert(arguments.end(), view.begin(), view.end());
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments);
    }
    /// Writes a field of 2 side^2 triangles for each instance, and returns its name. 200 of them take some seconds.
    /// Further meshes have one instance each. If `lifts` is set, an animation of two seconds moves the last of them.
    std::string large_scene(int instances = 200, int side = 71, int meshes = 1, bool lifts = false) const {
        GltfBuilder b;
        std::vector<float> positions, places;
        std::vector<std::uint32_t> indices;
        for (int y = 0; y <= side; ++y)
            for (int x = 0; x <= side; ++x) positions.insert(positions.end(), {float(x), float((x * y) % 7), float(y)});
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const auto i = static_cast<std::uint32_t>(y * (side + 1) + x);
                indices.insert(indices.end(), {i, i + 1, i + side + 1, i + 1, i + side + 2, i + side + 1});
            }
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
    TemporaryFolder folder;
};

}  // namespace halflight::test
