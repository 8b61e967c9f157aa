#include "engine/io/gltf/document.h"

#include <algorithm>
#include <cstring>
#include <set>

#include "engine/io/files.h"
#include "engine/io/gltf/extras.h"
#include "engine/io/gltf/material_keys.h"
#include "engine/io/gltf/schema.h"
#include "engine/io/gltf/uri.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::set<std::string>& supported_extensions() {
    static const std::set<std::string> names = [] {
        std::set<std::string> all = gltf_material_extensions();
        all.insert({"EXT_mesh_gpu_instancing", "HALFLIGHT_environment", "KHR_animation_pointer", "KHR_lights_punctual",
                    "KHR_mesh_quantization", "KHR_texture_transform"});
        return all;
    }();
    return names;
}

void check_extensions(const Json& root, GltfDocument& document) {
    std::string unknown;
    for (const std::string name : root.value("extensionsRequired", Json::array())) {
        if (supported_extensions().contains(name)) continue;
        unknown += (unknown.empty() ? "" : ", ") + name;
    }
    if (!unknown.empty()) throw Error(document.file, "requires what is not supported: {}", unknown);
    std::set<std::string> used;
    for (const std::string name : root.value("extensionsUsed", Json::array())) used.insert(name);
    for (const std::string& name : used) {
        if (!supported_extensions().contains(name))
            document.warnings.add(fmt::format("extension {} is used but not supported; it is ignored", name));
    }
}

void check_version(const Json& root, const std::string& file) {
    const Json& asset = root.at("asset");
    const std::string version = asset.value("minVersion", asset.at("version").get<std::string>());
    const bool readable = asset.contains("minVersion") ? version == "2.0" : version.starts_with("2.");
    if (!readable) throw Error(file, "is glTF {}, only 2.0 is supported", version);
}

struct Chunks {
    std::string_view json;
    std::string_view binary;  // binary chunk; empty: none
};

std::uint32_t read_u32(std::string_view bytes, std::size_t offset) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

/// Returns the chunks of a .glb file (glTF 2.0, section 4.4). Unknown chunks are skipped.
Chunks split_glb(std::string_view bytes, const std::string& file) {
    constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;
    if (bytes.size() < 12) throw Error(file, "is truncated: {} bytes are no GLB header", bytes.size());
    if (read_u32(bytes, 4) != 2) throw Error(file, "is GLB version {}, only 2 is supported", read_u32(bytes, 4));
    const std::uint32_t length = read_u32(bytes, 8);
    if (length > bytes.size())
        throw Error(file, "is truncated: it has {} of the {} bytes in its header", bytes.size(), length);
    bytes = bytes.substr(0, length);

    Chunks chunks;
    std::size_t offset = 12;
    for (int i = 0; offset + 8 <= bytes.size(); ++i) {
        const std::uint32_t size = read_u32(bytes, offset), type = read_u32(bytes, offset + 4);
        offset += 8;
        if (size > bytes.size() - offset) throw Error(file, "is damaged: chunk {} does not fit into the file", i);
        if ((i == 0) != (type == kJson)) throw Error(file, "is damaged: its first chunk and no other must be JSON");
        if (type == kJson) chunks.json = bytes.substr(offset, size);
        if (type == kBinary && chunks.binary.empty()) chunks.binary = bytes.substr(offset, size);
        offset += size;
    }
    if (chunks.json.empty()) throw Error(file, "is damaged: it has no JSON");
    return chunks;
}

/// Refuses paths that lead out of the scene's folder, also through symbolic links.
fs::path locate(const GltfDocument& document, const std::string& uri, const std::string& element) {
    const std::string scheme = uri_scheme(uri);
    if (!scheme.empty()) document.fail(element, "cannot follow a URI of scheme '{}'", scheme);
    const std::string decoded = percent_decode(uri);
    if (decoded.empty() || decoded.find('\0') != std::string::npos) document.fail(element, "URI is not a path");
    const fs::path path = document.folder / decoded;
    if (document.options.allow_outside_folder) return path;
    const fs::path inside = fs::weakly_canonical(path).lexically_relative(fs::weakly_canonical(document.folder));
    if (inside.empty() || *inside.begin() == "..")
        document.fail(element, "'{}' is outside the scene's folder, which is not allowed", decoded);
    return path;
}

/// State of tinygltf's file callbacks. A name replaces the URI of every buffer, so that no path reaches tinygltf.
struct BufferFiles {
    GltfDocument& document;
    std::string_view binary_chunk;
    std::vector<std::string> uris{};  // URI per buffer; empty: the binary chunk
    std::vector<std::uint64_t> byte_lengths{};

    /// Length of a buffer without URI and chunk, which is allowed while nothing reads it. tinygltf still needs one
    /// byte.
    static constexpr std::uint64_t kNothing = 0;

    static std::string name(std::size_t buffer) { return std::to_string(buffer); }

    std::vector<unsigned char> read(const std::string& name) const {
        const std::size_t i = std::stoul(name);
        if (byte_lengths[i] == kNothing) return {0};
        const std::string element = fmt::format("buffers[{}]", i);
        const std::string file = uris[i].empty() ? "" : document.read_uri(uris[i], element);
        const std::string_view bytes = uris[i].empty() ? binary_chunk : std::string_view(file);
        if (bytes.size() < byte_lengths[i])
            document.fail(element, "{} bytes, but byteLength is {}", bytes.size(), byte_lengths[i]);
        // Files may be longer than the buffer, and the binary chunk is padded.
        return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(byte_lengths[i])};
    }
};

/// Takes the URIs out of the JSON, so that none reaches tinygltf.
BufferFiles take_buffers(Json& root, GltfDocument& document, std::string_view binary_chunk) {
    BufferFiles files{document, binary_chunk};
    if (!root.contains("buffers")) return files;
    for (Json& buffer : root["buffers"]) {
        const std::size_t i = files.uris.size();
        const std::string element = fmt::format("buffers[{}]", i);
        files.uris.push_back(buffer.value("uri", ""));
        files.byte_lengths.push_back(buffer.at("byteLength"));
        if (files.byte_lengths[i] == 0) document.fail(element, "byteLength is 0");
        if (files.uris[i].empty() && (i != 0 || binary_chunk.empty())) {
            files.byte_lengths[i] = BufferFiles::kNothing;
            buffer["byteLength"] = 1;
        }
        buffer["uri"] = BufferFiles::name(i);
    }
    return files;
}

std::vector<GltfImageSource> take_images(Json& root, const GltfDocument& document) {
    std::vector<GltfImageSource> images;
    if (!root.contains("images")) return images;
    for (const Json& image : root["images"]) {
        GltfImageSource source;
        source.uri = image.value("uri", "");
        source.buffer_view = image.value("bufferView", kNone);
        if (source.uri.empty() == (source.buffer_view == kNone))
            document.fail(fmt::format("images[{}]", images.size()), "needs either a URI or a bufferView");
        source.label = uri_scheme(source.uri) == "data" || source.uri.empty() ? image.value("name", "embedded")
                                                                              : percent_decode(source.uri);
        images.push_back(std::move(source));
    }
    root.erase("images");
    return images;
}

/// Checks the rules that tinygltf enforces without naming the element.
void check_layout(const Json& root, const GltfDocument& document) {
    static const std::set<std::string, std::less<>> kTypes{"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
    const auto each = [&](const char* list, const auto& check) {
        if (!root.contains(list)) return;
        for (std::size_t i = 0; i < root[list].size(); ++i) check(root[list][i], i);
    };
    each("accessors", [&](const Json& accessor, std::size_t i) {
        const auto& type = accessor["type"].get_ref<const std::string&>();
        if (!kTypes.contains(type)) document.fail(fmt::format("accessors[{}]", i), "type '{}' is unknown", type);
    });
    each("bufferViews", [&](const Json& view, std::size_t i) {
        const std::uint64_t stride = view.value("byteStride", std::uint64_t{4});
        if (stride < 4 || stride > 252 || stride % 4 != 0)
            document.fail(fmt::format("bufferViews[{}]", i), "byteStride {} is not 4, 8, ... or 252", stride);
    });
}

/// Takes the indices out of the JSON. tinygltf refuses indices without a bufferView, which glTF allows (all zero).
std::vector<std::vector<int>> take_indices(Json& root) {
    std::vector<std::vector<int>> indices;
    if (!root.contains("meshes")) return indices;
    for (Json& mesh : root["meshes"]) {
        std::vector<int>& of_mesh = indices.emplace_back();
        for (Json& primitive : mesh["primitives"]) {
            of_mesh.push_back(primitive.value("indices", kNone));
            primitive.erase("indices");
        }
    }
    return indices;
}

void parse_model(GltfDocument& document, Json& root, BufferFiles& files) {
    const std::vector<std::vector<int>> indices = take_indices(root);
    tinygltf::FsCallbacks callbacks{};
    callbacks.user_data = &files;
    callbacks.FileExists = [](const std::string&, void*) { return true; };
    callbacks.ExpandFilePath = [](const std::string& path, void*) { return path; };
    callbacks.ReadWholeFile = [](std::vector<unsigned char>* out, std::string*, const std::string& path, void* data) {
        *out = static_cast<const BufferFiles*>(data)->read(path);
        return true;
    };
    tinygltf::TinyGLTF parser;
    parser.SetFsCallbacks(callbacks);
    const std::string json = root.dump();
    if (json.size() > std::numeric_limits<unsigned>::max()) throw Error(document.file, "has more than 4 GiB of JSON");
    std::string error, warning;
    if (parser.LoadASCIIFromString(&document.model, &error, &warning, json.data(), static_cast<unsigned>(json.size()),
                                   "")) {
        for (std::size_t m = 0; m < indices.size(); ++m)
            for (std::size_t p = 0; p < indices[m].size(); ++p)
                document.model.meshes[m].primitives[p].indices = indices[m][p];
        return;
    }
    // The message becomes one line.
    while (!error.empty() && error.back() == '\n') error.pop_back();
    std::ranges::replace(error, '\n', ' ');
    throw Error(document.file, "{}", error);
}

}  // namespace

void GltfWarnings::add(const std::string& what, const std::string& element) {
    auto [it, is_new] = places_.try_emplace(what, Places{element, 0});
    if (is_new) order_.push_back(what);
    ++it->second.count;
}

void GltfWarnings::add(const GltfWarnings& more) {
    for (const std::string& what : more.order_) {
        const Places& places = more.places_.at(what);
        add(what, places.first);
        places_.at(what).count += places.count - 1;
    }
}

void GltfWarnings::write_to(SceneReport& report) const {
    for (const std::string& what : order_) {
        const Places& places = places_.at(what);
        std::string line = places.first.empty() ? what : places.first + ": " + what;
        if (!places.first.empty() && places.count > 1) line += fmt::format(" (and {} more)", places.count - 1);
        report.warnings.push_back(std::move(line));
    }
}

std::string_view GltfDocument::view_bytes(int buffer_view) const {
    // schema.h limits sizes to 2^53, so their sum does not overflow.
    const auto& view = model.bufferViews[static_cast<std::size_t>(buffer_view)];
    const auto& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
    if (data.empty()) fail(fmt::format("buffers[{}]", view.buffer), "has no URI, and there is no binary chunk for it");
    if (view.byteOffset + view.byteLength > data.size())
        fail(fmt::format("bufferViews[{}]", buffer_view), "ends at byte {} of buffers[{}], which has {}",
             view.byteOffset + view.byteLength, view.buffer, data.size());
    return {reinterpret_cast<const char*>(data.data()) + view.byteOffset, view.byteLength};
}

std::string GltfDocument::read_uri(const std::string& uri, const std::string& element) {
    std::string bytes;
    if (uri_scheme(uri) == "data") {
        std::optional<std::string> data = decode_data_uri(uri);
        if (!data) fail(element, "its data URI is malformed");
        bytes = std::move(*data);
    } else {
        try {
            const fs::path path = locate(*this, uri, element);
            try {
                bytes = read_file(path, options.max_file_bytes);
                files.push_back(path);
            } catch (const Error& e) {
                fail(element, "{}", e.what());
            }
        } catch (const fs::filesystem_error& e) {
            fail(element, "'{}': {}", uri, e.code().message());
        }
        if (is_lfs_pointer(bytes))
            fail(element, "'{}' is a Git LFS pointer, not the file itself (git lfs pull fetches it)", uri);
    }
    bytes_read += bytes.size();
    if (bytes_read > options.max_total_bytes)
        fail(element, "exceeds the limit of {} bytes for all files together", options.max_total_bytes);
    return bytes;
}

GltfDocument open_gltf(const fs::path& path, const GltfOptions& options) {
    GltfDocument document;
    document.file = path.string();
    document.folder = path.parent_path().empty() ? fs::path(".") : path.parent_path();
    document.options = options;

    const std::string bytes = read_file(path, options.max_file_bytes);
    document.files.push_back(path);
    document.bytes_read = bytes.size();
    if (bytes.empty()) throw Error(document.file, "is empty");
    if (is_lfs_pointer(bytes))
        throw Error(document.file, "is a Git LFS pointer, not the file itself (git lfs pull fetches it)");
    const bool binary = bytes.starts_with("glTF");
    const Chunks chunks = binary ? split_glb(bytes, document.file) : Chunks{bytes, {}};

    const std::size_t start = chunks.json.find_first_not_of("\xef\xbb\xbf \t\r\n");  // a byte order mark is skipped
    if (start == std::string_view::npos || chunks.json[start] != '{')
        throw Error(document.file, "is neither GLB nor glTF's JSON");
    Json root = parse_gltf_json(chunks.json, document.file);
    document.frame_rate = frame_rate_in_extras(root, document.warnings);
    check_gltf(root, document.file);
    check_version(root, document.file);
    check_extensions(root, document);
    if (root.contains("animations")) {  // read on demand; tinygltf would refuse a damaged animation at once
        document.animations = std::move(root["animations"]);
        root.erase("animations");
    }
    if (root.contains("materials")) {
        document.materials = std::move(root["materials"]);
        root.erase("materials");
    }
    check_layout(root, document);
    document.images = take_images(root, document);
    BufferFiles files = take_buffers(root, document, chunks.binary);
    parse_model(document, root, files);
    for (std::size_t i = 0; i < files.uris.size(); ++i) {
        if (files.byte_lengths[i] == BufferFiles::kNothing) document.model.buffers[i].data.clear();
    }
    return document;
}

}  // namespace halflight
