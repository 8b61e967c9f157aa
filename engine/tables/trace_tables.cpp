#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/scene/geometry.h"
#include "engine/tables/table_rows.h"
#include "engine/tables/tables.h"

namespace halflight {
namespace {

// Limit of |M| |M^-1| for shared instances. Moving a ray to object space and its hit back multiplies float's 2^-24 by
// that product. Below the limit more than half of the bits remain. The tracer pads the boxes of instances by it.
constexpr double kMaxCondition = 0x1p10;

/// Returns the largest sum of absolute values of a row, the norm induced by the maximum norm.
double max_norm(const dmat3& m) {
    double norm = 0;
    for (int row = 0; row < 3; ++row) {
        norm = std::max(norm, std::abs(m[0][row]) + std::abs(m[1][row]) + std::abs(m[2][row]));
    }
    return norm;
}

bool well_conditioned(const dmat4& object_to_world) {
    const dmat3 linear(object_to_world);
    const dmat3 inverse = glm::inverse(linear);
    return std::isfinite(glm::determinant(inverse)) && max_norm(linear) * max_norm(inverse) <= kMaxCondition;
}

class Builder {
  public:
    Builder(const Scene& scene, std::size_t flatten_limit, const std::optional<dvec3>& reference)
        : scene_(scene), flatten_limit_(flatten_limit), reference_(reference) {}

    TraceTables build() {
        std::vector<MeshExtent> extents;
        for (const Mesh& mesh : scene_.meshes) extents.push_back(extent_of(mesh));
        tables_.origin = choose_origin(scene_.instances, extents, reference_);
        classify();
        reserve();
        add_merged();
        add_shared();
        return std::move(tables_);
    }

  private:
    const Mesh& mesh_of(const Instance& instance) const {
        return scene_.meshes[static_cast<std::size_t>(instance.mesh)];
    }

    /// Returns whether light of some light passes an instance.
    bool is_passed(const Instance& instance) const { return ((passed_ >> instance.link_class) & 1) != 0; }

    /// Decides which instances are merged into block 0 and which share the block of their mesh.
    void classify() {
        std::vector<std::uint32_t> uses(scene_.meshes.size(), 0);
        shared_.assign(scene_.instances.size(), 0);
        for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
            shared_[i] = has_surface(scene_, scene_.instances[i]) && !scene_.instances[i].catcher &&
                         well_conditioned(scene_.instances[i].object_to_world);
            if (shared_[i]) ++uses[static_cast<std::size_t>(scene_.instances[i].mesh)];
        }
        const std::vector<char> flattened = flattened_meshes(uses);
        for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
            const auto mesh = static_cast<std::size_t>(scene_.instances[i].mesh);
            shared_[i] = shared_[i] && uses[mesh] > 1 && !flattened[mesh];
        }
    }

    std::vector<char> flattened_meshes(const std::vector<std::uint32_t>& uses) const {
        const auto triangles = [&](std::size_t mesh) { return uses[mesh] * scene_.meshes[mesh].triangles.size(); };
        std::vector<std::size_t> order(scene_.meshes.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return triangles(a) < triangles(b); });
        std::vector<char> flattened(scene_.meshes.size(), 0);
        std::size_t total = 0;
        for (const std::size_t mesh : order) {
            if (uses[mesh] > 1) total += triangles(mesh);
            flattened[mesh] = total <= flatten_limit_;
        }
        return flattened;
    }

    /// Makes room for all meshes, since tables that grow would take twice the memory. Throws Error if they are too
    /// large.
    void reserve() {
        std::vector<char> counted(scene_.meshes.size(), 0);
        std::size_t vertices = 0, triangles = 0;
        for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
            char& once = counted[static_cast<std::size_t>(scene_.instances[i].mesh)];
            if (!has_surface(scene_, scene_.instances[i]) || (shared_[i] && once)) continue;
            once = once || shared_[i];
            vertices += mesh_of(scene_.instances[i]).positions.size();
            triangles += mesh_of(scene_.instances[i]).triangles.size();
        }
        check_table_size(scene_, vertices, triangles);
        tables_.positions.reserve(vertices);
        tables_.triangles.reserve(triangles);
    }

    /// Appends a mesh. `place` transforms its positions to block space in double.
    template <class Place>
    void append(std::size_t instance, bool merged, const Place& place) {
        const Mesh& mesh = mesh_of(scene_.instances[instance]);
        MeshRange range;
        range.mesh = static_cast<std::uint32_t>(scene_.instances[instance].mesh);
        range.instance = static_cast<std::uint32_t>(instance);
        range.merged = merged;
        range.moves = mesh.deforms || (merged && scene_.instances[instance].moves);
        range.block = static_cast<std::uint32_t>(tables_.blocks.size() - 1);
        range.first_vertex = static_cast<std::uint32_t>(tables_.positions.size());
        range.vertex_count = static_cast<std::uint32_t>(mesh.positions.size());
        range.first_triangle = static_cast<std::uint32_t>(tables_.triangles.size());
        range.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
        tables_.ranges.push_back(range);

        Block& block = tables_.blocks.back();
        for (const vec3& position : mesh.positions) {
            const dvec3 placed = place(position);
            check_reach(placed, scene_, instance);
            tables_.positions.emplace_back(placed);
        }
        const std::vector<std::uint32_t> words = words_.of(TriangleWords::lowest_vertex_alpha(mesh));
        const std::uint32_t flags = scene_.instances[instance].catcher ? kTriangleCatcher : 0;
        const bool passed = merged ? is_passed(scene_.instances[instance]) : passed_meshes_[range.mesh] != 0;
        const bool mirrored = merged && mirrors(scene_.instances[instance]);
        tables_.catchers |= flags != 0;
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const uvec3 corners = mesh.triangles[i] + range.first_vertex;
            std::uint32_t word = placed_word(words[mesh.triangle_material[i]], mirrored) | flags;
            if (flags != 0 && shared::in_pane(word)) word &= ~kTrianglePane;
            if (passed) word |= kTriangleAlpha;
            tables_.triangles.emplace_back(corners, word);
            tables_.panes |= shared::in_pane(word);
            tables_.alpha_tested |= (word & kTriangleAlpha) != 0 || shared::in_pane(word);
            tables_.one_sided |= (word & kTriangleOneSided) != 0;
            for (int k = 0; k < 3; ++k) block.bounds.add(tables_.positions[corners[k]]);
            tables_.slivers |=
                is_sliver(tables_.positions[corners.x], tables_.positions[corners.y], tables_.positions[corners.z]);
        }
        block.triangle_count += range.triangle_count;
    }

    void begin_block(const dvec3& origin) {
        Block block;
        block.first_triangle = static_cast<std::uint32_t>(tables_.triangles.size());
        block.origin = origin;
        tables_.blocks.push_back(block);
    }

    void add_merged() {
        for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
            const Instance& instance = scene_.instances[i];
            if (shared_[i] || !has_surface(scene_, instance)) continue;
            if (tables_.blocks.empty()) begin_block(tables_.origin);
            append(i, true, [&](const vec3& p) { return merged_position(instance, p, tables_.origin); });
        }
        if (tables_.blocks.empty()) return;
        BlockInstance identity;
        identity.identity = true;
        tables_.instances.push_back(identity);
        tables_.bounds.add(tables_.blocks.front().bounds);
    }

    void add_shared() {
        passed_meshes_.assign(scene_.meshes.size(), 0);
        for (std::size_t i = 0; i < scene_.instances.size(); ++i)
            if (shared_[i] && is_passed(scene_.instances[i])) passed_meshes_[std::size_t(scene_.instances[i].mesh)] = 1;
        std::vector<std::size_t> first_use(scene_.meshes.size(), scene_.instances.size());
        for (std::size_t i = scene_.instances.size(); i-- > 0;) {
            if (shared_[i]) first_use[static_cast<std::size_t>(scene_.instances[i].mesh)] = i;
        }
        std::vector<std::uint32_t> block_of_mesh(scene_.meshes.size());
        for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
            if (first_use[m] == scene_.instances.size()) continue;
            Bounds object;
            for (const uvec3& t : scene_.meshes[m].triangles) {
                for (int k = 0; k < 3; ++k) object.add(scene_.meshes[m].positions[t[k]]);
            }
            const dvec3 centre(object.centre());
            block_of_mesh[m] = static_cast<std::uint32_t>(tables_.blocks.size());
            begin_block(centre);
            append(first_use[m], false, [&](const vec3& p) { return dvec3(p) - centre; });
        }
        for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
            if (shared_[i]) add_instance(i, block_of_mesh[static_cast<std::size_t>(scene_.instances[i].mesh)]);
        }
    }

    void add_instance(std::size_t index, std::uint32_t block_index) {
        const Block& block = tables_.blocks[block_index];
        dmat4 block_to_world = scene_.instances[index].object_to_world;
        block_to_world[3] = block_to_world * dvec4(block.origin, 1) - dvec4(tables_.origin, 0);
        BlockInstance instance;
        instance.block = block_index;
        instance.block_to_world = glm::mat4x3(block_to_world);
        instance.world_to_block = glm::mat4x3(glm::inverse(block_to_world));
        instance.scene_instance = static_cast<std::uint32_t>(index);
        tables_.instances.push_back(instance);
        for (int corner = 0; corner < 8; ++corner) {
            const vec3 p = glm::mix(block.bounds.lower, block.bounds.upper,
                                    vec3(corner & 1 ? 1.0f : 0.0f, corner & 2 ? 1.0f : 0.0f, corner & 4 ? 1.0f : 0.0f));
            const dvec3 placed(block_to_world * dvec4(p, 1));
            check_reach(placed, scene_, index);
            tables_.bounds.add(vec3(placed));
        }
    }

    const Scene& scene_;
    std::size_t flatten_limit_;
    std::optional<dvec3> reference_;
    const TriangleWords words_{scene_};
    const std::uint64_t passed_ = passed_classes(scene_);
    std::vector<char> shared_;         // per scene instance: the instance shares its mesh's block
    std::vector<char> passed_meshes_;  // per mesh with a block: light of some light passes an instance
    TraceTables tables_;
};

}  // namespace

bool is_sliver(const vec3& a, const vec3& b, const vec3& c) {
    const dvec3 e1 = dvec3(b) - dvec3(a), e2 = dvec3(c) - dvec3(a), e3 = dvec3(c) - dvec3(b);
    const double square = std::max({glm::dot(e1, e1), glm::dot(e2, e2), glm::dot(e3, e3)});
    const double doubled_area = glm::length(glm::cross(e1, e2));
    const dvec3 reach(glm::max(glm::max(glm::abs(a), glm::abs(b)), glm::abs(c)));
    const double lost = 0x1p-24 * std::max({reach.x, reach.y, reach.z}) * std::sqrt(square);
    return doubled_area > lost && square > kSliverAspect * doubled_area;
}

TraceTables build_trace_tables(const Scene& scene, std::size_t flatten_limit, const std::optional<dvec3>& reference) {
    return Builder(scene, flatten_limit, reference).build();
}

TriangleSource source_of(const TraceTables& tables, std::uint32_t instance, std::uint32_t triangle) {
    const auto after = std::upper_bound(tables.ranges.begin(), tables.ranges.end(), triangle,
                                        [](std::uint32_t t, const MeshRange& r) { return t < r.first_triangle; });
    const MeshRange& range = *(after - 1);
    return {range.merged ? range.instance : tables.instances[instance].scene_instance, triangle - range.first_triangle};
}

}  // namespace halflight
