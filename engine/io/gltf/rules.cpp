#include "engine/io/gltf/rules.h"

#include <algorithm>

#include "engine/io/gltf/material_keys.h"
#include "engine/scene/light_types.h"

namespace halflight {
namespace {

constexpr bool kRequired = true, kDropped = true;

/// Returns the rule of a key, without its name.
GltfRule rule_of(const GltfMaterialKey& key) {
    using Kind = GltfMaterialKey::Kind;
    switch (key.kind) {
        case Kind::number:
            return {"", GltfKind::number};
        case Kind::numbers:
            return {"", GltfKind::numbers, "", key.default_value.size()};
        case Kind::flag:
            return {"", GltfKind::flag};
        case Kind::texture:
            return {"", GltfKind::object, "texture info"};
        case Kind::extension:
            break;
    }
    return {"", GltfKind::object, "empty"};
}

/// Adds the rule of a key at the path from an object of a type, and rules of the objects on the path that have none
/// yet.
void add_key(GltfRules& rules, std::string type, const std::string& path, GltfRule rule) {
    std::size_t begin = 1;
    for (std::size_t end; (end = path.find('/', begin)) != std::string::npos; begin = end + 1) {
        const std::string name = path.substr(begin, end - begin);
        std::vector<GltfRule>& object = rules[type];
        const auto found = std::ranges::find(object, name, &GltfRule::key);
        type = found != object.end() ? found->of : type + "." + name;
        if (found == object.end()) object.push_back({name, GltfKind::object, type});
    }
    rule.key = path.substr(begin);
    std::vector<GltfRule>& object = rules[type];
    if (std::ranges::find(object, rule.key, &GltfRule::key) == object.end()) object.push_back(std::move(rule));
}

GltfRules make_rules() {
    using enum GltfKind;
    GltfRules rules{
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
         {{"EXT_lights_area", object, "area lights"},
          {"EXT_lights_ies", object, "profile lights"},
          {"EXT_lights_image_based", object, "image lights"},
          {"HALFLIGHT_environment", object, "environment"},
          {"KHR_lights_punctual", object, "lights"},
          {"KHR_materials_variants", object, "variants", 0, !kRequired, kDropped}}},
        {"variants", {{"variants", objects, "variant", 0, kRequired}}},
        {"variant", {{"name", text, "", 0, kRequired}}},
        {"environment", {{"color", numbers, "", 3, kRequired}}},
        {"lights", {{"lights", objects, "light", 0, kRequired}}},
        {"light", {{"type", text, "", 0, kRequired}, {"name", text}, {"color", numbers, "", 3}, {"intensity", number}}},
        {"profile lights", {{"lights", objects, "light profile", 0, kRequired}}},
        {"light profile", {{"name", text}, {"uri", text}, {"bufferView", index, "bufferViews"}, {"mimeType", text}}},
        {"area lights", {{"lights", objects, "area light", 0, kRequired}}},
        {"area light",
         {{"type", text},
          {"shape", text},  // what the draft's schema calls the type
          {"name", text},
          {"color", numbers, "", 3},
          {"intensity", number},
          {"size", number},
          {"rect", object, "area rectangle"}}},
        {"area rectangle", {{"aspect", number}}},
        {"image lights", {{"lights", objects, "image light", 0, kRequired}}},
        {"image light",  // its irradiance follows from the images
         {{"name", text},
          {"intensity", number},
          {"rotation", numbers, "", 4},
          {"specularImages", index_lists, "images", 0, kRequired}}},
        // check_gltf_animation() checks these when animations are read.
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
          {"max", anything},  // only their presence is checked, since damaged limits are common
          {"min", anything},
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
        {"buffer",
         {{"byteLength", natural, "size", 0, kRequired}, {"extensions", object, "buffer extensions"}, {"uri", text}}},
        {"buffer extensions",
         {{"EXT_meshopt_compression", object, "meshopt buffer"},
          {"KHR_meshopt_compression", object, "meshopt buffer"}}},
        {"meshopt buffer", {{"fallback", flag}}},
        {"buffer view",
         {{"buffer", index, "buffers", 0, kRequired},
          {"byteLength", natural, "size", 0, kRequired},
          {"byteOffset", natural, "size"},
          {"byteStride", natural},
          {"extensions", object, "buffer view extensions"}}},
        {"buffer view extensions",
         {{"EXT_meshopt_compression", object, "meshopt view"}, {"KHR_meshopt_compression", object, "meshopt view"}}},
        {"meshopt view",
         {{"buffer", index, "buffers", 0, kRequired},
          {"byteLength", natural, "size", 0, kRequired},
          {"byteOffset", natural, "size"},
          {"byteStride", natural, "", 0, kRequired},
          {"count", natural, "size", 0, kRequired},
          {"filter", text},
          {"mode", text, "", 0, kRequired}}},
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
        {"material", {{"name", text}, {"alphaMode", text}}},
        {"texture info",
         {{"index", index, "textures", 0, kRequired},
          {"texCoord", natural},
          {"scale", number},
          {"extensions", object, "texture extensions"}}},
        {"texture extensions", {{"KHR_texture_transform", object, "texture transform"}}},
        {"texture transform",
         {{"offset", numbers, "", 2}, {"rotation", number}, {"scale", numbers, "", 2}, {"texCoord", natural}}},
        {"empty", {}},
        {"mesh", {{"name", text}, {"primitives", objects, "primitive", 0, kRequired}, {"weights", numbers}}},
        {"primitive",
         {{"attributes", index_map, "accessors", 0, kRequired},
          {"extensions", object, "primitive extensions"},
          {"indices", index, "accessors"},
          {"material", index, "materials"},
          {"mode", natural},
          {"targets", index_maps, "accessors"}}},
        {"primitive extensions",
         {{"KHR_draco_mesh_compression", object, "draco mesh"},
          {"KHR_materials_variants", object, "variant mappings", 0, !kRequired, kDropped}}},
        {"variant mappings", {{"mappings", objects, "variant mapping", 0, kRequired, kDropped}}},
        {"variant mapping",
         {{"material", index, "materials", 0, kRequired}, {"variants", indices, "variants", 0, kRequired}}},
        {"draco mesh",
         {{"attributes", naturals, "", 0, kRequired}, {"bufferView", index, "bufferViews", 0, kRequired}}},
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
         {{"EXT_lights_area", object, "area reference"},
          {"EXT_lights_ies", object, "profile reference"},
          {"EXT_mesh_gpu_instancing", object, "instancing"},
          {"KHR_lights_punctual", object, "light reference"},
          {"KHR_node_visibility", object, "visibility"}}},
        {"visibility", {{"visible", flag}}},
        {"instancing", {{"attributes", index_map, "accessors", 0, kRequired}}},
        {"light reference", {{"light", index, "lights", 0, kRequired}}},
        {"area reference", {{"light", index, kAreaLightList, 0, kRequired}}},
        {"profile reference",
         {{"light", index, kLightProfileList, 0, kRequired}, {"multiplier", number}, {"color", numbers, "", 3}}},
        {"sampler", {{"magFilter", natural}, {"minFilter", natural}, {"wrapS", natural}, {"wrapT", natural}}},
        {"scene", {{"name", text}, {"nodes", indices, "nodes"}, {"extensions", object, "scene extensions"}}},
        {"scene extensions", {{"EXT_lights_image_based", object, "image light reference"}}},
        {"image light reference", {{"light", index, kImageLightList, 0, kRequired}}},
        {"skin",
         {{"inverseBindMatrices", index, "accessors"},
          {"joints", indices, "nodes", 0, kRequired},
          {"name", text},
          {"skeleton", index, "nodes"}}},
        {"texture",
         {{"extensions", object, "texture source extensions"},
          {"sampler", index, "samplers"},
          {"source", index, "images"}}},
        {"texture source extensions",
         {{"EXT_texture_webp", object, "texture source"}, {"KHR_texture_basisu", object, "texture source"}}},
        {"texture source", {{"source", index, "images"}}},
    };
    // Textures come first, since their rule covers the whole textureInfo, including the scale of a normal map.
    for (const bool textures : {true, false})
        for (const GltfMaterialKey& key : gltf_material_keys())
            if ((key.kind == GltfMaterialKey::Kind::texture) == textures)
                add_key(rules, "material", key.path, rule_of(key));
    for (const LightProperty& property : light_properties())
        if (property.path) add_key(rules, "light", property.path, {"", number});
    return rules;
}

}  // namespace

const GltfRules& gltf_rules() {
    static const GltfRules rules = make_rules();
    return rules;
}

const std::map<std::string, std::string, std::less<>>& gltf_stubs() {
    static const std::map<std::string, std::string, std::less<>> stubs{
        {"accessor", R"({"componentType": 5126, "count": 1, "type": "SCALAR"})"},
        {"buffer", R"({"byteLength": 1})"},
        {"buffer view", R"({"buffer": 0, "byteLength": 1})"},
        {"camera", R"({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 1.0}})"},
        {"image", "{}"},
        {"light", R"({"type": "point"})"},
        {"light.spot", "{}"},
        {"material", "{}"},
        {"mesh", R"({"primitives": []})"},
        {"node", "{}"},
        {"sampler", "{}"},
        {"scene", "{}"},
        {"skin", R"({"joints": []})"},
        {"texture", "{}"},
    };
    return stubs;
}

const char* gltf_extension_without_effect(const std::string& name) {
    static const std::map<std::string, const char*, std::less<>> reasons{
        {"KHR_interactivity", "a picture shows the file before any event"},
        {"KHR_node_hoverability", "nothing hovers over a picture"},
        {"KHR_node_selectability", "nothing is selected in a picture"},
        {"KHR_xmp_json_ld", "metadata change no picture"},
    };
    const auto found = reasons.find(name);
    return found == reasons.end() ? nullptr : found->second;
}

const std::set<std::string>& gltf_extensions() {
    static const std::set<std::string> names = [] {
        // EXT_mesh_primitive_restart joins primitives of the file that are drawn one by one to the same picture.
        std::set<std::string> all{"EXT_mesh_primitive_restart", "KHR_mesh_primitive_restart", "KHR_mesh_quantization"};
        for (const auto& [type, rules] : gltf_rules())
            if (type.ends_with("extensions"))
                for (const GltfRule& rule : rules) all.insert(rule.key);
        return all;
    }();
    return names;
}

}  // namespace halflight
