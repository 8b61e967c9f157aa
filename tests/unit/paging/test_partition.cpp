// Tests the partition of triangles into buckets.
#include "engine/paging/partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tools/common/temporary_folder.h"

namespace halflight::paging {
namespace {

TEST(CentroidSample, IsASetThatDoesNotDependOnTheOrder) {
    std::vector<std::uint64_t> keys(100000);
    for (std::size_t i = 0; i < keys.size(); ++i) keys[i] = (i % 7 << 32) | i;
    const auto sample = [&](const std::vector<std::uint64_t>& order) {
        CentroidSample result(1000);
        for (const std::uint64_t key : order)
            if (result.takes(key)) result.add(key, dvec3(static_cast<double>(key & 0xffffffff), 0, 0));
        std::vector<vec3> points = result.centroids(dvec3(0));
        std::ranges::sort(points, {}, [](const vec3& p) { return p.x; });
        return points;
    };
    const std::vector<vec3> points = sample(keys);
    EXPECT_GT(points.size(), 400u);
    EXPECT_LE(points.size(), 1000u);
    std::mt19937 random(3);
    std::ranges::shuffle(keys, random);
    EXPECT_EQ(sample(keys), points);
    // The sample is uniform: its mean is that of all, 50000 +- 29000 / sqrt(n).
    double sum = 0;
    for (const vec3& p : points) sum += double(p.x);
    EXPECT_NEAR(sum / static_cast<double>(points.size()), 50000, 5 * 29000 / std::sqrt(points.size()));
}

TEST(BucketTree, BucketsAreBalancedAndAFunctionOfTheSet) {
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    std::vector<vec3> points(20000);
    for (vec3& p : points) p = vec3(100 * normal(random), normal(random), normal(random) * normal(random));
    const BucketTree tree(points, 300);
    std::vector<std::size_t> counts(tree.buckets(), 0);
    for (const vec3& p : points) ++counts[tree.bucket_of(p)];
    for (const std::size_t count : counts) {
        EXPECT_LE(count, 300u);
        EXPECT_GE(count, 140u);
    }
    std::vector<vec3> shuffled = points;
    std::ranges::shuffle(shuffled, random);
    const BucketTree again(shuffled, 300);
    for (const vec3& p : points) ASSERT_EQ(again.bucket_of(p), tree.bucket_of(p));
}

TEST(BucketTree, PointsInOnePlaceStayTogether) {
    EXPECT_EQ(BucketTree({}, 10).buckets(), 1u);
    EXPECT_EQ(BucketTree(std::vector<vec3>(1000, vec3(3)), 10).buckets(), 1u);
    std::vector<vec3> points(1000, vec3(3));
    points.emplace_back(5, 3, 3);
    points.emplace_back(3, 4, 3);
    const BucketTree tree(points, 10);
    EXPECT_EQ(tree.buckets(), 3u);
    EXPECT_NE(tree.bucket_of(vec3(5, 3, 3)), tree.bucket_of(vec3(3)));
    EXPECT_NE(tree.bucket_of(vec3(3, 4, 3)), tree.bucket_of(vec3(3)));
}

TEST(BucketFile, ReturnsTrianglesInTheirOrder) {
    const TemporaryFolder folder;
    BucketFile file(folder.path, "subject", 5, 1);  // the least buffers: 64 triangles
    std::vector<std::vector<std::uint32_t>> ids(5);
    std::mt19937 random(9);
    for (std::uint32_t id = 0; id < 3000; ++id) {
        const auto bucket = static_cast<std::uint32_t>(random() % 4);
        const vec3 corner(static_cast<float>(id));
        file.add(bucket, {{corner, corner + 1.0f, corner + 2.0f}, id});
        ids[bucket].push_back(id);
    }
    EXPECT_TRUE(folder.entries().empty()) << "the file has no name";
    file.finish();
    for (std::uint32_t bucket = 0; bucket < 5; ++bucket) {
        ASSERT_EQ(file.triangles(bucket), ids[bucket].size());
        for (const std::size_t first : {0, 1, 64, 100, 500}) {
            if (first > ids[bucket].size()) continue;
            const std::size_t count = std::min<std::size_t>(ids[bucket].size() - first, 170);
            const std::vector<BucketTriangle> triangles = file.read(bucket, first, count);
            ASSERT_EQ(triangles.size(), count);
            for (std::size_t i = 0; i < count; ++i) {
                ASSERT_EQ(triangles[i].id, ids[bucket][first + i]);
                ASSERT_EQ(triangles[i].corners[2], vec3(static_cast<float>(triangles[i].id) + 2.0f));
            }
        }
    }
}

}  // namespace
}  // namespace halflight::paging
