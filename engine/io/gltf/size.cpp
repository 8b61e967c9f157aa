#include "engine/io/gltf/size.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>
#include <thread>
#include <tuple>
#include <utility>

#include "engine/io/gltf/accessor.h"
#include "engine/io/gltf/draco.h"
#include "engine/io/gltf/instances.h"
#include "engine/io/gltf/material.h"
#include "engine/io/gltf/nodes.h"
#include "engine/io/gltf/primitive.h"
#include "engine/io/gltf/strokes.h"
#include "engine/scene/scene.h"

namespace halflight {
namespace {

struct MeshSize {
    std::size_t bytes = 0;
    std::size_t triangles = 0;
    std::size_t vertices = 0;
    std::size_t decoding_bytes = 0;  // working memory of the decoder, largest of the primitives
    bool tangents = false, coordinates = false, colors = false;  // some vertices have such attributes
};

/// Returns the number of elements of an accessor, all of which the file holds.
std::size_t count(const GltfAccessors& accessors, int accessor) {
    accessors.check_data(accessor);
    return accessors.count(accessor);
}

/// Returns the numbers of vertices and triangles of a primitive with positions.
GltfPrimitiveSize measure(const GltfDocument& document, const tinygltf::Primitive& primitive,
                          const std::string& element) {
    if (const auto compressed = measure_draco(document, primitive, element)) return *compressed;
    const GltfAccessors accessors(document);
    GltfPrimitiveSize size;
    size.vertices = count(accessors, primitive.attributes.at("POSITION"));
    const std::size_t corners = primitive.indices == kNone ? size.vertices : count(accessors, primitive.indices);
    if (is_stroke(primitive.mode)) {
        constexpr std::size_t kMost = std::size_t{1} << 40;  // products stay in range; no budget allows as many
        const StrokeSize strokes = measure_strokes(primitive.mode, std::min(corners, kMost));
        return {strokes.vertices, strokes.triangles, corners * sizeof(std::uint32_t) + size.vertices * sizeof(vec3)};
    }
    size.triangles =
        primitive.mode == TINYGLTF_MODE_TRIANGLES ? corners / 3 : corners - std::min<std::size_t>(corners, 2);
    return size;
}

MeshSize measure(const GltfDocument& document, int index, const std::vector<GltfMaterial>& materials) {
    const tinygltf::Mesh& mesh = document.model.meshes[static_cast<std::size_t>(index)];
    MeshSize size;
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i) {
        const tinygltf::Primitive& primitive = mesh.primitives[i];
        const auto has = [&](const std::string& name) {
            return primitive.attributes.contains(name) && has_elements(document, primitive, name);
        };
        const bool stroke = is_stroke(primitive.mode);
        if ((stroke && document.stroke_radii.empty()) || !has("POSITION")) continue;
        auto [vertices, triangles, decoding_bytes] =
            measure(document, primitive, fmt::format("meshes[{}].primitives[{}]", index, i));
        size.decoding_bytes = std::max(size.decoding_bytes, decoding_bytes);
        if (!stroke && !has("NORMAL")) vertices = 3 * triangles;  // flat normals need corners of their own
        const GltfMaterial* material =
            primitive.material == kNone ? nullptr : &materials[static_cast<std::size_t>(primitive.material)];
        std::size_t each = 2 * sizeof(vec3);
        if (stroke) each += sizeof(vec3) + sizeof(std::uint32_t);  // Strokes, until the mesh is finished
        const bool tangents = tangent_texture_of(material).has_value(), colors = has("COLOR_0");
        if (tangents) each += sizeof(vec4);
        if (colors) each += sizeof(vec4);
        for (const int set : material ? material->uv_sets : std::array{0, 1}) {
            if (!has(fmt::format("TEXCOORD_{}", set))) continue;
            each += sizeof(vec2);
            size.coordinates = true;
        }
        size.tangents |= tangents, size.colors |= colors;
        size.bytes += vertices * each + triangles * (sizeof(uvec3) + sizeof(std::uint32_t));
        size.triangles += triangles;
        size.vertices += vertices;
    }
    return size;
}

/// Returns how many instances of a node get a mesh of their own. `instancing` may be null.
std::size_t count_flat(const GltfDocument& document, const GltfNodes& nodes, int node,
                       const tinygltf::Value* instancing, std::size_t instances) {
    // Joints alone place a skinned mesh.
    if (document.model.nodes[static_cast<std::size_t>(node)].skin != kNone) return 0;
    const dmat4& world = nodes.world[static_cast<std::size_t>(node)];
    if (!instancing) return shape_of(world) == GltfShape::flat;
    constexpr std::size_t kAtOnce = std::size_t{1} << 17;  // transforms that are read at a time: 22 MiB
    std::size_t flat = 0;
    for (std::size_t first = 0; first < instances; first += kAtOnce)
        for (const Joint& local : instance_transforms(document, *instancing, fmt::format("nodes[{}]", node), first,
                                                      std::min(kAtOnce, instances - first)))
            flat += shape_of(world * local.matrix) == GltfShape::flat;
    return flat;
}

/// Returns sum + count * each, or a size that no budget allows if that is too large.
std::size_t plus(std::size_t sum, std::size_t count, std::size_t each) {
    constexpr std::size_t kMost = std::size_t{1} << 60;
    return count != 0 && each > kMost / count ? kMost : std::min(sum + count * each, kMost);
}

/// Returns the compressed buffer views to which accessors, images and Draco data refer.
std::set<int> compressed_views_in_use(const GltfDocument& document) {
    if (document.compressed_views.empty()) return {};
    std::set<int> views;
    for (int i = 0; i < static_cast<int>(document.model.accessors.size()); ++i)
        views.merge(views_of(document.model, i));
    for (const GltfImageSource& image : document.images) views.insert(image.buffer_view);
    for (const tinygltf::Mesh& mesh : document.model.meshes)
        for (const tinygltf::Primitive& primitive : mesh.primitives)
            if (const tinygltf::Value* draco = find_extension(primitive.extensions, "KHR_draco_mesh_compression"))
                views.insert(draco->Get("bufferView").GetNumberAsInt());
    std::erase_if(views, [&](int view) { return !document.compressed_views.contains(view); });
    return views;
}

}  // namespace

SceneSize measure_gltf(GltfDocument& document, const GltfAnimatedObjects* moving) {
    SceneSize size;
    // The functions below add to these lists, which are restored at the end. Loading fills them again.
    const auto before = std::tuple(document.warnings, document.files, document.bytes_of_files);
    std::set<int> decoded;
    for (const auto& [view, bytes] : document.decoded->views) decoded.insert(view);
    const std::vector<GltfMaterial> materials = convert_materials(document);
    const GltfNodes nodes = resolve_nodes(document);
    std::map<int, MeshSize> sizes;
    std::set<std::tuple<int, int, std::vector<double>>> stored;
    std::size_t vertices = 0;  // number in `stored`, and in meshes of a transform of their own
    for (const int index : nodes.shown) {
        const tinygltf::Node& node = document.model.nodes[static_cast<std::size_t>(index)];
        if (node.mesh == kNone) continue;
        const auto [known, is_new] = sizes.try_emplace(node.mesh);
        MeshSize& mesh = known->second;
        if (is_new) mesh = measure(document, node.mesh, materials);
        const tinygltf::Value* extension = find_extension(node.extensions, "EXT_mesh_gpu_instancing");
        const std::size_t instances =
            extension ? count_instances(document, *extension, fmt::format("nodes[{}]", index)) : 1;
        // Each instance has the name of its node, or else of its mesh.
        const std::string& name =
            node.name.empty() ? document.model.meshes[static_cast<std::size_t>(node.mesh)].name : node.name;
        size.instance_bytes += instances * (sizeof(Instance) + name.size());
        if (moving && !moving->move_surface(document.model, index)) continue;
        size.drawn += mesh.triangles * instances;
        if (const std::size_t flat = count_flat(document, nodes, index, extension, instances)) {
            const tinygltf::Mesh& from = document.model.meshes[static_cast<std::size_t>(node.mesh)];
            // The mesh itself, and what its request keeps: its key with weights, and its transform.
            const std::size_t others = sizeof(Mesh) + from.name.size() + sizeof(GltfMeshKey) + sizeof(Joint) +
                                       sizeof(double) * std::max(node.weights.size(), from.weights.size());
            size.instance_bytes = plus(size.instance_bytes, flat, others);
            size.stored = plus(size.stored, flat, mesh.triangles);
            size.geometry_bytes = plus(size.geometry_bytes, flat, mesh.bytes);
            vertices = plus(vertices, flat, mesh.vertices);
            size.largest_mesh = std::max(size.largest_mesh, mesh.bytes);
            if (flat == instances) continue;
        }
        // Instances with other transforms share a mesh, which is stored once per skin and weights.
        if (!stored.emplace(node.mesh, node.skin, node.weights).second) continue;
        size.stored += mesh.triangles;
        size.geometry_bytes += mesh.bytes;
        size.largest_mesh = std::max(size.largest_mesh, mesh.bytes);
        vertices = plus(vertices, 1, mesh.vertices);
    }
    const ImageSizes images = measure_images(document, materials);
    const auto any = [&](bool MeshSize::*attribute) {
        return std::ranges::any_of(sizes, [&](const auto& mesh) { return mesh.second.*attribute; });
    };
    const bool textures = images.texels > 0 && any(&MeshSize::coordinates);
    size.vertex_texels =
        plus(0, vertices, std::size_t{1} + textures + any(&MeshSize::tangents) + any(&MeshSize::colors));
    size.texture_bytes = images.texels;
    size.deep_bytes = images.deep;
    size.pinned_bytes = images.pinned;
    size.largest_image = images.largest;
    size.decoding_bytes = images.largest_decoder * std::max(1u, std::thread::hardware_concurrency());
    for (const auto& [index, mesh] : sizes) size.decoding_bytes = std::max(size.decoding_bytes, mesh.decoding_bytes);
    for (const int view : compressed_views_in_use(document)) {
        // Views that are too short are refused where they are read. The sum leaves room for the scene's contents.
        constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max() / 2;
        try {
            size.decoding_bytes = std::min(size.decoding_bytes + document.view_size(view), kMost);
        } catch (const Error&) {
        }
    }
    // Transforms of instances may have needed compressed views.
    std::erase_if(document.decoded->views, [&](const auto& view) { return !decoded.contains(view.first); });
    std::tie(document.warnings, document.files, document.bytes_of_files) = before;
    return size;
}

}  // namespace halflight
