#include "engine/io/gltf/primitive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

namespace halflight {
namespace {

/// Converts consecutive indices to triangles by mode (glTF 2.0, section 3.7.2.1).
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

/// Returns the corners of the separate triangles or segments that strips, fans and lines draw. `restart` ends each of
/// them, and is no corner (KHR_mesh_primitive_restart).
std::vector<std::uint32_t> separate(const std::vector<std::uint32_t>& indices, int mode, std::uint32_t restart) {
    std::vector<std::uint32_t> corners;
    for (auto from = indices.begin(); from < indices.end();) {
        const auto to = std::find(from, indices.end(), restart);
        const std::vector<std::uint32_t> run(from, to);
        from = to == indices.end() ? to : to + 1;
        if (!is_stroke(mode)) {
            for (const uvec3& t : make_triangles(run, mode)) corners.insert(corners.end(), {t.x, t.y, t.z});
            continue;
        }
        for (std::size_t i = 0; i + 1 < run.size(); ++i) corners.insert(corners.end(), {run[i], run[i + 1]});
        if (mode == TINYGLTF_MODE_LINE_LOOP && run.size() > 2) corners.insert(corners.end(), {run.back(), run.front()});
    }
    return corners;
}

}  // namespace

std::optional<TextureRef> tangent_texture_of(const GltfMaterial* material) {
    if (!material) return {};
    for (const TextureUse use : {TextureUse::normal_map, TextureUse::direction})
        for (const MaterialTexture& texture : material_textures())
            if (texture.use == use && material->material.*texture.field) return material->material.*texture.field;
    if (!material->anisotropic) return {};
    const auto& sets = material->uv_sets;
    return TextureRef{.uv_set = sets[0] == 0 ? 0 : sets[1] == 0 ? 1 : kTangentUvs};
}

GltfPrimitive::GltfPrimitive(const GltfDocument& document, const tinygltf::Primitive& primitive, std::string element,
                             const GltfMaterial* material, std::uint32_t material_index, bool skinned, float radius)
    : document_(document),
      primitive_(primitive),
      element_(std::move(element)),
      draco_(decode_draco(document, primitive, element_)),
      accessors_(document, draco_ ? &draco_->accessors : nullptr),
      radius_(radius),
      has_normals_(attribute("NORMAL") != kNone && !is_stroke(primitive.mode)),
      has_tangents_(has_normals_ && tangent_texture_of(material) && attribute("TANGENT") != kNone) {
    still.name = element_;
    read_triangles();
    if (!still.triangles.empty()) {
        still.triangle_material.assign(still.triangles.size(), material_index);
        read_uvs(material);
        read_colors();
        if (skinned) find_joints();
    }
    if (draco_) free_decoded();
}

int GltfPrimitive::attribute(const std::string& name) const {
    if (draco_ && std::ranges::find(draco_->missing, name) != draco_->missing.end()) return kNone;
    const auto found = primitive_.attributes.find(name);
    return found == primitive_.attributes.end() ? kNone : found->second;
}

int GltfPrimitive::target_attribute(std::size_t target, const std::string& name) const {
    const auto found = primitive_.targets[target].find(name);
    return found == primitive_.targets[target].end() ? kNone : found->second;
}

void GltfPrimitive::check_count(int accessor, std::string_view name) const {
    const std::size_t vertices = accessors_.count(attribute("POSITION"));
    if (accessors_.count(accessor) != vertices)
        document_.fail(element_, "{} has {} elements for {} vertices", name, accessors_.count(accessor), vertices);
}

template <class V>
std::vector<V> GltfPrimitive::read_checked(int accessor, const std::string& name, bool normalize) const {
    if (accessor == kNone) return {};
    check_count(accessor, name);
    return around(accessors_.read<V>(accessor, first_, count_, name, normalize));
}

template <class V>
std::vector<V> GltfPrimitive::around(std::vector<V> values, std::size_t size) const {
    if (!strokes_ || values.empty()) return values;
    std::vector<V> all;
    all.reserve(strokes_->sources.size() * size);
    for (const std::size_t source : strokes_->sources)
        all.insert(all.end(), values.begin() + static_cast<std::ptrdiff_t>(source * size),
                   values.begin() + static_cast<std::ptrdiff_t>((source + 1) * size));
    return all;
}

void GltfPrimitive::read_triangles() {
    const std::size_t vertices = accessors_.count(attribute("POSITION"));
    const int accessor = primitive_.indices;
    int mode = draco_ ? TINYGLTF_MODE_TRIANGLES : primitive_.mode;
    std::vector<std::uint32_t> indices;
    if (draco_) {
        indices = std::move(draco_->indices);
        if (draco_->has_other_counts)
            warnings_.fault("its Draco data has other numbers of triangles or vertices than its accessors", element_);
        for (const std::string& name : draco_->missing)
            warnings_.fault(fmt::format("its Draco data has no {}, which is left out", name), element_);
        for (const std::string& name : draco_->beside)
            warnings_.fault(fmt::format("its Draco data has no {}, the accessor has", name), element_);
    } else if (accessor != kNone) {
        indices = accessors_.read_integers(accessor, 1, 0, accessors_.count(accessor), "indices");
        const bool joined = mode == TINYGLTF_MODE_LINE_LOOP || mode == TINYGLTF_MODE_LINE_STRIP ||
                            mode == TINYGLTF_MODE_TRIANGLE_STRIP || mode == TINYGLTF_MODE_TRIANGLE_FAN;
        if (document_.restarts && joined) {
            const int type = document_.model.accessors[static_cast<std::size_t>(accessor)].componentType;
            const std::uint32_t restart = type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? 0xffu
                                          : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? 0xffffu
                                                                                           : 0xffffffffu;
            indices = separate(indices, mode, restart);
            mode = is_stroke(mode) ? TINYGLTF_MODE_LINE : TINYGLTF_MODE_TRIANGLES;
        }
    } else {
        if (vertices > std::numeric_limits<std::uint32_t>::max())
            document_.fail(element_, "{} vertices are more than 2^32 - 1", vertices);
        accessors_.check_data(attribute("POSITION"));
        indices.resize(vertices);
        std::iota(indices.begin(), indices.end(), 0u);
    }
    if (indices.empty()) return;
    const auto [lowest, highest] = std::ranges::minmax_element(indices);
    if (*highest >= vertices)
        document_.fail(element_, "index {} at place {} of {}, but there are {} vertices", *highest,
                       highest - indices.begin(), draco_ ? "its Draco data" : fmt::format("accessors[{}]", accessor),
                       vertices);
    first_ = *lowest;
    count_ = *highest - first_ + 1;
    for (std::uint32_t& index : indices) index -= static_cast<std::uint32_t>(first_);
    if (is_stroke(mode)) return read_strokes(indices, mode);
    if (mode == TINYGLTF_MODE_TRIANGLES && indices.size() % 3 != 0)
        warnings_.fault("number of indices is not a multiple of 3, the last ones are left out", element_);
    still.triangles = make_triangles(indices, mode);
}

void GltfPrimitive::read_strokes(const std::vector<std::uint32_t>& indices, int mode) {
    const StrokeSize size = measure_strokes(mode, indices.size());
    if (size.vertices > std::numeric_limits<std::uint32_t>::max())
        document_.fail(element_, "its points or lines need {} vertices, more than 2^32 - 1", size.vertices);
    if (mode == TINYGLTF_MODE_LINE && indices.size() % 2 != 0)
        warnings_.fault("number of indices is not a multiple of 2, the last one is left out", element_);
    const std::vector<vec3> positions = read_attribute<vec3>("POSITION");
    strokes_ = make_strokes(mode, indices, positions);
    stroke_count_ = size.strokes;
    still.triangles = std::move(strokes_->triangles);
}

void GltfPrimitive::read_uvs(const GltfMaterial* material) {
    const std::array<int, 2> sets = material ? material->uv_sets : std::array{0, 1};
    for (std::size_t set = 0; set < 2; ++set) still.uvs[set] = read_uv_set(sets[set]);
    if (!material) return;
    const std::optional<TextureRef> map = tangent_texture_of(material);
    if (map && map->uv_set == kTangentUvs) tangent_uvs = read_uv_set(0);
    for_each_texture(material->material, [&](const TextureRef& t) {
        if (t && still.uvs[static_cast<std::size_t>(t.uv_set)].empty())
            warnings_.add(fmt::format("has no TEXCOORD_{}, which its material's textures need",
                                      sets[static_cast<std::size_t>(t.uv_set)]),
                          element_);
    });
}

std::vector<vec2> GltfPrimitive::read_uv_set(int set) {
    std::vector<vec2> uvs = read_attribute<vec2>(fmt::format("TEXCOORD_{}", set));
    bool mended = false;
    for (vec2& uv : uvs) {
        if (all_finite(vec3(uv, 0))) continue;
        uv = vec2(0);
        mended = true;
    }
    if (mended) warnings_.fault("texture coordinates are not finite, taken as 0", element_);
    return uvs;
}

void GltfPrimitive::read_colors() {
    const int color = attribute("COLOR_0");
    if (color == kNone) return;
    if (accessors_.components(color) == 3) {
        for (const vec3& c : read_attribute<vec3>("COLOR_0", true)) still.colors.emplace_back(c, 1);
    } else {
        still.colors = read_attribute<vec4>("COLOR_0", true);
    }
    bool mended = false;
    for (vec4& c : still.colors) {
        // NaN is not equal to itself and becomes 1.
        const vec4 clamped = glm::mix(vec4(1), glm::clamp(c, 0.0f, 1.0f), glm::equal(c, c));
        mended = mended || clamped != c;
        c = clamped;
    }
    if (mended) warnings_.add("vertex colours are outside [0, 1], clamped", element_);
}

JointSet GltfPrimitive::read_joint_set(std::size_t set, std::uint32_t* ignored) const {
    const std::string name = fmt::format("JOINTS_{}", set);
    const int accessor = attribute(name);
    check_count(accessor, name);
    const std::vector<std::uint32_t> joints = around(accessors_.read_integers(accessor, 4, first_, count_, name), 4);
    JointSet read;
    read.weights = read_attribute<vec4>(fmt::format("WEIGHTS_{}", set), true);
    read.joints.reserve(read.weights.size());
    for (std::size_t i = 0; i < read.weights.size(); ++i) {
        uvec4& joint = read.joints.emplace_back(0);
        for (int k = 0; k < 4; ++k) {
            float& weight = read.weights[i][k];
            const std::uint32_t index = joints[4 * i + static_cast<std::size_t>(k)];
            if (weight > 0 && std::isfinite(weight)) {
                joint[k] = index;
                continue;
            }
            weight = 0;  // the joint stays 0, since its index may be out of range
            if (ignored) *ignored = std::max(*ignored, index);
        }
    }
    return read;
}

void GltfPrimitive::find_joints() {
    for (;;) {
        const std::string joints = fmt::format("JOINTS_{}", highest_joints_.size());
        const std::string weights = fmt::format("WEIGHTS_{}", highest_joints_.size());
        if (attribute(joints) == kNone || attribute(weights) == kNone) break;
        check_count(attribute(weights), weights);
        std::uint32_t highest = 0;
        for (const uvec4& joint : read_joint_set(highest_joints_.size(), &ignored_joint_).joints)
            highest = std::max({highest, joint.x, joint.y, joint.z, joint.w});
        highest_joints_.push_back(highest);
    }
    if (highest_joints_.empty()) document_.fail(element_, "is skinned, but has no JOINTS_0 and WEIGHTS_0");
}

/// Frees the decoded elements that no pose reads.
void GltfPrimitive::free_decoded() {
    std::set<int> read{attribute("POSITION"), attribute("NORMAL")};
    if (has_tangents_) read.insert(attribute("TANGENT"));
    for (std::size_t set = 0; set < highest_joints_.size(); ++set) {
        read.insert(attribute(fmt::format("JOINTS_{}", set)));
        read.insert(attribute(fmt::format("WEIGHTS_{}", set)));
    }
    for (const auto& target : primitive_.targets)
        for (const auto& [name, accessor] : target) read.insert(accessor);
    std::erase_if(draco_->accessors, [&](const auto& decoded) { return !read.contains(decoded.first); });
}

void GltfPrimitive::check_joints(std::size_t joints, GltfWarnings& warnings) const {
    for (std::size_t set = 0; set < highest_joints_.size(); ++set)
        if (highest_joints_[set] >= joints)
            document_.fail(element_, "JOINTS_{} refers to joint {} of {}", set, highest_joints_[set], joints);
    if (!highest_joints_.empty() && ignored_joint_ >= joints)
        warnings.fault(fmt::format("refers to joint {} of {} with weight 0", ignored_joint_, joints), element_);
}

VertexArrays GltfPrimitive::read() const {
    VertexArrays vertices{read_attribute<vec3>("POSITION"), {}, {}};
    if (strokes_) {
        for (std::size_t i = 0; i < vertices.positions.size(); ++i)
            vertices.positions[i] += radius_ * strokes_->directions[i];
        vertices.normals = strokes_->directions;
        return vertices;
    }
    vertices.normals = read_attribute<vec3>("NORMAL");
    if (has_tangents_) vertices.tangents = read_attribute<vec4>("TANGENT");
    return vertices;
}

std::vector<JointSet> GltfPrimitive::read_joints() const {
    std::vector<JointSet> sets(highest_joints_.size());
    for (std::size_t set = 0; set < sets.size(); ++set) sets[set] = read_joint_set(set);
    return sets;
}

std::vector<ActiveTarget> GltfPrimitive::active_targets(std::span<const double> weights, GltfWarnings& warnings) const {
    std::vector<ActiveTarget> active;
    if (targets() > 0 && !weights.empty() && weights.size() != targets())
        warnings.add(fmt::format("{} weights for {} morph targets", weights.size(), targets()), element_);
    for (std::size_t i = 0; i < std::min(targets(), weights.size()); ++i) {
        const auto weight = static_cast<float>(weights[i]);
        if (weight == 0) continue;
        active.push_back({static_cast<std::uint32_t>(i), weight});
        for (const auto& [name, accessor] : primitive_.targets[i]) {
            if (name != "POSITION" && name != "NORMAL" && name != "TANGENT")
                warnings.add(fmt::format("morphing of {} is not supported", name), element_);
        }
    }
    return active;
}

RestShape::Moved GltfPrimitive::moved_by(std::size_t target) const {
    return {target_attribute(target, "POSITION") != kNone, has_normals_ && target_attribute(target, "NORMAL") != kNone,
            has_tangents_ && target_attribute(target, "TANGENT") != kNone};
}

MorphTarget GltfPrimitive::read_target(std::size_t target) const {
    const Moved moved = moved_by(target);
    const auto read = [&](bool wanted, const std::string& name) {
        return wanted ? read_checked<vec3>(target_attribute(target, name), name) : std::vector<vec3>();
    };
    return {read(moved.positions, "POSITION"), read(moved.normals, "NORMAL"), read(moved.tangents, "TANGENT")};
}

}  // namespace halflight
