#include "tools/scenes/path.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <vector>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/gltf/gltf.h"

namespace halflight::scenes {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBin = 0x004E4942;  // "glTF", "JSON", "BIN"
constexpr int kFloat = 5126;

struct Glb {
    Json json;
    std::string bytes;
};

Glb read_glb(const std::filesystem::path& path) {
    const std::string file = read_file(path, std::uint64_t{4} << 30);
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        if (at + 4 <= file.size()) std::memcpy(&value, file.data() + at, 4);
        return value;
    };
    const std::size_t text = word(12), binary = 20 + text;
    const bool whole =
        word(0) == kMagic && word(16) == kJson && word(binary + 4) == kBin && binary + 8 + word(binary) <= file.size();
    if (!whole) throw Error(path.string(), "is no .glb that holds its data");
    return {Json::parse(file.substr(20, text)), file.substr(binary + 8, word(binary))};
}

void write_glb(const Glb& glb, const std::filesystem::path& path) {
    std::string text = glb.json.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::uint64_t total = 12 + 8 + text.size() + 8 + glb.bytes.size();
    if (total > 0xFFFFFFFFULL) throw Error(path.string(), "needs {} bytes, more than the 4 GiB of one .glb", total);
    write_atomically(path, [&](const std::filesystem::path& temporary) {
        CheckedFile file(temporary, path.string());
        const auto words = [&](std::initializer_list<std::uint64_t> list) {
            for (const std::uint64_t value : list) {
                const auto one = static_cast<std::uint32_t>(value);
                file.write(&one, sizeof one);
            }
        };
        words({kMagic, 2, total, text.size(), kJson});
        file.write(text.data(), text.size());
        words({glb.bytes.size(), kBin});
        file.write(glb.bytes.data(), glb.bytes.size());
        file.close();
    });
}

int append(Json& list, Json value) {
    list.push_back(std::move(value));
    return static_cast<int>(list.size()) - 1;
}

int accessor(Glb& glb, const char* type, std::size_t components, const std::vector<float>& values) {
    glb.bytes.resize((glb.bytes.size() + 3) / 4 * 4);
    const std::size_t size = values.size() * sizeof(float);
    const int view =
        append(glb.json["bufferViews"], {{"buffer", 0}, {"byteOffset", glb.bytes.size()}, {"byteLength", size}});
    glb.bytes.append(reinterpret_cast<const char*>(values.data()), size);
    Json json{{"bufferView", view}, {"componentType", kFloat}, {"count", values.size() / components}, {"type", type}};
    if (components == 1) json["min"] = {values.front()}, json["max"] = {values.back()};  // glTF requires both of times
    return append(glb.json["accessors"], std::move(json));
}

const Camera& camera_of(const Scene& scene, const std::string& name) {
    const auto found = name.empty() ? scene.cameras.begin() : std::ranges::find(scene.cameras, name, &Camera::name);
    if (found == scene.cameras.end()) throw Error(scene.name, "has no camera '{}'", name);
    if (found->orthographic) throw Error(scene.name, "camera '{}' is orthographic", found->name);
    return *found;
}

/// Returns the target of the flight, on the line of sight at the depth of the middle of the scene.
dvec3 target_of(const Scene& scene, const Camera& camera) {
    constexpr double kNearest = 1.0 / 16;  // least depth, share of the scene's diagonal
    const WorldBounds bounds = world_bounds(scene);
    const dvec3 eye(camera.camera_to_world[3]), forward = -dvec3(camera.camera_to_world[2]);
    if (bounds.empty()) return eye + forward;
    const double middle = glm::dot(0.5 * (bounds.lower + bounds.upper) - eye, forward);
    return eye + forward * std::max(middle, kNearest * glm::length(bounds.upper - bounds.lower));
}

}  // namespace

void write_camera_path(const std::filesystem::path& path, const std::filesystem::path& out, const PathOptions& o) {
    const Scene scene = load_gltf(path);
    const Camera& camera = camera_of(scene, o.camera);
    const dvec3 target = target_of(scene, camera);
    Glb glb = read_glb(path);

    std::vector<float> times, translations, rotations;
    for (int i = 0; i < o.frames; ++i) {
        const double angle = glm::radians(o.degrees) * (double(i) / (o.frames - 1) - 0.5);
        const dmat4 there = glm::translate(dmat4(1), target) * glm::rotate(dmat4(1), angle, dvec3(0, 1, 0)) *
                            glm::translate(dmat4(1), -target) * camera.camera_to_world;
        const glm::dquat turn = glm::normalize(glm::quat_cast(dmat3(there)));
        times.push_back(static_cast<float>(i / o.fps));
        for (const double value : {there[3].x, there[3].y, there[3].z})
            translations.push_back(static_cast<float>(value));
        for (const double value : {turn.x, turn.y, turn.z, turn.w}) rotations.push_back(static_cast<float>(value));
    }
    Json perspective{{"yfov", camera.vertical_fov}, {"znear", camera.near_plane > 0 ? camera.near_plane : 0.01}};
    if (camera.aspect > 0) perspective["aspectRatio"] = camera.aspect;
    if (camera.far_plane > 0) perspective["zfar"] = camera.far_plane;
    const int lens =
        append(glb.json["cameras"], {{"name", "path"}, {"type", "perspective"}, {"perspective", perspective}});
    const int node = append(glb.json["nodes"], {{"name", "path"}, {"camera", lens}});
    if (glb.json.contains("scenes")) glb.json["scenes"][glb.json.value("scene", 0u)]["nodes"].push_back(node);
    const int input = accessor(glb, "SCALAR", 1, times);
    const Json samplers = {{{"input", input}, {"output", accessor(glb, "VEC3", 3, translations)}},
                           {{"input", input}, {"output", accessor(glb, "VEC4", 4, rotations)}}};
    const Json channels = {{{"sampler", 0}, {"target", {{"node", node}, {"path", "translation"}}}},
                           {{"sampler", 1}, {"target", {{"node", node}, {"path", "rotation"}}}}};
    append(glb.json["animations"], {{"name", "path"}, {"channels", channels}, {"samplers", samplers}});
    glb.bytes.resize((glb.bytes.size() + 3) / 4 * 4);
    glb.json["buffers"][0]["byteLength"] = glb.bytes.size();
    write_glb(glb, out);
}

}  // namespace halflight::scenes
