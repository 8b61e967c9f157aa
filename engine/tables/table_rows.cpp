#include "engine/tables/table_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/scene/image_tiles.h"
#include "engine/scene/material_lobes.h"
#include "engine/tables/tables.h"
#include "shaders/shared/bvh_nodes.h"
#include "shaders/shared/vertex.h"

namespace halflight {
namespace {

/// Position of an instance, and its number of triangles over its size.
struct Place {
    dvec3 centre;
    double weight;
};

/// Returns the sum that the median minimises.
double remoteness(const std::vector<Place>& places, const dvec3& origin) {
    double sum = 0;
    for (const Place& place : places) {
        const dvec3 d = glm::abs(place.centre - origin);
        sum += place.weight * (d.x + d.y + d.z);
    }
    return sum;
}

/// Returns the lowest alpha that a material can have, given the lowest vertex alpha.
float lowest_alpha(const Material& material, const std::vector<float>& image_alpha, float vertex_alpha) {
    const TextureRef& texture = material.base_color_texture;
    return material.base_color.a * vertex_alpha *
           (texture ? image_alpha[static_cast<std::size_t>(texture.image)] : 1.0f);
}

/// Divides a matrix by its largest coefficient.
dmat3 scaled(const dmat3& m) {
    double largest = 0;
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(m[column][row]));
    }
    return largest > 0 ? m / largest : m;
}

}  // namespace

MeshExtent extent_of(const Mesh& mesh) {
    MeshExtent extent;
    for (const vec3& p : mesh.positions) extent.box.add(p);
    extent.triangles = mesh.triangles.size();
    return extent;
}

dvec3 choose_origin(std::span<const Instance> instances, std::span<const MeshExtent> meshes,
                    const std::optional<dvec3>& reference) {
    dvec3 origin(0);
    std::vector<Place> places;
    double sum = 0, triangles = 0;
    for (const Instance& instance : instances) {
        const MeshExtent& mesh = meshes[static_cast<std::size_t>(instance.mesh)];
        if (mesh.triangles == 0) continue;
        const dvec3 half = 0.5 * (dvec3(mesh.box.upper) - dvec3(mesh.box.lower));
        const dmat4& m = instance.object_to_world;
        const dvec3 extent =
            glm::abs(dvec3(m[0])) * half.x + glm::abs(dvec3(m[1])) * half.y + glm::abs(dvec3(m[2])) * half.z;
        const double size = glm::length(extent);
        if (size == 0) continue;  // flattened to a point, hence invisible
        const auto count = static_cast<double>(mesh.triangles);
        places.push_back({dvec3(m * dvec4(dvec3(mesh.box.lower) + half, 1)), count / size});
        sum += places.back().weight;
        triangles += count;
    }
    for (int axis = 0; axis < 3 && !places.empty(); ++axis) {
        std::ranges::sort(places, {}, [axis](const Place& place) { return place.centre[axis]; });
        double before = 0;
        const auto middle = std::ranges::find_if(places, [&](const Place& place) {
            before += place.weight;
            return 2 * before >= sum;
        });
        origin[axis] = (middle == places.end() ? places.back() : *middle).centre[axis];
    }
    const double allowed = std::max(kNearOrigin * triangles, 2 * remoteness(places, origin));
    return reference && remoteness(places, *reference) <= allowed ? *reference : origin;
}

TriangleWords::TriangleWords(const Scene& scene) : scene_(scene) {
    if (scene_.materials.size() >= kTriangleMaterialMask) throw Error(scene_.name, "more than 2^24 materials");
    image_alpha_.assign(scene_.images.size(), -1);
    for (const Material& material : scene_.materials) {
        if (material.alpha_mode == AlphaMode::opaque || !material.base_color_texture) continue;
        const auto index = static_cast<std::size_t>(material.base_color_texture.image);
        if (image_alpha_[index] >= 0) continue;
        const TextureImage& image = scene_.images[index];
        const std::vector<std::uint8_t> read = image.tiles ? all_texels(image) : std::vector<std::uint8_t>();
        const std::vector<std::uint8_t>& rgba = image.tiles ? read : image.rgba.get();
        std::uint32_t lowest = image.largest();
        for (std::size_t i = 0; i < rgba.size(); i += image.texel_bytes())
            lowest = std::min(lowest, image.code(&rgba[i], 3));
        image_alpha_[index] = static_cast<float>(lowest) / static_cast<float>(image.largest());
    }
}

float TriangleWords::lowest_vertex_alpha(const Mesh& mesh) {
    float alpha = 1;
    for (const vec4& color : mesh.colors) alpha = std::min(alpha, color.a);
    return alpha;
}

std::vector<std::uint32_t> TriangleWords::of(float vertex_alpha) const {
    std::vector<std::uint32_t> words(scene_.materials.size());
    for (std::uint32_t m = 0; m < words.size(); ++m) words[m] = of(m, vertex_alpha);
    return words;
}

std::uint32_t TriangleWords::of(std::uint32_t material, float vertex_alpha) const {
    const Material& m = scene_.materials[material];
    const std::uint32_t word = material | (is_one_sided(m) ? kTriangleOneSided : is_pane(m) ? kTrianglePane : 0u);
    if (m.alpha_mode == AlphaMode::opaque) return word;
    const float alpha = lowest_alpha(m, image_alpha_, vertex_alpha);
    const bool decides = m.alpha_mode == AlphaMode::mask ? alpha < m.alpha_cutoff : alpha < 1.0f;
    return word | (decides ? kTriangleAlpha : 0u);
}

bool mirrors(const Instance& instance) {
    return glm::determinant(dmat3(instance.object_to_world)) < 0;
}

std::uint64_t TriangleWords::alpha_tests() const {
    Hash hash;
    for (const float alpha : image_alpha_) hash.add(alpha);
    return hash.value();
}

void fail_beyond_reach(const Scene& scene, std::size_t instance) {
    const int node = scene.instances[instance].node;
    const std::string element = node == kNone ? fmt::format("instance {}", instance) : fmt::format("nodes[{}]", node);
    throw Error(scene.name, "{} reaches beyond 2^40 from the scene's centre", element);
}

void check_table_size(const Scene& scene, std::size_t vertices, std::size_t triangles) {
    if (triangles >= shared::kBvhTriangleLimit)
        throw Error(scene.name, "{} triangles; the limit is {}", triangles, shared::kBvhTriangleLimit);
    if (vertices > std::numeric_limits<std::uint32_t>::max()) throw Error(scene.name, "2^32 vertices or more");
}

void VertexAttributes::add(const Mesh& mesh) {
    colors = colors || std::any_of(mesh.colors.begin(), mesh.colors.end(), [](const vec4& c) { return c != vec4(1); });
    tangents = tangents || !mesh.tangents.empty();
}

bool looks_up(const Material& material, const MaterialTexture& texture, const VertexAttributes& attributes) {
    return material.*texture.field && texture.matters(material) &&
           (!needs_tangents(texture.use) || attributes.tangents);
}

bool has_lobe(const Material& material, const MaterialLobe& lobe, const VertexAttributes& attributes) {
    return lobe.present(material) && (!lobe.tangents || attributes.tangents);
}

SceneNeeds layout_needs(std::span<const Material> materials, const std::vector<bool>& used,
                        const VertexAttributes& attributes) {
    SceneNeeds needs;
    needs.vertex_colors = attributes.colors;
    for (std::size_t i = 0; i < materials.size(); ++i) {
        if (!used[i]) continue;
        for (const MaterialTexture& texture : material_textures())
            needs.*texture.need |= looks_up(materials[i], texture, attributes);
        for (const MaterialLobe& lobe : material_lobes()) needs.*lobe.need |= has_lobe(materials[i], lobe, attributes);
    }
    return united(needs, {});
}

VertexTransform::VertexTransform(const dmat4& object_to_world) {
    const dmat3 m = scaled(dmat3(object_to_world));
    // Cofactors are the inverse transpose times the determinant, and exist for singular matrices, too.
    const dmat3 cofactors(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1]));
    handedness = glm::determinant(m) < 0 ? -1.0f : 1.0f;
    normal = scaled(cofactors) * static_cast<double>(handedness);
    tangent = m;
}

void write_vertex_rows(const Mesh& mesh, const VertexTransform& transform, const SceneNeeds& needs, vec4* rows) {
    const auto stride = static_cast<std::size_t>(needs.vertex_stride());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i, rows += stride) {
        const vec2 uv0 = mesh.uvs[0].empty() ? vec2(0) : mesh.uvs[0][i];
        const vec2 uv1 = mesh.uvs[1].empty() ? vec2(0) : mesh.uvs[1][i];
        const vec4 tangent = mesh.tangents.empty() ? vec4(0) : mesh.tangents[i];
        rows[shared::kVertexNormalTexel] = vec4(vec3(transform.normal * dvec3(mesh.normals[i])), uv0.x);
        if (needs.texture_coordinates)
            rows[shared::kVertexUvTexel] = vec4(uv0.y, uv1, tangent.w * transform.handedness);
        if (needs.normal_maps) rows[shared::kVertexTangentTexel] = vec4(vec3(transform.tangent * dvec3(tangent)), 0);
        if (needs.vertex_colors) rows[stride - 1] = mesh.colors.empty() ? vec4(1) : mesh.colors[i];
    }
}

}  // namespace halflight
