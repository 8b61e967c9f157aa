#include "engine/io/gltf/model.h"

#include <algorithm>
#include <utility>

namespace halflight::gltf {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Accessor::Indices, bufferView, byteOffset, componentType)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Accessor::Values, bufferView, byteOffset)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Accessor::Sparse, count, indices, values)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Accessor, bufferView, byteOffset, componentType, count, normalized,
                                                sparse, type)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(BufferView, buffer, byteLength, byteOffset, byteStride)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Camera::Orthographic, xmag, ymag, zfar, znear)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Camera::Perspective, aspectRatio, yfov, zfar, znear)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Camera, name, type, orthographic, perspective)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Light::Spot, innerConeAngle, outerConeAngle)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Light, color, intensity, name, type, spot)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Primitive, attributes, extensions, indices, material, mode, targets)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Mesh, name, primitives, weights)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Node, camera, children, extensions, mesh, name, skin, matrix, rotation,
                                                scale, translation, weights)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Sampler, magFilter, wrapS, wrapT)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Scene, nodes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Skin, inverseBindMatrices, joints, name)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Texture, extensions, sampler, source)

namespace {

using Json = nlohmann::json;

/// Moves a list out of its parent, one object at a time.
template <class T>
void take(Json& parent, const char* key, std::vector<T>& list) {
    const auto found = parent.find(key);
    if (found == parent.end()) return;
    list.reserve(found->size());
    for (Json& from : *found) list.push_back(std::exchange(from, nullptr).get<T>());
    parent.erase(found);
}

}  // namespace

Model to_model(Json root) {
    Model model;
    take(root, "accessors", model.accessors);
    take(root, "bufferViews", model.bufferViews);
    take(root, "cameras", model.cameras);
    take(root, "meshes", model.meshes);
    take(root, "nodes", model.nodes);
    take(root, "samplers", model.samplers);
    take(root, "scenes", model.scenes);
    take(root, "skins", model.skins);
    take(root, "textures", model.textures);
    model.scene = root.value("scene", kNone);
    if (root.contains("extensions")) model.extensions = std::move(root["extensions"]);
    if (const auto lights = model.extensions.find("KHR_lights_punctual"); lights != model.extensions.end())
        take(*lights, "lights", model.lights);
    return model;
}

int component_count(std::string_view type) {
    static constexpr std::pair<std::string_view, int> kTypes[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                                  {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};
    const auto found = std::ranges::find(kTypes, type, &std::pair<std::string_view, int>::first);
    return found == std::end(kTypes) ? 0 : found->second;
}

}  // namespace halflight::gltf
