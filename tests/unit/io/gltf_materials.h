// Fixture of tests of materials and their textures in glTF files.
#pragma once

#include <map>

#include "engine/io/files.h"
#include "engine/io/png.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {

/// Fixture with a triangle, its texture coordinates, and a material that tests fill in.
class GltfMaterials : public GltfTest {
  protected:
    void SetUp() override {
        GltfTest::SetUp();
        Json& primitive = b.add_triangle();
        primitive["material"] = 0;
        primitive["attributes"]["TEXCOORD_0"] = b.floats("VEC2", {0, 1, 1, 1, 0, 0});
        b.json["materials"] = {Json::object()};
    }
    Json& material() { return b.json["materials"][0]; }
    Json& extension(const char* name) { return material()["extensions"][name]; }

    /// Adds a texture whose image is a new file; returns its index.
    int texture(const std::string& uri, std::vector<std::uint8_t> rgba = {255, 255, 255, 255}) {
        // write_png() waits for the disk, so this cache lets it write each picture only once.
        static std::map<std::string, std::string> encoded;
        std::string& bytes = encoded[std::string(rgba.begin(), rgba.end())];
        if (bytes.empty()) {
            write_png(folder_ / uri, static_cast<int>(rgba.size() / 4), 1, 4, rgba);
            bytes = read_file(folder_ / uri, 10000);
        }
        write(uri, bytes);
        return b.push("textures", {{"source", b.push("images", {{"uri", uri}})}});
    }
    Scene load() { return GltfTest::load(b); }
    std::string refusal() { return GltfTest::refusal(b); }

    GltfBuilder b;
};

}  // namespace halflight
