#include "engine/io/gltf/parts.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "engine/io/gltf/document.h"
#include "engine/io/gltf/schema.h"
#include "engine/io/gltf/uri.h"

namespace halflight {

std::vector<std::filesystem::path> scene_parts(const std::filesystem::path& path, const GltfOptions& options) {
    if (!path.filename().string().ends_with(".parts.json")) return {path};
    GltfDocument list;  // finds the files as it finds those of a scene
    list.file = path.string();
    list.folder = path.parent_path().empty() ? std::filesystem::path(".") : path.parent_path();
    list.options = options;
    constexpr std::uint64_t kMostBytes = 1u << 24;
    const nlohmann::json root = parse_gltf_json(read_file(path, kMostBytes), list.file);
    const auto parts = root.is_object() ? root.find("parts") : root.end();
    if (parts == root.end() || !parts->is_array() || parts->empty()) throw Error(list.file, "has no list of parts");
    std::vector<std::filesystem::path> files;
    for (std::size_t i = 0; i < parts->size(); ++i) {
        const std::string element = fmt::format("parts[{}]", i);
        const nlohmann::json& part = (*parts)[i];
        const auto uri = part.is_object() ? part.find("uri") : part.end();
        if (uri == part.end() || !uri->is_string()) list.fail(element, "has no uri");
        if (uri_scheme(uri->get<std::string>()) == "data") list.fail(element, "its uri is no file");
        list.open_uri(uri->get<std::string>(), element);
        files.push_back(list.files.back());
    }
    return files;
}

std::unique_ptr<MeshSource> open_parts(const std::filesystem::path& path, const GltfOptions& options) {
    const std::vector<std::filesystem::path> files = scene_parts(path, options);
    if (files.size() == 1 && files[0] == path) return std::make_unique<GltfMeshSource>(path, options);
    std::vector<std::unique_ptr<MeshSource>> parts;
    for (const std::filesystem::path& file : files) parts.push_back(std::make_unique<GltfMeshSource>(file, options));
    return std::make_unique<JoinedScenes>(path.string(), std::move(parts));
}

}  // namespace halflight
