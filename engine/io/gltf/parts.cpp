#include "engine/io/gltf/parts.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/io/files.h"
#include "engine/io/gltf/document.h"
#include "engine/io/gltf/schema.h"
#include "engine/io/gltf/uri.h"

namespace halflight {

bool is_part_list(const std::filesystem::path& path) {
    return path.filename().string().ends_with(".parts.json");
}

std::vector<std::filesystem::path> scene_parts(const std::filesystem::path& path, const GltfOptions& options) {
    if (!is_part_list(path)) return {path};
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
        files.push_back(list.files.back().path.lexically_normal());
    }
    return files;
}

SceneSize size_of_parts(std::span<GltfScene> parts) {
    SceneSize all;
    for (GltfScene& part : parts) {
        const SceneSize size = part.size();
        all.texture_bytes += size.texture_bytes;
        all.deep_bytes += size.deep_bytes;
        all.pinned_bytes += size.pinned_bytes;
        all.largest_image = std::max(all.largest_image, size.largest_image);
        all.instance_bytes += size.instance_bytes;
        all.decoding_bytes = std::max(all.decoding_bytes, size.decoding_bytes);
        all.largest_mesh = std::max(all.largest_mesh, size.largest_mesh);
        all.drawn += size.drawn;
    }
    return all;
}

std::vector<GltfScene> open_files(const std::filesystem::path& path, const GltfOptions& options) {
    std::vector<GltfScene> files;
    for (const std::filesystem::path& part : scene_parts(path, options)) {
        GltfScene& file = files.emplace_back(part, options);
        if (!is_part_list(path)) continue;
        std::vector<std::size_t> all(file.animations().size());
        std::iota(all.begin(), all.end(), std::size_t{0});
        if (file.surfaces_move(all))
            throw Error(part.string(),
                        "has animations that change more than cameras, which lists of files cannot have");
    }
    return files;
}

std::uint64_t identity_of(std::span<const GltfScene> parts) {
    constexpr std::uint64_t kStart = std::uint64_t{4} << 20, kEnd = std::uint64_t{64} << 10;  // bytes
    Hash hash;
    std::string buffer;
    for (const GltfScene& part : parts) {
        for (const VersionedFile& opened : part.files()) {
            const ByteSource file(opened.path);
            hash.add(file.size());
            for (const std::uint64_t count : {std::min(kStart, file.size()), std::min(kEnd, file.size())}) {
                const std::string_view bytes = file.read(count > kEnd ? 0 : file.size() - count, count, buffer);
                hash.add_bytes(bytes.data(), bytes.size());
            }
        }
    }
    return hash.value();
}

namespace {

std::vector<std::filesystem::path> files_of(std::span<const GltfScene> parts) {
    std::vector<std::filesystem::path> files;
    for (const GltfScene& part : parts)
        for (const VersionedFile& file : part.files()) files.push_back(file.path);
    return files;
}

}  // namespace

std::vector<FileContent> contents_of(std::span<const GltfScene> parts) {
    std::vector<FileContent> contents;
    for (const std::filesystem::path& file : files_of(parts)) contents.push_back(content_of(file));
    return contents;
}

bool have_contents(std::span<const GltfScene> parts, std::span<const FileContent> contents) {
    return std::ranges::equal(files_of(parts), contents, has_content);
}

std::unique_ptr<MeshSource> open_parts(const std::filesystem::path& path, const GltfOptions& options) {
    const std::vector<std::filesystem::path> files = scene_parts(path, options);
    if (files.size() == 1 && files[0] == path) return std::make_unique<GltfMeshSource>(path, options);
    std::vector<std::unique_ptr<MeshSource>> parts;
    for (const std::filesystem::path& file : files) parts.push_back(std::make_unique<GltfMeshSource>(file, options));
    return std::make_unique<JoinedScenes>(path.string(), std::move(parts));
}

}  // namespace halflight
