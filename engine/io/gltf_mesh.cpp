#include "engine/io/gltf_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/scene/geometry.h"
#include "engine/scene/tangents.h"

namespace halflight {

struct GltfMeshes::Source {
    const tinygltf::Primitive& primitive;
    std::string element;
    const GltfMaterial* material;  // null: the default
    std::size_t first = 0;         // the vertices that triangles use
    std::size_t count = 0;

    /// The accessor of an attribute, or kNone.
    int attribute(const std::string& name) const {
        const auto found = primitive.attributes.find(name);
        return found == primitive.attributes.end() ? kNone : found->second;
    }
    /// The texture that tangents are for; null where none needs them.
    const TextureRef* normal_map() const {
        if (!material) return nullptr;
        if (material->material.normal_texture) return &material->material.normal_texture;
        if (material->material.clearcoat_normal_texture) return &material->material.clearcoat_normal_texture;
        return nullptr;
    }
};

namespace {

/// glTF 2.0, section 3.7.2.1: what consecutive indices mean.
std::vector<uvec3> make_triangles(const std::vector<std::uint32_t>& v, int mode) {
    std::vector<uvec3> triangles;
    if (v.size() < 3) return triangles;
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        triangles.reserve(v.size() / 3);
        for (std::size_t i = 0; i + 2 < v.size(); i += 3) triangles.emplace_back(v[i], v[i + 1], v[i + 2]);
        return triangles;
    }
    triangles.reserve(v.size() - 2);
    for (std::size_t i = 0; i + 2 < v.size(); ++i) {
        if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
            triangles.emplace_back(v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]);
        else
            triangles.emplace_back(v[i + 1], v[i + 2], v[0]);
    }
    return triangles;
}

/// Makes given tangents unit; false where one of them cannot be used.
bool normalize_tangents(std::vector<vec4>& tangents) {
    for (vec4& t : tangents) {
        const vec3 direction(t);
        if (!all_finite(direction) || direction == vec3(0) || std::abs(t.w) != 1) return false;
        t = vec4(glm::normalize(dvec3(direction)), t.w);
    }
    return true;
}

/// Transpose of the adjugate: takes normals where `m` takes positions, also where `m` cannot be inverted.
dmat3 cofactors(const dmat3& m) {
    return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
}

}  // namespace

Mesh GltfMeshes::convert(std::size_t index, std::span<const double> weights, const GltfPose& pose) {
    const tinygltf::Mesh& from = document_.model.meshes[index];
    used_default_material_ = false;
    Mesh mesh;
    mesh.name = from.name.empty() ? fmt::format("mesh{}", index) : from.name;
    for (std::size_t i = 0; i < from.primitives.size(); ++i) {
        const tinygltf::Primitive& primitive = from.primitives[i];
        Source source{primitive, fmt::format("meshes[{}].primitives[{}]", index, i), nullptr};
        if (primitive.material != kNone) source.material = &materials_[static_cast<std::size_t>(primitive.material)];
        if (primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN)
            document_.fail(source.element, "mode {} is unknown", primitive.mode);
        if (primitive.mode == TINYGLTF_MODE_POINTS)
            ++report_.point_primitives_skipped;
        else if (primitive.mode < TINYGLTF_MODE_TRIANGLES)
            ++report_.line_primitives_skipped;
        else if (source.attribute("POSITION") == kNone)
            document_.warnings.add("has no POSITION, it is left out", source.element);
        else
            add_primitive(mesh, source, weights, pose);
    }
    return mesh;
}

void GltfMeshes::add_primitive(Mesh& mesh, Source source, std::span<const double> weights, const GltfPose& pose) {
    Mesh part;
    part.name = source.element;
    part.triangles = read_triangles(source);
    if (part.triangles.empty()) return;
    if (!source.material) used_default_material_ = true;
    const std::size_t material =
        source.material ? static_cast<std::size_t>(source.primitive.material) : materials_.size();
    part.triangle_material.assign(part.triangles.size(), static_cast<std::uint32_t>(material));
    read_attributes(part, source);
    morph(part, source, weights);
    apply_pose(part, source, pose);
    finish(part, source);
    if (mesh.triangles.empty()) {
        part.name = mesh.name;
        mesh = std::move(part);  // large meshes mostly have one primitive: spare them the copy
    } else {
        append(mesh, part);
    }
}

std::vector<uvec3> GltfMeshes::read_triangles(Source& source) {
    const std::size_t vertices = accessors_.count(source.attribute("POSITION"));
    const int accessor = source.primitive.indices;
    std::vector<std::uint32_t> indices;
    if (accessor != kNone) {
        indices = accessors_.read_integers(accessor, 1, 0, accessors_.count(accessor), "indices");
    } else {
        if (vertices > std::numeric_limits<std::uint32_t>::max())
            document_.fail(source.element, "{} vertices are more than 2^32 - 1", vertices);
        accessors_.check_data(source.attribute("POSITION"));
        indices.resize(vertices);
        std::iota(indices.begin(), indices.end(), 0u);
    }
    if (indices.empty()) return {};
    const auto [lowest, highest] = std::ranges::minmax_element(indices);
    if (*highest >= vertices)
        document_.fail(source.element, "index {} at place {} of accessors[{}], but there are {} vertices", *highest,
                       highest - indices.begin(), accessor, vertices);
    source.first = *lowest;
    source.count = *highest - source.first + 1;
    for (std::uint32_t& index : indices) index -= static_cast<std::uint32_t>(source.first);
    if (source.primitive.mode == TINYGLTF_MODE_TRIANGLES && indices.size() % 3 != 0)
        document_.warnings.add("number of indices is not a multiple of 3, the last ones are left out", source.element);
    return make_triangles(indices, source.primitive.mode);
}

void GltfMeshes::check_count(const Source& source, int accessor, std::string_view attribute) const {
    const std::size_t vertices = accessors_.count(source.attribute("POSITION"));
    if (accessors_.count(accessor) != vertices)
        document_.fail(source.element, "{} has {} elements for {} vertices", attribute, accessors_.count(accessor),
                       vertices);
}

template <class V>
std::vector<V> GltfMeshes::read(const Source& source, const std::string& attribute, bool normalize) const {
    const int accessor = source.attribute(attribute);
    if (accessor == kNone) return {};
    check_count(source, accessor, attribute);
    return accessors_.read<V>(accessor, source.first, source.count, attribute, normalize);
}

void GltfMeshes::read_attributes(Mesh& part, const Source& source) {
    part.positions = read<vec3>(source, "POSITION");
    part.normals = read<vec3>(source, "NORMAL");
    if (source.normal_map() && !part.normals.empty()) part.tangents = read<vec4>(source, "TANGENT");

    const std::array<int, 2> sets = source.material ? source.material->uv_sets : std::array{0, 1};
    for (std::size_t set = 0; set < 2; ++set) {
        part.uvs[set] = read<vec2>(source, fmt::format("TEXCOORD_{}", sets[set]));
        bool mended = false;
        for (vec2& uv : part.uvs[set]) {
            if (all_finite(vec3(uv, 0))) continue;
            uv = vec2(0);
            mended = true;
        }
        if (mended) document_.warnings.add("texture coordinates are not finite, taken as 0", source.element);
    }
    if (source.material) {
        for_each_texture(source.material->material, [&](const TextureRef& t) {
            if (t && part.uvs[static_cast<std::size_t>(t.uv_set)].empty())
                document_.warnings.add(fmt::format("has no TEXCOORD_{}, which its material's textures need",
                                                   sets[static_cast<std::size_t>(t.uv_set)]),
                                       source.element);
        });
    }

    const int color = source.attribute("COLOR_0");
    if (color == kNone) return;
    if (accessors_.components(color) == 3) {
        for (const vec3& c : read<vec3>(source, "COLOR_0", true)) part.colors.emplace_back(c, 1);
    } else {
        part.colors = read<vec4>(source, "COLOR_0", true);
    }
    bool mended = false;
    for (vec4& c : part.colors) {
        // NaN is not equal to itself and comes out as 1.
        const vec4 clamped = glm::mix(vec4(1), glm::clamp(c, 0.0f, 1.0f), glm::equal(c, c));
        mended = mended || clamped != c;
        c = clamped;
    }
    if (mended) document_.warnings.add("vertex colours are outside [0, 1], clamped", source.element);
}

void GltfMeshes::morph(Mesh& part, const Source& source, std::span<const double> weights) {
    const auto& targets = source.primitive.targets;
    if (!targets.empty() && !weights.empty() && weights.size() != targets.size())
        document_.warnings.add(fmt::format("{} weights for {} morph targets", weights.size(), targets.size()),
                               source.element);
    const auto add = [&](auto& values, const std::map<std::string, int>& target, const char* attribute, float weight) {
        const auto found = target.find(attribute);
        if (found == target.end() || values.empty()) return;
        check_count(source, found->second, attribute);
        const auto deltas = accessors_.read<vec3>(found->second, source.first, source.count, attribute);
        for (std::size_t i = 0; i < deltas.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis) values[i][axis] += weight * deltas[i][axis];
        }
    };
    for (std::size_t i = 0; i < std::min(targets.size(), weights.size()); ++i) {
        const auto weight = static_cast<float>(weights[i]);
        if (weight == 0) continue;
        for (const auto& [attribute, accessor] : targets[i]) {
            if (attribute != "POSITION" && attribute != "NORMAL" && attribute != "TANGENT")
                document_.warnings.add(fmt::format("morphing of {} is not supported", attribute), source.element);
        }
        add(part.positions, targets[i], "POSITION", weight);
        add(part.normals, targets[i], "NORMAL", weight);
        add(part.tangents, targets[i], "TANGENT", weight);
    }
}

void GltfMeshes::apply_pose(Mesh& part, const Source& source, const GltfPose& pose) {
    if (pose.joints.empty()) return;
    struct Influences {
        std::vector<std::uint32_t> joints;  // four per vertex
        std::vector<vec4> weights;
    };
    std::vector<Influences> sets;
    while (pose.skin) {
        const std::string joints = fmt::format("JOINTS_{}", sets.size()),
                          weights = fmt::format("WEIGHTS_{}", sets.size());
        const int accessor = source.attribute(joints);
        if (accessor == kNone || source.attribute(weights) == kNone) break;
        check_count(source, accessor, joints);
        sets.push_back({accessors_.read_integers(accessor, 4, source.first, source.count, joints),
                        read<vec4>(source, weights, true)});
        const std::uint32_t highest = *std::ranges::max_element(sets.back().joints);
        if (highest >= pose.joints.size())
            document_.fail(source.element, "{} refers to joint {} of {}", joints, highest, pose.joints.size());
    }
    if (pose.skin && sets.empty()) document_.fail(source.element, "is skinned, but has no JOINTS_0 and WEIGHTS_0");

    // Linear blend skinning (glTF 2.0, section 3.7.3.3); weights are brought to a sum of one.
    const auto blend = [&](std::size_t vertex) {
        dmat4 sum(0);
        double total = 0;
        for (const Influences& set : sets) {
            for (int i = 0; i < 4; ++i) {
                const double weight = set.weights[vertex][i];
                if (!(weight > 0 && std::isfinite(weight))) continue;
                sum += weight * pose.joints[set.joints[4 * vertex + static_cast<std::size_t>(i)]];
                total += weight;
            }
        }
        if (total > 0) return sum / total;
        return pose.joints[sets.empty() ? 0 : sets[0].joints[4 * vertex]];
    };
    for (std::size_t i = 0; i < part.positions.size(); ++i) {
        const dmat4 m = blend(i);
        const dmat3 linear(m);
        const double side = glm::determinant(linear) < 0 ? -1 : 1;
        part.positions[i] = vec3(m * dvec4(part.positions[i], 1));
        if (!part.normals.empty()) part.normals[i] = vec3(side * (cofactors(linear) * dvec3(part.normals[i])));
        if (!part.tangents.empty())
            part.tangents[i] = vec4(linear * dvec3(part.tangents[i]), float(side) * part.tangents[i].w);
    }
}

void GltfMeshes::finish(Mesh& part, const Source& source) {
    const DroppedTriangles dropped = drop_bad_triangles(part);
    report_.non_finite_triangles_dropped += dropped.non_finite;
    report_.degenerate_triangles_dropped += dropped.degenerate;
    report_.normals_generated += part.normals.empty() ? generate_flat_normals(part) : repair_normals(part);

    const TextureRef* map = source.normal_map();
    if (!map || part.triangles.empty() || (!part.tangents.empty() && normalize_tangents(part.tangents))) return;
    if (!part.tangents.empty()) document_.warnings.add("has unusable tangents, new ones are made", source.element);
    part.tangents.clear();
    std::vector<vec2> uv = part.uvs[static_cast<std::size_t>(map->uv_set)];
    if (uv.empty()) return;
    for (vec2& x : uv) x = map->uv_transform * vec3(x, 1);
    generate_tangents(part, uv);
    report_.tangents_generated += part.tangents.size();
}

}  // namespace halflight
