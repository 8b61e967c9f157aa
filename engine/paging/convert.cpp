#include "engine/paging/convert.h"

#include <tbb/info.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/memory_ledger.h"
#include "engine/paging/partition.h"
#include "engine/tables/table_rows.h"
#include "shaders/shared/bvh_nodes.h"

namespace halflight::paging {
namespace {

// Working memory per triangle of a bucket, an upper estimate: its records, pairs, hierarchy and pages, and their
// copies.
constexpr std::size_t kBuildBytes = 420;
// Shares of the three steps in the time (measured on a city).
constexpr double kSurveyShare = 0.12, kRowShare = 0.34, kPageShare = 0.54;

std::size_t threads() {
    return static_cast<std::size_t>(std::max(tbb::info::default_concurrency(), 1));
}

std::size_t bytes_of(const Mesh& mesh) {
    const auto bytes = [](const auto& values) { return values.size() * sizeof(values[0]); };
    return bytes(mesh.positions) + bytes(mesh.normals) + bytes(mesh.tangents) + bytes(mesh.uvs[0]) +
           bytes(mesh.uvs[1]) + bytes(mesh.colors) + bytes(mesh.triangles) + bytes(mesh.triangle_material);
}

/// Properties of a mesh that the first step finds.
struct MeshFacts {
    MeshExtent extent;
    std::size_t vertices = 0;
    float lowest_alpha = 1;  // TriangleWords::lowest_vertex_alpha()
    // Index into the Scene::meshes of a scene in memory, in which meshes without triangles deform.
    std::uint32_t index = 0;
    bool deforms = false;  // Mesh::deforms
};

/// A mesh at the place of an instance.
struct PlacedMesh {
    std::shared_ptr<const Mesh> mesh;
    std::vector<vec3> positions;   // rows of TraceTables::positions
    std::vector<vec4> attributes;  // rows of ShadingTables::vertices
    float lowest_alpha = 1;        // MeshFacts::lowest_alpha
    bool mirrored = false;         // the transform of the instance mirrors
    std::uint32_t first_vertex = 0;
};

/// Consecutive triangles of a placed mesh.
struct Piece {
    std::shared_ptr<const PlacedMesh> mesh;
    std::size_t first = 0;
    std::size_t count = 0;
};

/// Consecutive triangles of the tables on their way through the second step: some whole blocks.
struct Batch {
    std::uint32_t first_triangle = 0;
    std::vector<Piece> pieces;
    std::size_t triangles = 0;
    // Results:
    std::vector<std::string> blocks;
    std::vector<std::pair<std::uint32_t, BucketTriangle>> placed;  // triangles with their buckets
    Bounds bounds;
    std::vector<std::uint32_t> resident;
    bool slivers = false;
    bool alpha = false, one_sided = false, panes = false;
};
constexpr std::size_t kBatchTriangles = std::size_t{16} * kTrianglesPerBlock;

/// Consecutive triangles of a bucket on their way through the third step.
struct Slice {
    std::uint32_t bucket = 0;
    std::uint64_t first = 0;
    std::uint64_t count = 0;
    // Results:
    PageSet set;                       // contents of all but the last page are only in `encoded`
    std::vector<std::string> encoded;  // all but the last page
    std::vector<PageIndex::Size> sizes;
};

/// Collects triangles of a batch as blocks.
class BlockBuilder {
  public:
    BlockBuilder(std::size_t texels, std::vector<std::string>& blocks) : texels_(texels), blocks_(blocks) {}

    /// Adds a triangle with its word (TriangleWords).
    void add(const PlacedMesh& mesh, std::size_t triangle, std::uint32_t word) {
        rows_.emplace_back(mesh.mesh->triangles[triangle] + mesh.first_vertex, word);
        for (int k = 0; k < 3; ++k) corners_.push_back({rows_.back()[k], &mesh});
        if (rows_.size() == kTrianglesPerBlock) finish();
    }

    void finish() {
        if (rows_.empty()) return;
        TableBlock block;
        std::ranges::sort(corners_, {}, &Corner::vertex);
        const auto same = [](const Corner& a, const Corner& b) { return a.vertex == b.vertex; };
        corners_.erase(std::unique(corners_.begin(), corners_.end(), same), corners_.end());
        for (const auto& [vertex, mesh] : corners_) {
            const std::size_t i = vertex - mesh->first_vertex;
            block.positions.push_back(mesh->positions[i]);
            block.attributes.insert(block.attributes.end(), &mesh->attributes[i * texels_],
                                    &mesh->attributes[i * texels_] + texels_);
        }
        for (const uvec4& row : rows_) {
            std::array<std::uint16_t, 3> places;
            for (int k = 0; k < 3; ++k)
                places[static_cast<std::size_t>(k)] = static_cast<std::uint16_t>(
                    std::ranges::lower_bound(corners_, row[k], {}, &Corner::vertex) - corners_.begin());
            block.corners.push_back(places);
        }
        block.triangles = std::exchange(rows_, {});
        corners_.clear();
        blocks_.push_back(encode(block));
    }

  private:
    struct Corner {
        std::uint32_t vertex;
        const PlacedMesh* mesh;
    };
    std::size_t texels_;
    std::vector<std::string>& blocks_;
    std::vector<uvec4> rows_;
    std::vector<Corner> corners_;
};

class Converter {
  public:
    Converter(MeshSource& source, const std::filesystem::path& path, const ConvertOptions& options)
        : source_(source),
          scene_(source.scene()),
          path_(path),
          options_(options),
          memory_(MemoryLedger::process(), MemoryPart::pages, options.memory),
          words_(scene_),
          opaque_words_(words_.of(1)) {
        if (options.memory < kLeastConvertBytes)
            throw Error(path.string(), "its conversion needs {} of memory, and {} of the budget are left (--memory)",
                        text_of_bytes(kLeastConvertBytes), text_of_bytes(options.memory));
        for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
            const Material& m = scene_.materials[i];
            emits_.push_back(!m.unlit && (has_emission(m) || is_driven(i)));
        }
        index_.limits = options.limits;
        index_.files = options.files;
        index_.straight_glass = options.straight_glass;
        index_.alpha_tests = words_.alpha_tests();
    }

    PageFileSizes run() {
        survey();
        check_disk();
        PageFileSizes sizes;
        write_unnamed(path_, [&](const std::filesystem::path& temporary) {
            PageFileWriter writer(temporary, path_.string());
            BucketTree tree(sample_.centroids(index_.origin), bucket_samples());
            sample_ = CentroidSample();
            BucketFile buckets(path_.parent_path(), path_.string(), tree.buckets(), options_.memory / 8);
            write_rows(tree, buckets, writer);
            buckets.finish();
            write_pages(tree.buckets(), buckets, writer);
            sizes = writer.finish(std::move(index_));
        });
        return sizes;
    }

  private:
    static_assert(CentroidSample::kMost * 3 * sizeof(dvec4) <=
                  kLeastConvertBytes / 4);  // the memory must hold the sample and its copies

    bool is_driven(std::size_t material) const {
        return material < options_.driven_materials.size() && options_.driven_materials[material];
    }

    /// Returns whether an instance is left out.
    bool moves(std::size_t instance) const {
        return scene_.instances[instance].moves || facts_[mesh_of(instance)].deforms;
    }

    /// Returns the word of a mesh's triangles with a material.
    std::uint32_t word_of(std::uint32_t material, float lowest_alpha) const {
        const std::uint32_t word = lowest_alpha == 1 ? opaque_words_[material] : words_.of(material, lowest_alpha);
        const bool driven = is_driven(material) && scene_.materials[material].alpha_mode != AlphaMode::opaque;
        return word | (driven ? kTriangleAlpha : 0);
    }

    void report(double before, double share, std::size_t done, std::size_t all) const {
        if (!options_.progress) return;
        const double part = all > 0 ? static_cast<double>(std::min(done, all)) / static_cast<double>(all) : 0;
        options_.progress(before + share * part);
    }

    // --- First step --------------------------------------------------------------------------------------------------

    void survey() {
        std::vector<std::vector<std::size_t>> instances(scene_.meshes.size());
        for (std::size_t i = 0; i < scene_.instances.size(); ++i) instances[mesh_of(i)].push_back(i);
        facts_.resize(scene_.meshes.size());
        std::vector<bool> used(scene_.materials.size(), false);
        VertexAttributes attributes;
        std::uint32_t meshes = 0;
        std::size_t triangles = 0, vertices = 0;
        for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
            const Mesh mesh = source_.read(m);
            const Mesh parts = mesh.deforms ? source_.all_parts(m) : Mesh();
            const Mesh& all = mesh.deforms ? parts : mesh;
            facts_[m] = {extent_of(mesh), mesh.positions.size(), TriangleWords::lowest_vertex_alpha(all), meshes,
                         mesh.deforms};
            if (all.triangle_material.empty()) continue;
            ++meshes;
            attributes.add(mesh);
            attributes.add(all);
            for (const std::uint32_t material : all.triangle_material) used[material] = true;
            if (std::ranges::any_of(instances[m], [&](std::size_t i) { return moves(i); })) add_moving(all, facts_[m]);
            for (const std::size_t i : instances[m]) {
                if (moves(i)) continue;
                triangles += mesh.triangles.size();
                vertices += mesh.positions.size();
                add_to_sample(mesh, i);
                report(0, kSurveyShare, triangles, options_.expected_triangles);
            }
        }
        check_table_size(scene_, vertices, triangles);
        std::vector<MeshExtent> extents;
        for (const MeshFacts& facts : facts_) extents.push_back(facts.extent);
        index_.origin = choose_origin(scene_.instances, extents);
        index_.triangles = static_cast<std::uint32_t>(triangles);
        index_.vertices = vertices;
        index_.geometry.used_materials = used;
        index_.geometry.vertex_colors = attributes.colors;
        index_.geometry.tangents = attributes.tangents;
        needs_ = layout_needs(scene_.materials, used, attributes);
        index_.vertex_texels = static_cast<std::uint32_t>(needs_.vertex_stride());
        uses_.assign(scene_.meshes.size(), 0);
        for (std::size_t m = 0; m < instances.size(); ++m) uses_[m] = instances[m].size();
    }

    /// Refuses disks without room for the temporary file.
    void check_disk() const {
        const std::filesystem::path folder = path_.parent_path().empty() ? "." : path_.parent_path();
        std::error_code unknown;
        const std::filesystem::space_info space = std::filesystem::space(folder, unknown);
        const std::uintmax_t needed = std::uintmax_t{index_.triangles} * sizeof(BucketTriangle);
        if (!unknown && space.available < needed)
            throw Error(path_.string(), "its conversion needs {} of disk space for a while, and {} are free",
                        text_of_bytes(needed), text_of_bytes(space.available));
    }

    void add_moving(const Mesh& mesh, const MeshFacts& facts) {
        for (const std::uint32_t material : mesh.triangle_material) {
            const std::uint32_t word = word_of(material, facts.lowest_alpha);
            index_.panes = index_.panes || shared::in_pane(word);
            index_.alpha = index_.alpha || (word & kTriangleAlpha) != 0 || shared::in_pane(word);
            index_.one_sided = index_.one_sided || (word & kTriangleOneSided) != 0;
        }
    }

    std::size_t mesh_of(std::size_t instance) const {
        return static_cast<std::size_t>(scene_.instances[instance].mesh);
    }

    void add_to_sample(const Mesh& mesh, std::size_t instance) {
        const dmat4& m = scene_.instances[instance].object_to_world;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const std::uint64_t key = (std::uint64_t{instance} << 32) | t;
            if (!sample_.takes(key)) continue;
            const uvec3& corners = mesh.triangles[t];
            const dvec3 sum =
                dvec3(mesh.positions[corners.x]) + dvec3(mesh.positions[corners.y]) + dvec3(mesh.positions[corners.z]);
            sample_.add(key, dvec3(m * dvec4(sum / 3.0, 1)));
        }
    }

    /// Returns the points of the sample that an average bucket has.
    std::size_t bucket_samples() const {
        const std::size_t all = std::max<std::size_t>(index_.triangles, 1);
        return std::max<std::size_t>(options_.bucket_triangles * std::min(sample_.size(), all) / all, 1);
    }

    // --- Second step -------------------------------------------------------------------------------------------------

    std::shared_ptr<const Mesh> read(std::size_t index) {
        const auto known = std::ranges::find(cache_, index, &Cached::first);
        if (known != cache_.end()) {
            cache_.splice(cache_.begin(), cache_, known);
            return known->second;
        }
        auto mesh = std::make_shared<const Mesh>(source_.read(index));
        if (mesh->triangles.size() != facts_[index].extent.triangles ||
            mesh->positions.size() != facts_[index].vertices)
            throw Error(scene_.name, "was changed while it was read");
        if (uses_[index] < 2) return mesh;
        cache_.emplace_front(index, mesh);
        cached_bytes_ += bytes_of(*mesh);
        while (cached_bytes_ > options_.memory / 4 && cache_.size() > 1) {
            cached_bytes_ -= bytes_of(*cache_.back().second);
            cache_.pop_back();
        }
        return mesh;
    }

    /// Places the mesh of the next instance that has triangles; null after the last one.
    std::shared_ptr<const PlacedMesh> next_mesh() {
        for (; next_instance_ < scene_.instances.size(); ++next_instance_) {
            if (moves(next_instance_)) continue;
            if (facts_[mesh_of(next_instance_)].extent.triangles > 0) break;
            index_.empty.push_back(still_++);
        }
        if (next_instance_ == scene_.instances.size()) return nullptr;
        ++still_;
        const std::size_t i = next_instance_++;
        const Instance& instance = scene_.instances[i];
        const MeshFacts& facts = facts_[mesh_of(i)];
        MeshRange range;
        if (!index_.ranges.empty()) {
            const MeshRange& last = index_.ranges.back();
            range.first_vertex = last.first_vertex + last.vertex_count;
            range.first_triangle = last.first_triangle + last.triangle_count;
        }
        range.mesh = facts.index;
        range.instance = static_cast<std::uint32_t>(index_.ranges.size());
        range.merged = true;
        range.vertex_count = static_cast<std::uint32_t>(facts.vertices);
        range.triangle_count = static_cast<std::uint32_t>(facts.extent.triangles);
        index_.ranges.push_back(range);

        auto placed = std::make_shared<PlacedMesh>();
        placed->mesh = read(mesh_of(i));
        placed->first_vertex = range.first_vertex;
        placed->lowest_alpha = facts.lowest_alpha;
        placed->mirrored = mirrors(instance);
        placed->positions.reserve(facts.vertices);
        for (const vec3& position : placed->mesh->positions) {
            const dvec3 at = merged_position(instance, position, index_.origin);
            check_reach(at, scene_, i);
            placed->positions.emplace_back(at);
        }
        placed->attributes.assign(facts.vertices * index_.vertex_texels, vec4(0));
        write_vertex_rows(*placed->mesh, VertexTransform(instance.object_to_world), needs_, placed->attributes.data());
        return placed;
    }

    /// Returns the next triangles of the tables; null after the last ones.
    std::shared_ptr<Batch> next_batch() {
        auto batch = std::make_shared<Batch>();
        batch->first_triangle = next_triangle_;
        while (batch->triangles < kBatchTriangles) {
            if (rest_.count == 0) {
                rest_.mesh = next_mesh();
                if (!rest_.mesh) break;
                rest_.first = 0;
                rest_.count = rest_.mesh->mesh->triangles.size();
            }
            const std::size_t count = std::min(rest_.count, kBatchTriangles - batch->triangles);
            batch->pieces.push_back({rest_.mesh, rest_.first, count});
            batch->triangles += count;
            rest_.first += count;
            rest_.count -= count;
        }
        next_triangle_ += static_cast<std::uint32_t>(batch->triangles);
        return batch->triangles > 0 ? batch : nullptr;
    }

    void process(Batch& batch, const BucketTree& tree) const {
        BlockBuilder blocks(index_.vertex_texels, batch.blocks);
        batch.placed.reserve(batch.triangles);
        std::uint32_t id = batch.first_triangle;
        for (const Piece& piece : batch.pieces) {
            for (std::size_t t = piece.first; t < piece.first + piece.count; ++t) {
                const std::uint32_t material = piece.mesh->mesh->triangle_material[t];
                const std::uint32_t word =
                    placed_word(word_of(material, piece.mesh->lowest_alpha), piece.mesh->mirrored);
                blocks.add(*piece.mesh, t, word);
                BucketTriangle triangle;
                for (int k = 0; k < 3; ++k) {
                    const vec3& corner = piece.mesh->positions[piece.mesh->mesh->triangles[t][k]];
                    triangle.corners[static_cast<std::size_t>(k)] = corner;
                    batch.bounds.add(corner);
                }
                const auto& [a, b, c] = triangle.corners;
                batch.slivers = batch.slivers || is_sliver(a, b, c);
                const bool pane = shared::in_pane(word);
                if (emits_[material] || pane) batch.resident.push_back(id);
                batch.panes = batch.panes || pane;
                batch.alpha = batch.alpha || pane || (word & kTriangleAlpha) != 0;
                batch.one_sided = batch.one_sided || (word & kTriangleOneSided) != 0;
                triangle.id = id++, triangle.word = word;
                batch.placed.emplace_back(tree.bucket_of((a + b + c) / 3.0f), triangle);
            }
        }
        blocks.finish();
        batch.pieces.clear();
    }

    void add_resident(const std::vector<std::uint32_t>& triangles) {
        std::vector<std::uint32_t>& all = index_.geometry.resident;
        crowded_ = crowded_ || all.size() + triangles.size() > kMostResident;
        if (crowded_)
            all.clear();
        else
            all.insert(all.end(), triangles.begin(), triangles.end());
    }

    void write_rows(const BucketTree& tree, BucketFile& buckets, PageFileWriter& writer) {
        using Pointer = std::shared_ptr<Batch>;
        std::size_t done = 0;
        const auto first =
            tbb::make_filter<void, Pointer>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) {
                Pointer batch = next_batch();
                if (!batch) flow.stop();
                return batch;
            });
        const auto middle = tbb::make_filter<Pointer, Pointer>(tbb::filter_mode::parallel, [&](Pointer batch) {
            process(*batch, tree);
            return batch;
        });
        const auto last = tbb::make_filter<Pointer, void>(tbb::filter_mode::serial_in_order, [&](const Pointer& batch) {
            for (const std::string& block : batch->blocks) writer.add_block(block);
            for (const auto& [bucket, triangle] : batch->placed) buckets.add(bucket, triangle);
            index_.bounds.add(batch->bounds);
            add_resident(batch->resident);
            index_.slivers = index_.slivers || batch->slivers;
            index_.alpha = index_.alpha || batch->alpha;
            index_.one_sided = index_.one_sided || batch->one_sided;
            index_.panes = (index_.panes || batch->panes) && !crowded_;  // panes without rows are opaque
            done += batch->triangles;
            report(kSurveyShare, kRowShare, done, index_.triangles);
        });
        tbb::parallel_pipeline(2 * threads(), first & middle & last);
        cache_.clear();
        rest_ = {};
    }

    // --- Third step --------------------------------------------------------------------------------------------------

    void build(Slice& slice, const BucketFile& buckets) const {
        std::vector<BucketTriangle> triangles = buckets.read(slice.bucket, slice.first, slice.count);
        std::vector<rays::Corners> corners;
        std::vector<std::uint32_t> ids, words;
        corners.reserve(triangles.size());
        ids.reserve(triangles.size());
        words.reserve(triangles.size());
        for (const BucketTriangle& t : triangles) {
            corners.push_back(t.corners);
            ids.push_back(t.id);
            words.push_back(t.word);
        }
        triangles = {};
        PageSet& set = slice.set;
        set = build_pages(corners, ids, words, options_.limits);
        for (std::size_t i = 0; i + 1 < set.pages.size(); ++i) {
            slice.sizes.push_back(size_of(set.pages[i]));
            slice.encoded.push_back(encode(std::exchange(set.pages[i], {})));
        }
    }

    void write_page(PageFileWriter& writer, const std::string& encoded, const PageIndex::Size& size,
                    std::vector<PageRoot>& roots) {
        for (PageRoot& root : roots) {
            root.page = writer.pages();
            index_.roots.push_back(root);
        }
        writer.add_page(encoded, size);
    }
    void write_page(PageFileWriter& writer, RootedPage& page) {
        if (page.page.roots > 0) write_page(writer, encode(page.page), size_of(page.page), page.roots);
    }

    /// Writes the pages of a slice. The last one has room left, so it is merged with those of other slices.
    void write_slice(PageFileWriter& writer, Slice& slice) {
        append_above(index_.above, slice.set);
        std::vector<RootedPage> pages(slice.set.pages.size());
        for (const PageRoot& root : slice.set.roots) pages[root.page].roots.push_back(root);
        for (std::size_t i = 0; i < slice.encoded.size(); ++i)
            write_page(writer, slice.encoded[i], slice.sizes[i], pages[i].roots);
        RootedPage& last = pages.back();
        last.page = std::move(slice.set.pages.back());
        if (!append(rest_page_, last, options_.limits)) {
            if (bytes_in_slot(size_of(last.page)) < bytes_in_slot(size_of(rest_page_.page)))
                std::swap(last, rest_page_);
            write_page(writer, last);
        }
        index_.stack_entries = std::max(index_.stack_entries, slice.set.stack_entries);
    }

    void write_pages(std::uint32_t count, const BucketFile& buckets, PageFileWriter& writer) {
        using Pointer = std::shared_ptr<Slice>;
        const std::uint64_t most = 2 * std::uint64_t{options_.bucket_triangles};
        std::uint32_t bucket = 0;
        std::uint64_t begun = 0;  // triangles of the bucket in earlier slices
        std::size_t done = 0;
        const auto first =
            tbb::make_filter<void, Pointer>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) -> Pointer {
                while (bucket < count && begun == buckets.triangles(bucket)) ++bucket, begun = 0;
                if (bucket == count) {
                    flow.stop();
                    return nullptr;
                }
                auto slice = std::make_shared<Slice>();
                slice->bucket = bucket;
                slice->first = begun;
                slice->count = std::min(most, buckets.triangles(bucket) - begun);
                begun += slice->count;
                return slice;
            });
        const auto middle = tbb::make_filter<Pointer, Pointer>(tbb::filter_mode::parallel, [&](Pointer slice) {
            build(*slice, buckets);
            return slice;
        });
        const auto last = tbb::make_filter<Pointer, void>(tbb::filter_mode::serial_in_order, [&](const Pointer& slice) {
            write_slice(writer, *slice);
            done += slice->count;
            report(kSurveyShare + kRowShare, kPageShare, done, index_.triangles);
        });
        std::uint64_t largest = 1;
        for (std::uint32_t b = 0; b < count; ++b) largest = std::max(largest, std::min(most, buckets.triangles(b)));
        const std::size_t room = options_.memory / (largest * kBuildBytes);
        tbb::parallel_pipeline(std::clamp<std::size_t>(room, 1, threads() + 1), first & middle & last);
        write_page(writer, rest_page_);
    }

    MeshSource& source_;
    const Scene& scene_;
    const std::filesystem::path path_;
    const ConvertOptions& options_;
    const MemoryLedger::Entry memory_;
    const TriangleWords words_;
    const std::vector<std::uint32_t> opaque_words_;  // words of meshes whose vertices have alpha 1
    CentroidSample sample_;
    std::vector<bool> emits_;  // per material
    std::vector<MeshFacts> facts_;
    std::vector<std::size_t> uses_;  // per mesh: number of instances
    SceneNeeds needs_;
    PageIndex index_;
    // State of the second step:
    using Cached = std::pair<std::size_t, std::shared_ptr<const Mesh>>;
    std::list<Cached> cache_;  // meshes with several instances, latest use first
    std::size_t cached_bytes_ = 0;
    std::size_t next_instance_ = 0;
    std::uint32_t still_ = 0;  // instances before next_instance_ that do not move
    std::uint32_t next_triangle_ = 0;
    Piece rest_;
    RootedPage rest_page_;  // pages of earlier slices that have room left
    bool crowded_ = false;  // more than kMostResident triangles emit light or are panes
};

}  // namespace

PageFileSizes convert(MeshSource& source, const std::filesystem::path& path, const ConvertOptions& options) {
    return Converter(source, path, options).run();
}

}  // namespace halflight::paging
