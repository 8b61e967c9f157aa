#include "engine/paging/moving_pages.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>

#include "engine/core/error.h"
#include "engine/paging/partition.h"
#include "engine/scene/geometry.h"
#include "engine/scene/material_lobes.h"
#include "engine/tables/table_rows.h"

namespace halflight::paging {
namespace {

/// Triangles of a bucket, on average. Working memory of a build is about 420 bytes per triangle.
constexpr std::size_t kBucketTriangles = std::size_t{1} << 16;

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

}  // namespace

MovingPages::MovingPages(std::shared_ptr<const PageSource> still) : still_(std::move(still)), index_(still_->index()) {}

bool MovingPages::pose(const Scene& scene) {
    const PageIndex& of_still = still_->index();
    place_still(scene);
    const std::vector<uvec4> last_triangles = std::exchange(triangles_, {});
    const std::vector<vec3> last_positions = std::exchange(positions_, {});
    add_rows(scene);
    if (same_bits(triangles_, last_triangles) && same_bits(positions_, last_positions)) return false;
    build(of_still);
    return true;
}

/// Finds the still instances of the pose. They are in the order of their ranges.
void MovingPages::place_still(const Scene& scene) {
    const std::size_t count = still_->index().ranges.size();
    std::size_t found = 0;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        if (is_moving(scene, scene.instances[i])) continue;
        if (found < count) index_.ranges[found].instance = i;
        ++found;
    }
    if (found != count)
        throw Error(scene.name, "its pages were made of another scene: {} objects that do not move, not {}", count,
                    found);
}

/// Makes the tables of moving instances, as build_trace_tables() and build_shading_tables() make them.
void MovingPages::add_rows(const Scene& scene) {
    const PageIndex& of_still = still_->index();
    index_.ranges.resize(of_still.ranges.size());
    AbsentGeometry& geometry = index_.geometry;
    geometry.resident.resize(of_still.geometry.resident.size());
    if (geometry.used_materials.size() != scene.materials.size())
        throw Error(scene.name, "its pages were made of another scene: {} materials, not {}",
                    geometry.used_materials.size(), scene.materials.size());
    const SceneNeeds needs = vertex_layout(index_);
    std::size_t triangles = 0, vertices = 0;
    for (const Instance& instance : scene.instances) {
        if (!is_moving(scene, instance) || !has_surface(scene, instance)) continue;
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        triangles += mesh.triangles.size(), vertices += mesh.positions.size();
    }
    check_table_size(scene, of_still.vertices + vertices, of_still.triangles + triangles);
    triangles_.reserve(triangles);
    positions_.reserve(vertices);
    attributes_.assign(vertices * index_.vertex_texels, vec4(0));
    const TriangleWords words_of(scene);
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        if (!is_moving(scene, instance) || !has_surface(scene, instance)) continue;
        const auto first_vertex = static_cast<std::uint32_t>(positions_.size());
        const auto first_triangle = static_cast<std::uint32_t>(of_still.triangles + triangles_.size());
        index_.ranges.push_back({.mesh = static_cast<std::uint32_t>(instance.mesh),
                                 .instance = i,
                                 .merged = true,
                                 .moves = true,
                                 .first_vertex = static_cast<std::uint32_t>(of_still.vertices + first_vertex),
                                 .vertex_count = static_cast<std::uint32_t>(mesh.positions.size()),
                                 .first_triangle = first_triangle,
                                 .triangle_count = static_cast<std::uint32_t>(mesh.triangles.size())});
        for (const vec3& position : mesh.positions) {
            const dvec3 at = merged_position(instance, position, index_.origin);
            check_reach(at, scene, i);
            positions_.emplace_back(at);
        }
        write_vertex_rows(mesh, VertexTransform(instance.object_to_world), needs,
                          attributes_.data() + std::size_t{first_vertex} * index_.vertex_texels);
        std::vector<std::uint32_t> words = words_of.of(TriangleWords::lowest_vertex_alpha(mesh));
        for (std::uint32_t& word : words) word = placed_word(word, mirrors(instance));
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const std::uint32_t index = mesh.triangle_material[t];
            const Material& material = scene.materials[index];
            if ((!material.unlit && has_emission(material)) || is_pane(material))
                geometry.resident.push_back(first_triangle + static_cast<std::uint32_t>(t));
            triangles_.emplace_back(mesh.triangles[t] + first_vertex, words[index]);
        }
    }
    index_.triangles = static_cast<std::uint32_t>(of_still.triangles + triangles);
    index_.vertices = of_still.vertices + vertices;
}

/// Builds the pages of the tables.
void MovingPages::build(const PageIndex& of_still) {
    index_.bounds = of_still.bounds;
    index_.slivers = of_still.slivers;
    index_.alpha = of_still.alpha;
    index_.one_sided = of_still.one_sided;
    index_.panes = of_still.panes;
    index_.stack_entries = of_still.stack_entries;
    index_.pages.resize(of_still.pages.size());
    index_.roots.resize(of_still.roots.size());
    index_.above.resize(of_still.above.size());
    pages_.clear();
    std::vector<rays::Corners> corners;
    std::vector<vec3> centroids;
    corners.reserve(triangles_.size());
    centroids.reserve(triangles_.size());
    for (const uvec4& t : triangles_) {
        const auto& [a, b, c] = corners.emplace_back(rays::Corners{positions_[t.x], positions_[t.y], positions_[t.z]});
        for (const vec3& corner : {a, b, c}) index_.bounds.add(corner);
        index_.slivers = index_.slivers || is_sliver(a, b, c);
        index_.panes = index_.panes || shared::in_pane(t.w);
        index_.alpha = index_.alpha || (t.w & kTriangleAlpha) != 0 || shared::in_pane(t.w);
        index_.one_sided = index_.one_sided || (t.w & kTriangleOneSided) != 0;
        centroids.push_back((a + b + c) / 3.0f);
    }
    if (corners.empty()) return;
    const BucketTree tree(centroids, kBucketTriangles);
    std::vector<std::vector<std::uint32_t>> buckets(tree.buckets());
    for (std::uint32_t i = 0; i < centroids.size(); ++i) buckets[tree.bucket_of(centroids[i])].push_back(i);
    std::vector<PageSet> sets(buckets.size());
    tbb::parallel_for(std::size_t{0}, buckets.size(), [&](std::size_t bucket) {
        std::vector<rays::Corners> own;
        std::vector<std::uint32_t> ids, words;
        for (const std::uint32_t i : buckets[bucket]) {
            words.push_back(triangles_[i].w);
            own.push_back(corners[i]);
            ids.push_back(of_still.triangles + i);
        }
        sets[bucket] = build_pages(own, ids, words, index_.limits);
    });
    for (PageSet& set : sets) {
        append_above(index_.above, set);
        for (PageRoot root : set.roots) {
            root.page += static_cast<std::uint32_t>(index_.pages.size());
            index_.roots.push_back(root);
        }
        for (Page& page : set.pages) {
            index_.pages.push_back(size_of(page));
            pages_.push_back(std::move(page));
        }
        index_.stack_entries = std::max(index_.stack_entries, set.stack_entries);
    }
}

Page MovingPages::read(std::uint32_t page) const {
    const std::uint32_t still = this->still().pages;
    return page < still ? still_->read(page) : pages_[page - still];
}

void MovingPages::read_rows(std::span<const std::uint32_t> triangles, TriangleRows& rows) const {
    const std::uint32_t still = this->still().triangles;
    std::vector<std::uint32_t> of_still, places;
    for (std::uint32_t i = 0; i < triangles.size(); ++i)
        if (triangles[i] < still) of_still.push_back(triangles[i]), places.push_back(i);
    if (of_still.size() == triangles.size()) return still_->read_rows(triangles, rows);
    const std::size_t texels = index_.vertex_texels;
    rows.triangles.resize(triangles.size());
    rows.positions.resize(3 * triangles.size());
    rows.attributes.resize(3 * texels * triangles.size());
    TriangleRows found;
    still_->read_rows(of_still, found);
    for (std::size_t k = 0; k < places.size(); ++k) {
        const std::size_t i = places[k];
        rows.triangles[i] = found.triangles[k];
        std::copy_n(&found.positions[3 * k], 3, &rows.positions[3 * i]);
        std::copy_n(&found.attributes[3 * texels * k], 3 * texels, &rows.attributes[3 * texels * i]);
    }
    const auto first_vertex = static_cast<std::uint32_t>(still_->index().vertices);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (triangles[i] < still) continue;
        const uvec4& t = triangles_[triangles[i] - still];
        rows.triangles[i] = t + uvec4(first_vertex, first_vertex, first_vertex, 0);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t vertex = t[static_cast<int>(k)];
            rows.positions[3 * i + k] = positions_[vertex];
            std::copy_n(&attributes_[vertex * texels], texels, &rows.attributes[(3 * i + k) * texels]);
        }
    }
}

}  // namespace halflight::paging
