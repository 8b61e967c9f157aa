#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/core/error.h"
#include "engine/tables/tables.h"

namespace halflight {
namespace {

constexpr double kReach = 0x1p40;                   // world units, limit of build_trace_tables()
constexpr std::size_t kTriangleLimit = 1ull << 28;  // ids must fit the tracer's nodes
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

/// Returns the lowest alpha that a material can have, given the lowest vertex alpha.
float lowest_alpha(const Material& material, const std::vector<float>& image_alpha, float vertex_alpha) {
    const TextureRef& texture = material.base_color_texture;
    return material.base_color.a * vertex_alpha *
           (texture ? image_alpha[static_cast<std::size_t>(texture.image)] : 1.0f);
}

class Builder {
  public:
    Builder(const Scene& scene, std::size_t flatten_limit, const std::optional<dvec3>& reference)
        : scene_(scene), flatten_limit_(flatten_limit), reference_(reference) {}

    TraceTables build() {
        find_origin();
        classify();
        find_alpha();
        reserve();
        add_merged();
        add_shared();
        return std::move(tables_);
    }

  private:
    bool has_triangles(const Instance& instance) const { return !mesh_of(instance).triangles.empty(); }
    const Mesh& mesh_of(const Instance& instance) const {
        return scene_.meshes[static_cast<std::size_t>(instance.mesh)];
    }

    /// Position of an instance, and its number of triangles over its size.
    struct Place {
        dvec3 centre;
        double weight;
    };

    /// Chooses the origin. Float rounding of a position grows with its distance from the origin and matters in
    /// proportion to the size of the object. So the origin minimises the sum, over all triangles, of distance over size
    /// of their instance. On each axis this is a weighted median of the instances' centres.
    void find_origin() {
        std::vector<Bounds> boxes(scene_.meshes.size());
        for (std::size_t m = 0; m < boxes.size(); ++m)
            for (const vec3& p : scene_.meshes[m].positions) boxes[m].add(p);
        std::vector<Place> places;
        double sum = 0, triangles = 0;
        for (const Instance& instance : scene_.instances) {
            if (!has_triangles(instance)) continue;
            const Bounds& box = boxes[static_cast<std::size_t>(instance.mesh)];
            const dvec3 half = 0.5 * (dvec3(box.upper) - dvec3(box.lower));
            const dmat4& m = instance.object_to_world;
            const dvec3 extent =
                glm::abs(dvec3(m[0])) * half.x + glm::abs(dvec3(m[1])) * half.y + glm::abs(dvec3(m[2])) * half.z;
            const double size = glm::length(extent);
            if (size == 0) continue;  // flattened to a point, hence invisible
            const auto count = static_cast<double>(mesh_of(instance).triangles.size());
            places.push_back({dvec3(m * dvec4(dvec3(box.lower) + half, 1)), count / size});
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
            tables_.origin[axis] = (middle == places.end() ? places.back() : *middle).centre[axis];
        }
        const double allowed = std::max(kNearOrigin * triangles, 2 * remoteness(places, tables_.origin));
        if (reference_ && remoteness(places, *reference_) <= allowed) tables_.origin = *reference_;
    }

    /// Returns the sum that the median minimises.
    static double remoteness(const std::vector<Place>& places, const dvec3& origin) {
        double sum = 0;
        for (const Place& place : places) {
            const dvec3 d = glm::abs(place.centre - origin);
            sum += place.weight * (d.x + d.y + d.z);
        }
        return sum;
    }

    /// Decides which instances are merged into block 0 and which share the block of their mesh.
    void classify() {
        std::vector<std::uint32_t> uses(scene_.meshes.size(), 0);
        shared_.assign(scene_.instances.size(), 0);
        for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
            shared_[i] = has_triangles(scene_.instances[i]) && well_conditioned(scene_.instances[i].object_to_world);
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

    void check_reach(const dvec3& placed, std::size_t instance) const {
        if (glm::all(glm::lessThan(glm::abs(placed), dvec3(kReach)))) return;
        const int node = scene_.instances[instance].node;
        const std::string element =
            node == kNone ? fmt::format("instance {}", instance) : fmt::format("nodes[{}]", node);
        throw Error(scene_.name, "{} reaches beyond 2^40 from the scene's centre", element);
    }

    void find_alpha() {
        if (scene_.materials.size() >= kTriangleMaterialMask) throw Error(scene_.name, "more than 2^24 materials");
        image_alpha_.assign(scene_.images.size(), -1);
        for (const Material& material : scene_.materials) {
            if (material.alpha_mode == AlphaMode::opaque || !material.base_color_texture) continue;
            const auto index = static_cast<std::size_t>(material.base_color_texture.image);
            if (image_alpha_[index] >= 0) continue;
            const TextureImage& image = scene_.images[index];
            std::uint8_t lowest = 255;
            for (std::size_t i = 3; i < image.rgba.size(); i += 4) lowest = std::min(lowest, image.rgba[i]);
            image_alpha_[index] = static_cast<float>(lowest) / 255.0f;
        }
    }

    /// Returns the word w of triangles by material.
    std::vector<std::uint32_t> material_words(const Mesh& mesh) const {
        float vertex_alpha = 1;
        for (const vec4& color : mesh.colors) vertex_alpha = std::min(vertex_alpha, color.a);
        std::vector<std::uint32_t> words(scene_.materials.size());
        for (std::uint32_t m = 0; m < words.size(); ++m) {
            const Material& material = scene_.materials[m];
            const float alpha = lowest_alpha(material, image_alpha_, vertex_alpha);
            const bool decides = (material.alpha_mode == AlphaMode::mask && alpha < material.alpha_cutoff) ||
                                 (material.alpha_mode == AlphaMode::blend && alpha < 1.0f);
            words[m] = m | (decides ? kTriangleAlpha : 0u);
        }
        return words;
    }

    /// Makes room for all meshes, since tables that grow would take twice the memory. Throws Error where they are too
    /// large.
    void reserve() {
        std::vector<char> counted(scene_.meshes.size(), 0);
        std::size_t vertices = 0, triangles = 0;
        for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
            char& once = counted[static_cast<std::size_t>(scene_.instances[i].mesh)];
            if (!has_triangles(scene_.instances[i]) || (shared_[i] && once)) continue;
            once = once || shared_[i];
            vertices += mesh_of(scene_.instances[i]).positions.size();
            triangles += mesh_of(scene_.instances[i]).triangles.size();
        }
        if (triangles >= kTriangleLimit) throw Error(scene_.name, "2^28 triangles or more");
        if (vertices > std::numeric_limits<std::uint32_t>::max()) throw Error(scene_.name, "2^32 vertices or more");
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
            const dvec3 placed = place(dvec3(position));
            check_reach(placed, instance);
            tables_.positions.emplace_back(placed);
        }
        const std::vector<std::uint32_t> words = material_words(mesh);
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const uvec3 corners = mesh.triangles[i] + range.first_vertex;
            const std::uint32_t word = words[mesh.triangle_material[i]];
            tables_.triangles.emplace_back(corners, word);
            tables_.alpha_tested |= (word & kTriangleAlpha) != 0;
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
            if (shared_[i] || !has_triangles(instance)) continue;
            if (tables_.blocks.empty()) begin_block(tables_.origin);
            append(i, true,
                   [&](const dvec3& p) { return dvec3(instance.object_to_world * dvec4(p, 1)) - tables_.origin; });
        }
        if (tables_.blocks.empty()) return;
        BlockInstance identity;
        identity.identity = true;
        tables_.instances.push_back(identity);
        tables_.bounds.add(tables_.blocks.front().bounds);
    }

    void add_shared() {
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
            append(first_use[m], false, [&](const dvec3& p) { return p - centre; });
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
            check_reach(placed, index);
            tables_.bounds.add(vec3(placed));
        }
    }

    const Scene& scene_;
    std::size_t flatten_limit_;
    std::optional<dvec3> reference_;
    std::vector<char> shared_;        // per scene instance: the instance shares its mesh's block
    std::vector<float> image_alpha_;  // lowest alpha of each image that can decide a hit
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
