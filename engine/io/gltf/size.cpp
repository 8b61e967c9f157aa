#include "engine/io/gltf/size.h"

#include <algorithm>
#include <map>
#include <set>
#include <thread>
#include <tuple>
#include <utility>

#include "engine/io/gltf/accessor.h"
#include "engine/io/gltf/instances.h"
#include "engine/io/gltf/material.h"
#include "engine/io/gltf/nodes.h"
#include "engine/io/gltf/value.h"

namespace halflight {
namespace {

struct MeshSize {
    std::size_t bytes = 0;
    std::size_t triangles = 0;
};

/// Returns the number of elements of an accessor, all of which the file holds.
std::size_t count(const GltfAccessors& accessors, int accessor) {
    accessors.check_data(accessor);
    return accessors.count(accessor);
}

MeshSize measure(const GltfDocument& document, const tinygltf::Mesh& mesh, const std::vector<GltfMaterial>& materials) {
    const GltfAccessors accessors(document);
    MeshSize size;
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
        const auto position = primitive.attributes.find("POSITION");
        if (primitive.mode < TINYGLTF_MODE_TRIANGLES || position == primitive.attributes.end()) continue;
        const auto has = [&](const char* name) { return primitive.attributes.contains(name); };
        std::size_t vertices = count(accessors, position->second);
        const std::size_t corners = primitive.indices == kNone ? vertices : count(accessors, primitive.indices);
        const std::size_t triangles =
            primitive.mode == TINYGLTF_MODE_TRIANGLES ? corners / 3 : corners - std::min<std::size_t>(corners, 2);
        if (!has("NORMAL")) vertices = 3 * triangles;  // flat normals need corners of their own
        const Material* material =
            primitive.material == kNone ? nullptr : &materials[static_cast<std::size_t>(primitive.material)].material;
        std::size_t each = 2 * sizeof(vec3);
        if (material && material->normal_texture) each += sizeof(vec4);
        if (has("COLOR_0")) each += sizeof(vec4);
        each += sizeof(vec2) * (has("TEXCOORD_0") + has("TEXCOORD_1"));
        size.bytes += vertices * each + triangles * (sizeof(uvec3) + sizeof(std::uint32_t));
        size.triangles += triangles;
    }
    return size;
}

}  // namespace

SceneSize measure_gltf(GltfDocument& document) {
    SceneSize size;
    // Loading adds warnings and files.
    const auto before = std::tuple(document.warnings, document.files, document.bytes_of_files);
    const std::vector<GltfMaterial> materials = convert_materials(document);
    const GltfNodes nodes = resolve_nodes(document);
    std::map<int, MeshSize> sizes;
    std::set<std::tuple<int, int, std::vector<double>>> stored;
    for (const int index : nodes.shown) {
        const tinygltf::Node& node = document.model.nodes[static_cast<std::size_t>(index)];
        if (node.mesh == kNone) continue;
        const auto [known, is_new] = sizes.try_emplace(node.mesh);
        MeshSize& mesh = known->second;
        if (is_new) mesh = measure(document, document.model.meshes[static_cast<std::size_t>(node.mesh)], materials);
        const tinygltf::Value* extension = find_extension(node.extensions, "EXT_mesh_gpu_instancing");
        const std::size_t instances =
            extension ? count_instances(document, *extension, fmt::format("nodes[{}]", index)) : 1;
        size.drawn += mesh.triangles * instances;
        size.instance_bytes += instances * sizeof(Instance);
        // A mesh is stored once per skin and weights.
        if (!stored.emplace(node.mesh, node.skin, node.weights).second) continue;
        size.stored += mesh.triangles;
        size.geometry_bytes += mesh.bytes;
    }
    const ImageSizes images = measure_images(document, materials);
    size.texture_bytes = images.texels;
    size.decoding_bytes = images.largest_decoder * std::max(1u, std::thread::hardware_concurrency());
    std::tie(document.warnings, document.files, document.bytes_of_files) = before;
    return size;
}

}  // namespace halflight
