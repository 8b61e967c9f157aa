#include "engine/io/gltf/mesh.h"

#include <cmath>
#include <utility>

#include "engine/scene/geometry.h"
#include "engine/scene/tangents.h"

namespace halflight {
namespace {

/// Normalises given tangents. Returns false if one of them cannot be used.
bool normalize_tangents(std::vector<vec4>& tangents) {
    for (vec4& t : tangents) {
        const vec3 direction(t);
        if (!all_finite(direction) || direction == vec3(0) || std::abs(t.w) != 1) return false;
        t = vec4(glm::normalize(dvec3(direction)), t.w);
    }
    return true;
}

/// Returns the coordinates that tangents follow. `others` are those of GltfPrimitive::tangent_uvs.
const std::vector<vec2>& tangent_uvs(const Mesh& part, const std::vector<vec2>& others, const TextureRef& map) {
    return map.uv_set == kTangentUvs ? others : part.uvs[static_cast<std::size_t>(map.uv_set)];
}

}  // namespace

std::string GltfMeshes::name(std::size_t index) const {
    const std::string& name = document_.model.meshes[index].name;
    return name.empty() ? fmt::format("mesh{}", index) : name;
}

GltfUnposedMesh GltfMeshes::open(std::size_t index, std::span<const double> weights, const GltfPose& pose,
                                 GltfPrimitives* kept) {
    const tinygltf::Mesh& from = document_.model.meshes[index];
    GltfUnposedMesh mesh;
    mesh.name = name(index);
    for (std::size_t i = 0; i < from.primitives.size(); ++i) {
        const tinygltf::Primitive& primitive = from.primitives[i];
        const std::string element = fmt::format("meshes[{}].primitives[{}]", index, i);
        if (primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN) document_.fail(element, "mode {} is unknown", primitive.mode);
        const bool points = primitive.mode == TINYGLTF_MODE_POINTS;
        const bool stroke = is_stroke(primitive.mode);
        if (stroke && document_.stroke_radii.empty()) {
            ++(points ? report_.point_primitives_skipped : report_.line_primitives_skipped);
            continue;
        }
        if (!primitive.attributes.contains("POSITION")) {
            document_.warnings.add("has no POSITION, it is left out", element);
            continue;
        }
        const bool has_material = primitive.material != kNone;
        const std::size_t place = has_material ? static_cast<std::size_t>(primitive.material) : materials_.size();
        const GltfMaterial* material = has_material ? &materials_[place] : nullptr;
        const auto read = [&] {
            return std::make_shared<GltfPrimitive>(document_, primitive, element, material,
                                                   static_cast<std::uint32_t>(place), pose.skin,
                                                   stroke ? document_.stroke_radii[index] : 0);
        };
        std::shared_ptr<const GltfPrimitive> source;
        Mesh still;
        std::vector<vec2> tangent_uvs;
        if (kept) {
            auto& known = (*kept)[{index, i, pose.skin}];
            if (!known) known = read();
            source = known;
            still = source->still, tangent_uvs = source->tangent_uvs;
        } else {
            const std::shared_ptr<GltfPrimitive> alone = read();
            // Large meshes are mostly read once. Moving saves a copy.
            still = std::move(alone->still), tangent_uvs = std::move(alone->tangent_uvs);
            source = alone;
        }
        document_.warnings.add(source->warnings());
        (points ? report_.points_drawn : report_.line_segments_drawn) += source->strokes();
        if (still.triangles.empty()) continue;
        source->check_joints(pose.joints.size(), document_.warnings);
        mesh.uses_default_material |= !material;
        Deformation deformation{source, source->active_targets(weights, document_.warnings), pose.joints};
        mesh.parts.push_back({std::move(still), std::move(tangent_uvs), std::move(deformation), material});
    }
    return mesh;
}

Mesh GltfMeshes::finish(GltfUnposedMesh from, std::span<VertexArrays> moved) {
    Mesh mesh;
    mesh.name = from.name;
    std::size_t most_vertices = 0, most_triangles = 0;  // parts without normals may get more vertices
    for (const GltfUnposedMesh::Part& part : from.parts) {
        most_vertices += part.deformation.rest->vertices();
        most_triangles += part.still.triangles.size();
    }
    for (std::size_t i = 0; i < from.parts.size(); ++i) {
        GltfUnposedMesh::Part& part = from.parts[i];
        VertexArrays vertices = moved.empty() ? deform(part.deformation) : std::move(moved[i]);
        part.still.positions = std::move(vertices.positions);
        part.still.normals = std::move(vertices.normals);
        part.still.tangents = std::move(vertices.tangents);
        const bool deforms = !part.deformation.targets.empty() || !part.deformation.joints.empty();
        finish(part.still, part.material, deforms, {sides_of(part.deformation), std::move(part.tangent_uvs)});
        if (mesh.triangles.empty()) {
            part.still.name = mesh.name;
            mesh = std::move(part.still);
            if (from.parts.size() > 1) reserve(mesh, most_vertices, most_triangles);
        } else {
            append(mesh, part.still);
        }
        part.still = {};
    }
    return mesh;
}

Mesh GltfMeshes::all_parts(const GltfUnposedMesh& mesh) {
    Mesh all;
    for (const GltfUnposedMesh::Part& part : mesh.parts) {
        const Mesh& from = part.still;
        all.triangle_material.insert(all.triangle_material.end(), from.triangle_material.begin(),
                                     from.triangle_material.end());
        all.colors.insert(all.colors.end(), from.colors.begin(), from.colors.end());
        const std::optional<TextureRef> map = tangent_texture_of(part.material);
        if (map && !tangent_uvs(from, part.tangent_uvs, *map).empty()) all.tangents = {vec4(1, 0, 0, 1)};
    }
    return all;
}

void GltfMeshes::finish(Mesh& part, const GltfMaterial* material, bool deforms, VertexExtras extras) {
    const DroppedTriangles dropped = drop_bad_triangles(part, &extras);
    report_.non_finite_triangles_dropped += dropped.non_finite;
    if (dropped.non_finite > 0)
        document_.warnings.fault("has positions that are not finite, their triangles are left out", part.name);
    report_.degenerate_triangles_dropped += dropped.degenerate;
    report_.normals_generated +=
        part.normals.empty() ? generate_flat_normals(part, &extras) : repair_normals(part, extras.sides);
    std::vector<std::size_t> mirrored;  // triangles that the pose has turned inside out
    for (std::size_t i = 0; i < part.triangles.size() && !extras.sides.empty(); ++i) {
        const uvec3& t = part.triangles[i];
        if (extras.sides[t.x] + extras.sides[t.y] + extras.sides[t.z] < 0) mirrored.push_back(i);
    }
    add_tangents(part, material, deforms, extras);
    for (const std::size_t i : mirrored) std::swap(part.triangles[i].y, part.triangles[i].z);
}

void GltfMeshes::add_tangents(Mesh& part, const GltfMaterial* material, bool deforms, const VertexExtras& extras) {
    const std::optional<TextureRef> map = tangent_texture_of(material);
    if (!map || part.triangles.empty() || (!part.tangents.empty() && normalize_tangents(part.tangents))) return;
    if (!part.tangents.empty()) {
        constexpr const char* kInvalid = "has invalid tangents, they are recomputed";
        deforms ? document_.value_fault(kInvalid, part.name) : document_.warnings.fault(kInvalid, part.name);
    }
    part.tangents.clear();
    std::vector<vec2> uv = tangent_uvs(part, extras.uvs, *map);
    if (uv.empty()) {
        if (material->material.anisotropy_strength > 0)
            document_.warnings.add("has neither tangents nor texture coordinates, which its anisotropy needs",
                                   part.name);
        return;
    }
    for (vec2& x : uv) x = map->uv_transform * vec3(x, 1);
    generate_tangents(part, uv, extras.sides);
    report_.tangents_generated += part.tangents.size();
}

}  // namespace halflight
