#include "engine/io/gltf_schema.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "engine/core/error.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

enum class Kind {
    flag,
    number,
    natural,  // 0 to kMaxNatural
    text,
    texts,       // array
    numbers,     // array of `length` numbers, any number of them where length is 0
    index,       // into the list `of`
    indices,     // array
    index_map,   // object of indices
    index_maps,  // array of them
    object,      // of type `of`
    objects,     // array
};

struct Rule {
    const char* key;
    Kind kind;
    const char* of = "";
    std::size_t length = 0;
    bool required = false;
};

constexpr bool kRequired = true;

// Where the JSON parser of tinygltf keeps a size in an int, larger ones are refused here; no buffer in the wild needs
// them there.
constexpr std::uint64_t kMaxNatural = std::numeric_limits<std::int32_t>::max();
constexpr std::uint64_t kMaxSize = std::uint64_t{1} << 53;  // the largest range of integers that JSON readers agree on

// glTF 2.0, section 5, and the extensions' schemas.
const std::map<std::string_view, std::vector<Rule>>& schema() {
    using enum Kind;
    static const std::map<std::string_view, std::vector<Rule>> rules{
        {"root",
         {{"asset", object, "asset", 0, kRequired},
          {"accessors", objects, "accessor"},
          {"buffers", objects, "buffer"},
          {"bufferViews", objects, "buffer view"},
          {"cameras", objects, "camera"},
          {"extensions", object, "root extensions"},
          {"extensionsUsed", texts},
          {"extensionsRequired", texts},
          {"images", objects, "image"},
          {"materials", objects, "material"},
          {"meshes", objects, "mesh"},
          {"nodes", objects, "node"},
          {"samplers", objects, "sampler"},
          {"scene", index, "scenes"},
          {"scenes", objects, "scene"},
          {"skins", objects, "skin"},
          {"textures", objects, "texture"}}},
        {"root extensions",
         {{"HALFLIGHT_environment", object, "environment"}, {"KHR_lights_punctual", object, "lights"}}},
        {"environment", {{"color", numbers, "", 3, kRequired}}},
        {"lights", {{"lights", objects, "light", 0, kRequired}}},
        {"light",
         {{"type", text, "", 0, kRequired},
          {"name", text},
          {"color", numbers, "", 3},
          {"intensity", number},
          {"spot", object, "spot"}}},
        {"spot", {{"innerConeAngle", number}, {"outerConeAngle", number}}},
        // Checked by itself, when something is to move: see check_gltf_animations().
        {"animations", {{"animations", objects, "animation"}}},
        {"animation",
         {{"name", text},
          {"channels", objects, "animation channel", 0, kRequired},
          {"samplers", objects, "animation sampler", 0, kRequired}}},
        {"animation channel",
         {{"sampler", natural, "", 0, kRequired}, {"target", object, "animation target", 0, kRequired}}},
        {"animation target",
         {{"node", index, "nodes"},
          {"path", text, "", 0, kRequired},
          {"extensions", object, "animation target extensions"}}},
        {"animation target extensions", {{"KHR_animation_pointer", object, "animation pointer"}}},
        {"animation pointer", {{"pointer", text, "", 0, kRequired}}},
        {"animation sampler",
         {{"input", index, "accessors", 0, kRequired},
          {"interpolation", text},
          {"output", index, "accessors", 0, kRequired}}},
        {"asset", {{"version", text, "", 0, kRequired}, {"minVersion", text}}},
        {"accessor",
         {{"bufferView", index, "bufferViews"},
          {"byteOffset", natural, "size"},
          {"componentType", natural, "", 0, kRequired},
          {"count", natural, "size", 0, kRequired},
          {"normalized", flag},
          {"sparse", object, "sparse"},
          {"type", text, "", 0, kRequired}}},
        {"sparse",
         {{"count", natural, "", 0, kRequired},
          {"indices", object, "sparse indices", 0, kRequired},
          {"values", object, "sparse values", 0, kRequired}}},
        {"sparse indices",
         {{"bufferView", index, "bufferViews", 0, kRequired},
          {"byteOffset", natural},
          {"componentType", natural, "", 0, kRequired}}},
        {"sparse values", {{"bufferView", index, "bufferViews", 0, kRequired}, {"byteOffset", natural}}},
        {"buffer", {{"byteLength", natural, "size", 0, kRequired}, {"uri", text}}},
        {"buffer view",
         {{"buffer", index, "buffers", 0, kRequired},
          {"byteLength", natural, "size", 0, kRequired},
          {"byteOffset", natural, "size"},
          {"byteStride", natural}}},
        {"camera",
         {{"type", text, "", 0, kRequired},
          {"name", text},
          {"orthographic", object, "orthographic"},
          {"perspective", object, "perspective"}}},
        {"orthographic",
         {{"xmag", number, "", 0, kRequired},
          {"ymag", number, "", 0, kRequired},
          {"zfar", number, "", 0, kRequired},
          {"znear", number, "", 0, kRequired}}},
        {"perspective",
         {{"aspectRatio", number},
          {"yfov", number, "", 0, kRequired},
          {"zfar", number},
          {"znear", number, "", 0, kRequired}}},
        {"image", {{"name", text}, {"uri", text}, {"bufferView", index, "bufferViews"}}},
        {"material",
         {{"name", text},
          {"alphaCutoff", number},
          {"alphaMode", text},
          {"doubleSided", flag},
          {"emissiveFactor", numbers, "", 3},
          {"emissiveTexture", object, "texture info"},
          {"extensions", object, "material extensions"},
          {"normalTexture", object, "texture info"},
          {"pbrMetallicRoughness", object, "metallic roughness"}}},
        {"metallic roughness",
         {{"baseColorFactor", numbers, "", 4},
          {"baseColorTexture", object, "texture info"},
          {"metallicFactor", number},
          {"metallicRoughnessTexture", object, "texture info"},
          {"roughnessFactor", number}}},
        {"texture info",
         {{"index", index, "textures", 0, kRequired},
          {"texCoord", natural},
          {"scale", number},
          {"extensions", object, "texture extensions"}}},
        {"texture extensions", {{"KHR_texture_transform", object, "texture transform"}}},
        {"texture transform",
         {{"offset", numbers, "", 2}, {"rotation", number}, {"scale", numbers, "", 2}, {"texCoord", natural}}},
        {"material extensions",
         {{"KHR_materials_clearcoat", object, "clearcoat"},
          {"KHR_materials_emissive_strength", object, "emissive strength"},
          {"KHR_materials_ior", object, "ior"},
          {"KHR_materials_pbrSpecularGlossiness", object, "specular glossiness"},
          {"KHR_materials_specular", object, "specular"},
          {"KHR_materials_transmission", object, "transmission"},
          {"KHR_materials_unlit", object, "unlit"}}},
        {"clearcoat",
         {{"clearcoatFactor", number},
          {"clearcoatNormalTexture", object, "texture info"},
          {"clearcoatRoughnessFactor", number},
          {"clearcoatRoughnessTexture", object, "texture info"},
          {"clearcoatTexture", object, "texture info"}}},
        {"emissive strength", {{"emissiveStrength", number}}},
        {"ior", {{"ior", number}}},
        {"specular glossiness",
         {{"diffuseFactor", numbers, "", 4},
          {"diffuseTexture", object, "texture info"},
          {"glossinessFactor", number},
          {"specularFactor", numbers, "", 3},
          {"specularGlossinessTexture", object, "texture info"}}},
        {"specular",
         {{"specularColorFactor", numbers, "", 3},
          {"specularColorTexture", object, "texture info"},
          {"specularFactor", number},
          {"specularTexture", object, "texture info"}}},
        {"transmission", {{"transmissionFactor", number}, {"transmissionTexture", object, "texture info"}}},
        {"unlit", {}},
        {"mesh", {{"name", text}, {"primitives", objects, "primitive", 0, kRequired}, {"weights", numbers}}},
        {"primitive",
         {{"attributes", index_map, "accessors", 0, kRequired},
          {"indices", index, "accessors"},
          {"material", index, "materials"},
          {"mode", natural},
          {"targets", index_maps, "accessors"}}},
        {"node",
         {{"name", text},
          {"camera", index, "cameras"},
          {"children", indices, "nodes"},
          {"extensions", object, "node extensions"},
          {"matrix", numbers, "", 16},
          {"mesh", index, "meshes"},
          {"rotation", numbers, "", 4},
          {"scale", numbers, "", 3},
          {"skin", index, "skins"},
          {"translation", numbers, "", 3},
          {"weights", numbers}}},
        {"node extensions",
         {{"EXT_mesh_gpu_instancing", object, "instancing"}, {"KHR_lights_punctual", object, "light reference"}}},
        {"instancing", {{"attributes", index_map, "accessors", 0, kRequired}}},
        {"light reference", {{"light", index, "lights", 0, kRequired}}},
        {"sampler", {{"magFilter", natural}, {"minFilter", natural}, {"wrapS", natural}, {"wrapT", natural}}},
        {"scene", {{"name", text}, {"nodes", indices, "nodes"}}},
        {"skin",
         {{"inverseBindMatrices", index, "accessors"},
          {"joints", indices, "nodes", 0, kRequired},
          {"skeleton", index, "nodes"}}},
        {"texture", {{"sampler", index, "samplers"}, {"source", index, "images"}}},
    };
    return rules;
}

class Checker {
  public:
    using ListSizes = std::map<std::string, std::size_t, std::less<>>;
    Checker(ListSizes list_sizes, const std::string& file) : file_(file), list_sizes_(std::move(list_sizes)) {}
    Checker(Json& root, const std::string& file) : file_(file) {
        for (auto& [key, value] : root.items()) {
            if (value.is_array()) list_sizes_[key] = value.size();
        }
        const auto lights = Json::json_pointer("/extensions/KHR_lights_punctual/lights");
        if (root.contains(lights) && root[lights].is_array()) list_sizes_["lights"] = root[lights].size();
    }

    /// `path` is where `value` stands, for messages; it comes back as it was.
    void object(Json& value, std::string_view type, std::string& path) const {
        if (!value.is_object()) fail(path, "is not an object");
        for (const Rule& rule : schema().at(type)) {
            const auto it = value.find(rule.key);
            if (it == value.end()) {
                if (rule.required) fail(path, "has no '{}'", rule.key);
                continue;
            }
            const Descent down(path, fmt::format("{}{}", path.empty() ? "" : ".", rule.key));
            property(*it, rule, path);
        }
    }

  private:
    /// Lengthens the path for as long as it lives.
    class Descent {
      public:
        Descent(std::string& path, const std::string& step) : path_(path), length_(path.size()) { path += step; }
        Descent(const Descent&) = delete;
        Descent& operator=(const Descent&) = delete;
        ~Descent() { path_.resize(length_); }

      private:
        std::string& path_;
        std::size_t length_;
    };

    template <class... Args>
    [[noreturn]] void fail(const std::string& path, fmt::format_string<Args...> format, Args&&... args) const {
        const std::string subject = path.empty() ? file_ : file_ + ": " + path;
        throw Error(subject, "{}", fmt::format(format, std::forward<Args>(args)...));
    }

    void property(Json& value, const Rule& rule, std::string& path) const {
        switch (rule.kind) {
            case Kind::flag:
                if (!value.is_boolean()) fail(path, "is not true or false");
                break;
            case Kind::number:
                number(value, path);
                break;
            case Kind::natural:
                natural(value, rule.of == std::string_view("size") ? kMaxSize : kMaxNatural, path);
                break;
            case Kind::text:
                text(value, path);
                break;
            case Kind::texts:
                each(value, path, [&](Json& v) { text(v, path); });
                break;
            case Kind::numbers:
                each(value, path, [&](Json& v) { number(v, path); });
                if (rule.length != 0 && value.size() != rule.length)
                    fail(path, "has {} numbers, not {}", value.size(), rule.length);
                break;
            case Kind::index:
                index(value, rule.of, path);
                break;
            case Kind::indices:
                each(value, path, [&](Json& v) { index(v, rule.of, path); });
                break;
            case Kind::index_map:
                index_map(value, rule.of, path);
                break;
            case Kind::index_maps:
                each(value, path, [&](Json& v) { index_map(v, rule.of, path); });
                break;
            case Kind::object:
                object(value, rule.of, path);
                break;
            case Kind::objects:
                each(value, path, [&](Json& v) { object(v, rule.of, path); });
                break;
        }
    }

    template <class F>
    void each(Json& value, std::string& path, F f) const {
        if (!value.is_array()) fail(path, "is not an array");
        for (std::size_t i = 0; i < value.size(); ++i) {
            const Descent down(path, fmt::format("[{}]", i));
            f(value[i]);
        }
    }

    void number(Json& value, const std::string& path) const {
        if (!value.is_number()) fail(path, "is not a number");
        value = value.get<double>();
    }

    void natural(Json& value, std::uint64_t limit, const std::string& path) const {
        if (value.is_number_float()) {
            const double x = value.get<double>();
            if (x >= 0 && x <= double(kMaxSize) && x == std::floor(x)) value = static_cast<std::uint64_t>(x);
        }
        if (!value.is_number_unsigned()) fail(path, "is not a non-negative whole number");
        if (value.get<std::uint64_t>() > limit) fail(path, "{} is too large", value.get<std::uint64_t>());
    }

    void text(const Json& value, const std::string& path) const {
        if (!value.is_string()) fail(path, "is not a string");
    }

    void index(Json& value, const char* list, const std::string& path) const {
        natural(value, kMaxNatural, path);
        const auto found = list_sizes_.find(list);
        const std::size_t size = found == list_sizes_.end() ? 0 : found->second;
        if (value.get<std::uint64_t>() >= size)
            fail(path, "{} is not an index into {}, which has {}", value.get<std::uint64_t>(), list, size);
    }

    void index_map(Json& value, const char* list, std::string& path) const {
        if (!value.is_object()) fail(path, "is not an object");
        for (auto& [key, v] : value.items()) {
            const Descent down(path, "." + key);
            index(v, list, path);
        }
    }

    const std::string& file_;
    ListSizes list_sizes_;
};

// Far above anything that glTF needs; what walks the tree recursively is safe below it.
constexpr int kMaxDepth = 256;

/// Nesting of JSON, told before it is parsed. (nlohmann's parser has a callback for this, and with one it looks at all
/// elements of a list again for each of them.)
int depth_of(std::string_view text) {
    int depth = 0, deepest = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string && c == '\\') {
            ++i;
        } else if (c == '"') {
            in_string = !in_string;
        } else if (!in_string && (c == '{' || c == '[')) {
            deepest = std::max(deepest, ++depth);
        } else if (!in_string && (c == '}' || c == ']')) {
            --depth;
        }
    }
    return deepest;
}

/// Whatever applications keep there, scenes do not need it.
void remove_extras(Json& value) {
    if (value.is_object()) value.erase("extras");
    if (value.is_structured())
        for (Json& child : value) remove_extras(child);
}

}  // namespace

Json parse_gltf_json(std::string_view text, const std::string& file) {
    if (depth_of(text) > kMaxDepth) throw Error(file, "JSON is nested deeper than {} levels", kMaxDepth);
    Json root;
    try {
        root = Json::parse(text);
    } catch (const Json::exception& e) {
        const std::string_view message = e.what();  // "[json.exception...] parse error at line 1, ..."
        throw Error(file, message.substr(message.find("] ") + 2));
    }
    remove_extras(root);
    std::string path;
    Checker(root, file).object(root, "root", path);
    return root;
}

void check_gltf_animations(Json& animations, std::size_t accessors, std::size_t nodes, const std::string& file) {
    Json root = {{"animations", std::move(animations)}};
    std::string path;
    Checker({{"accessors", accessors}, {"nodes", nodes}}, file).object(root, "animations", path);
    animations = std::move(root["animations"]);
}

}  // namespace halflight
