#include "engine/io/gltf/document.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/core/memory_ledger.h"
#include "engine/core/suggestion.h"
#include "engine/io/file_kind.h"
#include "engine/io/files.h"
#include "engine/io/gltf/area_lights.h"
#include "engine/io/gltf/buffers.h"
#include "engine/io/gltf/driven.h"
#include "engine/io/gltf/extras.h"
#include "engine/io/gltf/image_light.h"
#include "engine/io/gltf/light_profiles.h"
#include "engine/io/gltf/parts.h"
#include "engine/io/gltf/rules.h"
#include "engine/io/gltf/schema.h"
#include "engine/io/gltf/uri.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Returns the extensions that the file requires.
std::set<std::string> check_extensions(const Json& root, GltfDocument& document) {
    std::set<std::string> required;
    std::string unknown;
    for (const std::string name : root.value("extensionsRequired", Json::array())) {
        required.insert(name);
        if (gltf_extensions().contains(name) || gltf_extension_without_effect(name)) continue;
        unknown += (unknown.empty() ? "" : ", ") + name;
    }
    if (!unknown.empty()) throw Error(document.file, "requires what is not supported: {}", unknown);
    std::set<std::string> used = required;
    for (const std::string name : root.value("extensionsUsed", Json::array())) used.insert(name);
    for (const std::string& name : used) {
        if (const char* const what = gltf_extension_without_effect(name))
            document.warnings.add(fmt::format("extension {} is ignored: {}", name, what));
        else if (!gltf_extensions().contains(name))
            document.warnings.add(fmt::format("extension {} is used but not supported; it is ignored", name));
    }
    document.restarts = used.contains("KHR_mesh_primitive_restart");
    return required;
}

/// Recognises glTF 1.0, which need not state its version, by lists that are objects.
void check_generation(const Json& root, const std::string& file) {
    const Json::const_iterator asset = root.find("asset");
    if (asset != root.end() && asset->is_object() && asset->contains("version") && asset->at("version").is_string() &&
        asset->at("version").get<std::string>().starts_with("2."))
        return;
    for (const char* const list : {"buffers", "meshes", "nodes", "scenes"})
        if (root.contains(list) && root[list].is_object()) throw Error(file, "is glTF 1.0, only 2.0 is supported");
}

void check_version(const Json& root, const std::string& file) {
    const Json& asset = root.at("asset");
    const std::string version = asset.value("minVersion", asset.at("version").get<std::string>());
    const bool readable = asset.contains("minVersion") ? version == "2.0" : version.starts_with("2.");
    if (!readable) throw Error(file, "is glTF {}, only 2.0 is supported", version);
}

struct Chunks {
    ByteSource json;
    ByteSource binary;  // binary chunk; empty: none
};

std::uint32_t read_u32(const ByteSource& bytes, std::uint64_t offset) {
    std::string buffer;
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.read(offset, sizeof value, buffer).data(), sizeof value);
    return value;
}

/// Returns the chunks of a .glb file (glTF 2.0, section 4.4). Unknown chunks are skipped.
Chunks split_glb(ByteSource bytes, const std::string& file, GltfWarnings& warnings) {
    constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;
    if (bytes.size() < 12) throw Error(file, "is truncated: {} bytes are no GLB header", bytes.size());
    if (read_u32(bytes, 4) != 2) throw Error(file, "is GLB version {}, only 2 is supported", read_u32(bytes, 4));
    const std::uint32_t length = read_u32(bytes, 8);
    if (length > bytes.size())
        throw Error(file, "is truncated: it has {} of the {} bytes in its header", bytes.size(), length);
    const std::uint64_t behind = bytes.size() - length;
    if (behind > 0) warnings.fault(fmt::format("{} bytes follow its end, they are ignored", behind), "GLB header");
    bytes = bytes.part(0, length);

    Chunks chunks;
    std::uint64_t offset = 12;
    for (int i = 0; offset + 8 <= bytes.size(); ++i) {
        const std::uint32_t size = read_u32(bytes, offset), type = read_u32(bytes, offset + 4);
        offset += 8;
        if (size > bytes.size() - offset) throw Error(file, "is damaged: chunk {} does not fit into the file", i);
        if ((i == 0) != (type == kJson)) throw Error(file, "is damaged: its first chunk and no other must be JSON");
        if (type == kJson) chunks.json = bytes.part(offset, size);
        if (type == kBinary && chunks.binary.size() == 0) chunks.binary = bytes.part(offset, size);
        offset += size;
        if (size % 4 != 0) warnings.fault("its length is not a multiple of 4", fmt::format("GLB chunk {}", i));
    }
    if (offset < bytes.size())
        warnings.fault(fmt::format("{} bytes are no chunk, they are ignored", bytes.size() - offset), "GLB header");
    if (chunks.json.size() == 0) throw Error(file, "is damaged: it has no JSON");
    return chunks;
}

/// Returns the first bytes of a source, enough to tell formats apart.
std::string first_bytes(const ByteSource& bytes) {
    std::string buffer;
    return std::string(bytes.read(0, std::min<std::uint64_t>(bytes.size(), 64), buffer));
}

/// Throws Error for files of other programs, which many users take for scenes.
void check_kind(const ByteSource& bytes, const std::string& file) {
    constexpr std::uint64_t kStart = 4096;  // bytes in which text formats show what they are
    std::string buffer;
    const std::string_view start = bytes.read(0, std::min(bytes.size(), kStart), buffer);
    const std::size_t first = start.find_first_not_of("\xef\xbb\xbf \t\r\n");
    if (start.starts_with("glTF") || (first != std::string_view::npos && start[first] == '{')) return;
    const std::string_view kind = kind_of_file(start, bytes.size());
    if (kind == kPageFileKind) throw Error(file, "is {}; name the scene that it was made of", kind);
    if (!kind.empty()) throw Error(file, "is {}; export glTF 2.0 (.glb) instead", kind);
}

/// Parses the JSON. Its text is freed before anything else is made of it.
Json read_json(const ByteSource& source, const std::string& file, GltfWarnings& warnings) {
    std::string buffer;
    std::string_view json = source.read(0, source.size(), buffer);
    if (json.ends_with('\0')) {
        json.remove_suffix(json.size() - json.find_last_not_of('\0') - 1);
        warnings.fault("is padded with zeros, not with spaces", "JSON");
    }
    const std::size_t start = json.find_first_not_of("\xef\xbb\xbf \t\r\n");  // a byte order mark is skipped
    if (start == std::string_view::npos || json[start] != '{') throw Error(file, "is neither GLB nor glTF's JSON");
    return parse_gltf_json(json, file);
}

void check_inside(const GltfDocument& document, const fs::path& path, const std::string& name,
                  const std::string& element) {
    if (document.options.allow_outside_folder) return;
    const fs::path inside = fs::weakly_canonical(path).lexically_relative(fs::weakly_canonical(document.folder));
    if (inside.empty() || *inside.begin() == "..")
        document.fail(element, "'{}' is outside the scene's folder, which is not allowed", name);
}

/// Opens a file of the scene. Refuses paths that lead out of its folder, also through symbolic links. The file that is
/// open is checked as well, since a link may lead elsewhere by then.
ByteSource open_part(const GltfDocument& document, const fs::path& path, const std::string& name,
                     const std::string& element) {
    check_inside(document, path, name, element);
    ByteSource bytes = [&] {
        try {
            return ByteSource(path);
        } catch (const Error& e) {
            document.fail(element, "{}", e.what());
        }
    }();
    check_inside(document, bytes.location(), name, element);
    return bytes;
}

/// Returns the path and the name of a URI. Many exporters do not escape the characters %, ? and #. Therefore this takes
/// the first name that exists: the decoded URI, the URI as it is, or the decoded URI without query and fragment.
std::pair<fs::path, std::string> locate(const GltfDocument& document, const std::string& uri,
                                        const std::string& element) {
    const std::string scheme = uri_scheme(uri);
    if (!scheme.empty()) document.fail(element, "cannot follow a URI of scheme '{}'", scheme);
    const std::string decoded = percent_decode(uri);
    if (decoded.empty() || decoded.find('\0') != std::string::npos) document.fail(element, "URI is not a path");
    std::error_code none;
    for (const std::string& name : {decoded, uri, percent_decode(without_query(uri))})
        if (!name.empty() && fs::exists(document.folder / name, none)) return {document.folder / name, name};
    return {document.folder / decoded, decoded};
}

std::vector<GltfImageSource> take_images(Json& root) {
    std::vector<GltfImageSource> images;
    if (!root.contains("images")) return images;
    for (Json& image : root["images"]) {
        GltfImageSource source;
        if (image.contains("uri")) source.uri = std::move(image["uri"].get_ref<std::string&>());
        source.buffer_view = image.value("bufferView", kNone);
        source.label = uri_scheme(source.uri) == "data" || source.uri.empty() ? image.value("name", "embedded")
                                                                              : percent_decode(source.uri);
        images.push_back(std::move(source));
    }
    root.erase("images");
    return images;
}

/// Checks rules that depend on values. Adds the faults of objects, which are replaced, to `faults`.
void check_values(Json& root, GltfDocument& document, std::vector<GltfFault>& faults) {
    std::set<std::pair<std::string, std::size_t>> replaced;
    for (const GltfFault& fault : faults) replaced.emplace(fault.list, fault.index);
    const auto each = [&](const std::string& list, const char* type, const auto& check) {
        std::string path = "/" + list;
        std::ranges::replace(path, '.', '/');
        const Json::json_pointer place(path);
        if (!root.contains(place)) return;
        Json& objects = root[place];
        for (std::size_t i = 0; i < objects.size(); ++i) {
            try {
                if (!replaced.contains({list, i})) check(objects[i], fmt::format("{}[{}]", list, i));
            } catch (const Error& error) {
                faults.push_back({list.substr(list.rfind('.') + 1), i, error});
                objects[i] = Json::parse(gltf_stubs().find(type)->second);
            }
        }
    };
    GltfWarnings& warnings = document.warnings;
    each("images", "image", [&](const Json& image, const std::string& element) {
        const bool uri = image.contains("uri") && image["uri"] != "", view = image.contains("bufferView");
        if (uri && view) document.fail(element, "needs either a URI or a bufferView");
        if (!uri && !view) warnings.fault("has neither a URI nor a bufferView, it is left out", element);
    });
    each("nodes", "node", [&](const Json& node, const std::string& element) {
        for (const char* const of_mesh : {"skin", "weights"})
            if (node.contains(of_mesh) && !node.contains("mesh"))
                warnings.fault(fmt::format("has '{}' without a mesh, it is ignored", of_mesh), element);
        if (!node.contains("matrix")) return;
        for (const char* const part : {"translation", "rotation", "scale"})
            if (node.contains(part)) warnings.fault(fmt::format("has a matrix, its {} is ignored", part), element);
    });
    each("accessors", "accessor", [&](const Json& accessor, const std::string& element) {
        static const std::set<std::string> kTypes{"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
        const std::string type = accessor["type"];
        if (!kTypes.contains(type)) document.fail(element, "type '{}' is unknown", type);
        if (accessor["count"] == 0) warnings.fault("count is 0, not at least 1", element);
    });
    each("bufferViews", "buffer view", [&](const Json& view, const std::string& element) {
        if (view["byteLength"] == 0) warnings.fault("byteLength is 0, not at least 1", element);
        const std::uint64_t stride = view.value("byteStride", std::uint64_t{4});
        if (stride == 0)
            warnings.fault("byteStride is 0; elements follow one another", element);
        else if (stride < 4 || stride > 252 || stride % 4 != 0)
            document.fail(element, "byteStride {} is not 4, 8, ... or 252", stride);
    });
    each("cameras", "camera", [&](const Json& camera, const std::string& element) {
        const std::string type = camera["type"];
        if (type != "perspective" && type != "orthographic") document.fail(element, "type '{}' is unknown", type);
        if (!camera.contains(type)) document.fail(element, "has no '{}'", type);
    });
    each("extensions.KHR_lights_punctual.lights", "light", [&](Json& light, const std::string& element) {
        if (light["type"] != "spot" || light.contains("spot")) return;
        warnings.fault("has no 'spot', its cone is the default one", element);
        light["spot"] = Json::object();
    });
}

/// Points textures at the images of their extensions. If an extension is optional, the image that it replaces
/// becomes the fallback. An image that another texture needs is not optional.
void choose_images(GltfDocument& document, const std::set<std::string>& required) {
    std::set<int> needed;
    const auto has = [&](int image) {
        return image != kNone && !document.images[static_cast<std::size_t>(image)].is_missing();
    };
    for (std::size_t i = 0; i < document.model.textures.size(); ++i) {
        tinygltf::Texture& texture = document.model.textures[i];
        if (!has(texture.source)) texture.source = kNone;
        bool by_option = !is_used(document.uses, "textures", i);
        for (const char* name : {"EXT_texture_webp", "KHR_texture_basisu"}) {  // the last one is preferred
            const tinygltf::Value* extension = find_extension(texture.extensions, name);
            const int source =
                extension && extension->Has("source") ? extension->Get("source").GetNumberAsInt() : kNone;
            if (!has(source)) continue;
            by_option = by_option || !required.contains(name);
            if (by_option) {
                GltfImageSource& image = document.images[static_cast<std::size_t>(source)];
                if (image.fallback == kNone && texture.source != source) image.fallback = texture.source;
            }
            texture.source = source;
        }
        if (!by_option && texture.source != kNone) needed.insert(texture.source);
    }
    for (const int image : needed) document.images[static_cast<std::size_t>(image)].optional = false;
}

/// Reads the names of the material variants, and gives primitives the materials of the variant that was asked for. A
/// primitive without a material for the variant keeps its own.
void choose_variant(Json& root, GltfDocument& document) {
    const Json::json_pointer list("/extensions/KHR_materials_variants/variants");
    if (root.contains(list))
        for (const Json& variant : root[list]) document.variants.push_back(variant["name"].get<std::string>());
    const std::string& wanted = document.options.variant;
    if (wanted.empty()) return;
    if (document.variants.empty()) throw Error(document.file, "has no material variants, so not '{}' either", wanted);
    const auto found = std::ranges::find(document.variants, wanted);
    if (found == document.variants.end())
        throw Error(document.file, "no material variant '{}': there are '{}'{}", wanted,
                    fmt::join(document.variants, "', '"), did_you_mean(wanted, document.variants));
    const std::size_t index = static_cast<std::size_t>(found - document.variants.begin());
    const Json::json_pointer mappings("/extensions/KHR_materials_variants/mappings");
    if (!root.contains("meshes")) return;
    for (Json& mesh : root["meshes"])
        for (Json& primitive : mesh["primitives"])
            if (primitive.contains(mappings))
                for (const Json& mapping : primitive[mappings])
                    if (std::ranges::find(mapping["variants"], Json(index)) != mapping["variants"].end())
                        primitive["material"] = mapping["material"];
}

}  // namespace

namespace {

/// Returns the kind of a warning about an element: its text without numbers and names in parentheses.
std::string kind_of(const std::string& what) {
    std::string kind;
    int depth = 0;
    for (const char c : what) {
        depth += c == '(';
        if (depth == 0 && !(c >= '0' && c <= '9')) kind += c;
        if (c == ')' && depth > 0) --depth;
    }
    return kind;
}

}  // namespace

void GltfWarnings::add(const Warning& warning) {
    const auto [place, is_new] =
        places_.try_emplace(warning.element.empty() ? warning.what : kind_of(warning.what) + '\n', warnings_.size());
    if (is_new) {
        warnings_.push_back(warning);
        return;
    }
    Warning& first = warnings_[place->second];
    first.count += warning.count;
    first.fault = first.fault || warning.fault;
}

void GltfWarnings::add(const std::string& what, const std::string& element) {
    add({what, element, false, 1});
}

void GltfWarnings::fault(const std::string& what, const std::string& element) {
    add({what, element, true, 1});
}

void GltfWarnings::add(const GltfWarnings& more) {
    for (const Warning& warning : more.warnings_) add(warning);
}

void GltfWarnings::write_to(SceneReport& report) const {
    for (const auto& [what, element, fault, count] : warnings_) {
        std::string line = element.empty() ? what : element + ": " + what;
        if (!element.empty() && count > 1) line += fmt::format(" (and {} more)", count - 1);
        report.warnings.push_back(std::move(line));
    }
}

void GltfWarnings::refuse_faults(const std::string& file) const {
    const auto found = std::ranges::find(warnings_, true, &Warning::fault);
    if (found != warnings_.end()) throw Error(fmt::format("{}: {}", file, found->element), found->what);
}

void GltfDocument::tolerate_unused(std::string_view list, std::size_t index, const Error& error) {
    if (is_used(uses, list, index)) throw error;
    warnings.fault(fmt::format("{}; nothing uses it", error.reason()), element_of(error, file));
}

ByteSource GltfDocument::open_uri(const std::string& uri, const std::string& element) {
    ByteSource bytes;
    std::string start;
    if (uri_scheme(uri) == "data") {
        std::optional<std::string> data = decode_data_uri(uri);
        if (!data) fail(element, "its data URI is malformed");
        bytes = ByteSource(std::move(*data));
    } else {
        try {
            const auto [path, name] = locate(*this, uri, element);
            bytes = open_part(*this, path, name, element);
            try {
                start = first_bytes(bytes);
            } catch (const Error& e) {
                fail(element, "{}", e.what());
            }
            files.push_back(bytes.versioned());
        } catch (const fs::filesystem_error& e) {
            fail(element, "'{}': {}", uri, e.code().message());
        }
        if (is_lfs_pointer(start))
            fail(element, "'{}' is a Git LFS pointer, not the file itself (git lfs pull fetches it)", uri);
    }
    bytes_of_files += bytes.size();
    return bytes;
}

GltfDocument open_gltf(const fs::path& path, const GltfOptions& options) {
    GltfDocument document;
    document.file = path.string();
    document.folder = path.parent_path().empty() ? fs::path(".") : path.parent_path();
    document.options = options;

    const ByteSource bytes(path);
    document.files.push_back(bytes.versioned());
    document.bytes_of_files = bytes.size();
    if (bytes.size() == 0) throw Error(document.file, "is empty");
    const std::string start_of_file = first_bytes(bytes);
    check_kind(bytes, document.file);
    if (is_lfs_pointer(start_of_file))
        throw Error(document.file, "is a Git LFS pointer, not the file itself (git lfs pull fetches it)");
    const Chunks chunks = start_of_file.starts_with("glTF") ? split_glb(bytes, document.file, document.warnings)
                                                            : Chunks{bytes, ByteSource()};
    if (chunks.json.size() > options.max_json_bytes)
        throw Error(document.file, "has {} bytes of JSON, more than the limit of {}", chunks.json.size(),
                    options.max_json_bytes);

    Json root = read_json(chunks.json, document.file, document.warnings);
    document.frame_rate = frame_rate_in_extras(root, document.warnings);
    document.lenses = lenses_in_extras(root, document.warnings);
    document.light_sizes = light_sizes_in_extras(root, document.warnings);
    if (root.contains("parts") && !root.contains("asset"))
        throw Error(document.file, is_part_list(path) ? "is a list of files, which lists of files cannot contain"
                                                      : "is a list of files, whose name must end with .parts.json");
    check_generation(root, document.file);
    if (root.contains("animations"))  // read on demand, since a damaged animation must not prevent the rest pose
        document.animations = std::exchange(root["animations"], nullptr);
    std::vector<GltfFault> faults = check_gltf(root, document.file, document.warnings);
    check_version(root, document.file);
    const std::set<std::string> required = check_extensions(root, document);
    check_values(root, document, faults);
    choose_variant(root, document);
    const std::vector<AreaLightNode> area_lights = add_area_lights(root, document);
    document.uses = find_uses(root, document.animations);
    for (const auto& [list, index, error] : faults) document.tolerate_unused(list, index, error);
    if (root.contains("materials")) {
        // Measured for 300,000 materials: each takes 3156 bytes, its JSON included, most of them once it is converted.
        constexpr std::size_t kMaterial = 3200;
        const std::size_t count = root["materials"].size();
        MemoryLedger::process().check(kMaterial * count, document.file, fmt::format("{} materials", count));
        document.materials = std::move(root["materials"]);
        root.erase("materials");
    }
    document.images = take_images(root);
    take_buffers(root, document, chunks.binary);
    const Json::json_pointer visible("/extensions/KHR_node_visibility/visible");
    if (root.contains("nodes"))
        for (const Json& node : root["nodes"]) document.visible.push_back(node.value(visible, true) ? 1 : 0);
    document.switched = switched_nodes(document.animations, document.visible.size());
    const Json environment = environment_of(root),
               profiles = root.value(Json::json_pointer("/extensions/EXT_lights_ies/lights"), Json::array());
    document.model = to_model(std::move(root), document.file);
    choose_images(document, required);
    read_light_profiles(profiles, document);
    size_area_lights(area_lights, document);
    read_environment(environment, document);
    return document;
}

}  // namespace halflight
