// Partition of more triangles than fit into memory into buckets of consecutive space. No OpenGL is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/core/math.h"
#include "engine/io/files.h"
#include "engine/rays/pairs.h"

namespace halflight::paging {

/// A sample of the centroids of all triangles. It depends on the set of triangles, not on their order.
class CentroidSample {
  public:
    explicit CentroidSample(std::size_t most = kMost) : most_(most) {}
    static constexpr std::size_t kMost = std::size_t{1} << 19;

    /// Returns whether the sample takes a triangle, as long as it grows no further. `key` is unique per triangle.
    bool takes(std::uint64_t key) const { return mixed(key) <= threshold_; }
    /// Adds a triangle for which takes() is true. A sample that grows too large drops half of its triangles.
    void add(std::uint64_t key, const dvec3& centroid);
    std::size_t size() const { return entries_.size(); }
    /// Returns the centroids relative to an origin.
    std::vector<vec3> centroids(const dvec3& origin) const;

  private:
    static std::uint64_t mixed(std::uint64_t key);

    struct Entry {
        std::uint64_t key;
        dvec3 centroid;
    };
    std::size_t most_;
    std::uint64_t threshold_ = ~std::uint64_t{0};
    std::vector<Entry> entries_;
};

/// A kd-tree, whose leaves are the buckets. Its planes are medians of a sample.
class BucketTree {
  public:
    /// Splits until no bucket has more than `most` points of the sample; points in one place stay together.
    BucketTree(std::vector<vec3> sample, std::size_t most);
    std::uint32_t buckets() const { return buckets_; }
    /// Returns the bucket of a point. Consecutive buckets are neighbours.
    std::uint32_t bucket_of(const vec3& point) const;

  private:
    struct Node {
        int axis = kLeaf;
        float plane = 0;          // points below the plane are in the first child
        std::uint32_t other = 0;  // index of the second child; the first one follows its parent; leaf: the bucket
    };
    static constexpr int kLeaf = 3;
    void split(std::span<vec3> points, std::size_t most);

    std::vector<Node> nodes_;
    std::uint32_t buckets_ = 0;
};

/// A triangle in a bucket.
struct BucketTriangle {
    rays::Corners corners;   // relative to TraceTables::origin
    std::uint32_t id = 0;    // index into TraceTables::triangles
    std::uint32_t word = 0;  // flags and material (engine/tables/tables.h)
};

/// Contents of buckets, in a temporary file.
class BucketFile {
  public:
    /// Creates the file in a folder. Errors name `subject`. buffer_bytes: memory for all buckets together.
    BucketFile(const std::filesystem::path& folder, const std::string& subject, std::uint32_t buckets,
               std::size_t buffer_bytes);
    void add(std::uint32_t bucket, const BucketTriangle& triangle);
    /// Writes what is still in memory. Call it once, before read().
    void finish();
    std::uint64_t triangles(std::uint32_t bucket) const { return buckets_[bucket].triangles; }
    /// Reads triangles [first, first + count) of a bucket, in the order in which they were added. Thread-safe.
    std::vector<BucketTriangle> read(std::uint32_t bucket, std::uint64_t first, std::uint64_t count) const;

  private:
    struct Bucket {
        std::vector<BucketTriangle> buffer;
        std::vector<std::uint64_t> places;  // offset of each piece of buffer_triangles_ triangles; the last may be less
        std::uint64_t triangles = 0;
    };
    void write(Bucket& bucket);

    ScratchFile file_;
    std::size_t buffer_triangles_;
    std::vector<Bucket> buckets_;
};

}  // namespace halflight::paging
