// Builds small glTF files in a temporary folder.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/io/gltf/gltf.h"
#include "tests/support/error_message.h"
#include "tools/common/temporary_folder.h"

namespace halflight {

using Json = nlohmann::json;

enum ComponentType { kI8 = 5120, kU8 = 5121, kI16 = 5122, kU16 = 5123, kU32 = 5125, kF32 = 5126 };

/// A PNG of 2x1 pixels with 16 bits per channel: (ffff, 8000, 12ff, 0000) and (0100, 00ff, abcd, ffff).
inline constexpr const char* kPng16 =
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABEAYAAACksqPJAAAAGklEQVR4nGP4/7+BQeg/AwMjA8P/1Wf//wcAPtIIBqaX"
    "8jwAAAAASUVORK5CYII=";

inline const Json kRemoved = Json::value_t::discarded;  // value of a property that GltfBuilder::put() removes

/// Builds a glTF whose only buffer is the binary chunk of a .glb. Tests may change `json` before save().
class GltfBuilder {
  public:
    Json json = {{"asset", {{"version", "2.0"}}}};

    /// Adds a buffer view of these values; returns its index.
    template <class T>
    int view(const std::vector<T>& values) {
        bytes_.resize((bytes_.size() + 3) / 4 * 4);  // accessors require aligned views
        const Json v = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", values.size() * sizeof(T)}};
        bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
        return push("bufferViews", v);
    }

    /// Adds an accessor and returns its index; `type` is SCALAR, VEC3, ...
    template <class T>
    int accessor(const char* type, int component_type, const std::vector<T>& components, bool normalized = false) {
        const std::string name = type;
        const std::size_t per_element = name == "SCALAR" ? 1
                                        : name == "MAT4" ? 16
                                                         : static_cast<std::size_t>(name[3] - '0');
        Json a = {{"bufferView", view(components)},
                  {"componentType", component_type},
                  {"count", components.size() / per_element},
                  {"type", type}};
        if (normalized) a["normalized"] = true;
        if (per_element == 1 && !components.empty()) {  // accessors of an animation's times need min and max
            const auto [least, most] = std::minmax_element(components.begin(), components.end());
            a["min"] = {*least}, a["max"] = {*most};
        }
        return push("accessors", a);
    }
    int floats(const char* type, const std::vector<float>& components) { return accessor(type, kF32, components); }

    int push(const char* list, const Json& value) {
        json[list].push_back(value);
        return static_cast<int>(json[list].size()) - 1;
    }

    /// Sets the value at a JSON pointer, or removes it.
    void put(const std::string& pointer, const Json& value) {
        const Json::json_pointer place(pointer);
        if (value.is_discarded())
            json[place.parent_pointer()].erase(place.back());
        else
            json[place] = value;
    }
    void require(const std::vector<std::string>& names) { json["extensionsRequired"] = json["extensionsUsed"] = names; }
    Json& primitive(std::size_t mesh = 0) { return json["meshes"][mesh]["primitives"][0]; }
    Json& attributes() { return primitive()["attributes"]; }
    /// Replaces some elements of an accessor.
    void make_sparse(int accessor, const std::vector<std::uint8_t>& indices, const std::vector<float>& values) {
        json["accessors"][static_cast<std::size_t>(accessor)]["sparse"] = {
            {"count", indices.size()},
            {"indices", {{"bufferView", view(indices)}, {"componentType", kU8}}},
            {"values", {{"bufferView", view(values)}}}};
    }

    /// Adds a mesh of one primitive and a node that instances it; returns the primitive.
    Json& add_mesh(const Json& attributes) {
        const int mesh = push("meshes", {{"primitives", {{{"attributes", attributes}}}}});
        push("nodes", {{"mesh", mesh}});
        return primitive(json["meshes"].size() - 1);
    }
    /// Adds a mesh of one right triangle in the plane z = 0, and its node; returns the primitive.
    Json& add_triangle() { return add_mesh({{"POSITION", floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0})}}); }

    /// Adds an animation with one channel; returns it.
    Json& animate(int node, const char* path, int input, int output, const char* interpolation = "LINEAR") {
        push("animations", {{"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}}},
                            {"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}}});
        return json["animations"].back();
    }
    void add_perspective_camera() {
        push("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}});
    }

    /// Adds the current buffer; glb() calls it if a test has not.
    void add_buffer() { push("buffers", {{"byteLength", bytes_.size()}}); }

    std::string glb() const {
        GltfBuilder whole = *this;
        if (!bytes_.empty() && !json.contains("buffers")) whole.add_buffer();
        std::string text = whole.json.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        std::string binary = bytes_;
        binary.resize((binary.size() + 3) / 4 * 4);
        std::string file = "glTF" + u32(2) + u32(static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
        file += u32(static_cast<std::uint32_t>(text.size())) + "JSON" + text;
        file += u32(static_cast<std::uint32_t>(binary.size())) + std::string("BIN\0", 4) + binary;
        return file;
    }
    const std::string& bytes() const { return bytes_; }

  private:
    static std::string u32(std::uint32_t value) {
        std::string bytes(4, '\0');
        std::memcpy(bytes.data(), &value, 4);
        return bytes;
    }

    std::string bytes_;
};

/// Expects a warning for each of these starts, in this order.
inline void expect_warnings(const std::vector<std::string>& warnings, const std::vector<std::string>& starts) {
    ASSERT_EQ(warnings.size(), starts.size()) << testing::PrintToString(warnings);
    for (std::size_t i = 0; i < starts.size(); ++i) EXPECT_TRUE(warnings[i].starts_with(starts[i])) << warnings[i];
}

/// Fixture with a folder that is removed after the test.
class GltfTest : public testing::Test {
  protected:
    std::filesystem::path write(const std::string& name, const std::string& bytes) const {
        std::filesystem::remove(folder_ / name);  // some file systems flush overwritten files, which is slow
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
        return folder_ / name;
    }
    Scene load(const GltfBuilder& builder, const GltfOptions& options = {}) const {
        return load_gltf(write("scene.glb", builder.glb()), options);
    }
    Scene load_text(const std::string& json) const { return load_gltf(write("scene.gltf", json)); }

    /// Returns the error message of loading, without the name of the file.
    std::string refusal(const GltfBuilder& builder) const {
        return without_name(error_message([&] { load(builder); }));
    }
    std::string refusal_of_text(const std::string& json) const {
        return without_name(error_message([&] { load_text(json); }));
    }
    std::string refusal_of_bytes(const std::string& glb) const {
        return without_name(error_message([&] { load_gltf(write("damaged.glb", glb)); }));
    }

    static constexpr std::size_t kFirst[] = {0};
    /// Replaces the file. Scenes that were opened before keep reading the file that they opened.
    GltfScene open(const GltfBuilder& builder) const { return GltfScene(write("scene.glb", builder.glb())); }
    /// Returns the error message of opening the file, reading its animations, and posing it by the first one at 0.5 s.
    std::string refusal_in_motion(const GltfBuilder& builder) const {
        return without_name(error_message([&] { open(builder).at(0.5, kFirst); }));
    }

    /// A change that makes a file invalid.
    struct Refusal {
        std::string pointer;
        Json value;           // new value at the pointer
        std::string element;  // start of the message
    };
    void expect_refused(const GltfBuilder& valid, std::initializer_list<Refusal> cases) const {
        for (const auto& [pointer, value, element] : cases) {
            GltfBuilder b = valid;
            b.put(pointer, value);
            const std::string message = refusal(b);
            EXPECT_TRUE(!message.empty() && message.starts_with(element)) << pointer << " " << value << ": " << message;
        }
    }
    static std::string without_name(const std::string& message) {
        const std::size_t end = message.find(": ");
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        return end == std::string::npos ? message : message.substr(end + 2);
    }

    const TemporaryFolder folder_;
};

}  // namespace halflight
