#include "engine/paging/partition.h"

#include <algorithm>
#include <cassert>
#include <span>

namespace halflight::paging {

// --- Sample ----------------------------------------------------------------------------------------------------------

std::uint64_t CentroidSample::mixed(std::uint64_t key) {
    // SplitMix64 (Steele, Lea, Flood 2014).
    key += 0x9e3779b97f4a7c15u;
    key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9u;
    key = (key ^ (key >> 27)) * 0x94d049bb133111ebu;
    return key ^ (key >> 31);
}

void CentroidSample::add(std::uint64_t key, const dvec3& centroid) {
    entries_.push_back({key, centroid});
    while (entries_.size() > most_) {
        threshold_ /= 2;
        std::erase_if(entries_, [&](const Entry& e) { return !takes(e.key); });
    }
}

std::vector<vec3> CentroidSample::centroids(const dvec3& origin) const {
    std::vector<vec3> points;
    points.reserve(entries_.size());
    for (const Entry& e : entries_) points.emplace_back(e.centroid - origin);
    return points;
}

// --- Tree ------------------------------------------------------------------------------------------------------------

BucketTree::BucketTree(std::vector<vec3> sample, std::size_t most) {
    split(sample, std::max<std::size_t>(most, 1));
}

void BucketTree::split(std::span<vec3> points, std::size_t most) {
    const std::size_t index = nodes_.size();
    nodes_.emplace_back();
    Bounds box;
    for (const vec3& p : points) box.add(p);
    const vec3 extent = box.extent();
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    if (points.size() <= most || !(extent[axis] > 0)) {
        nodes_[index].other = buckets_++;
        return;
    }
    const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
    std::ranges::nth_element(points, middle, {}, [axis](const vec3& p) { return p[axis]; });
    float plane = (*middle)[axis];
    // At the lower end, all points would be on one side: the next value above is the plane.
    if (plane == box.lower[axis]) {
        plane = box.upper[axis];
        for (const vec3& p : points)
            if (p[axis] > box.lower[axis]) plane = std::min(plane, p[axis]);
    }
    const auto above = std::partition(points.begin(), points.end(), [&](const vec3& p) { return p[axis] < plane; });
    const auto below = static_cast<std::size_t>(above - points.begin());
    split(points.first(below), most);
    nodes_[index] = {axis, plane, static_cast<std::uint32_t>(nodes_.size())};
    split(points.subspan(below), most);
}

std::uint32_t BucketTree::bucket_of(const vec3& point) const {
    std::uint32_t node = 0;
    while (nodes_[node].axis != kLeaf)
        node = point[nodes_[node].axis] < nodes_[node].plane ? node + 1 : nodes_[node].other;
    return nodes_[node].other;
}

// --- File ------------------------------------------------------------------------------------------------------------

BucketFile::BucketFile(const std::filesystem::path& folder, const std::string& subject, std::uint32_t buckets,
                       std::size_t buffer_bytes)
    : file_(folder, subject), buckets_(buckets) {
    constexpr std::size_t kLeast = 64, kMost = 4096;  // triangles: pieces of 2.5 KiB to 160 KiB
    const std::size_t room = buffer_bytes / std::max(buckets, 1u) / sizeof(BucketTriangle);
    buffer_triangles_ = std::clamp(room, kLeast, kMost);
}

void BucketFile::add(std::uint32_t bucket, const BucketTriangle& triangle) {
    Bucket& b = buckets_[bucket];
    if (b.buffer.capacity() == 0) b.buffer.reserve(buffer_triangles_);
    b.buffer.push_back(triangle);
    ++b.triangles;
    if (b.buffer.size() == buffer_triangles_) write(b);
}

void BucketFile::write(Bucket& bucket) {
    bucket.places.push_back(file_.size());
    file_.append({reinterpret_cast<const char*>(bucket.buffer.data()), bucket.buffer.size() * sizeof(BucketTriangle)});
    bucket.buffer.clear();
}

void BucketFile::finish() {
    for (Bucket& bucket : buckets_) {
        if (!bucket.buffer.empty()) write(bucket);
        bucket.buffer = {};
    }
}

std::vector<BucketTriangle> BucketFile::read(std::uint32_t bucket, std::uint64_t first, std::uint64_t count) const {
    assert(first + count <= buckets_[bucket].triangles && buckets_[bucket].buffer.empty());
    std::vector<BucketTriangle> triangles(count);
    for (std::uint64_t done = 0; done < count;) {
        const std::uint64_t at = first + done;
        const std::uint64_t within = at % buffer_triangles_;
        const std::uint64_t now = std::min(buffer_triangles_ - within, count - done);
        file_.read(buckets_[bucket].places[at / buffer_triangles_] + within * sizeof(BucketTriangle),
                   {reinterpret_cast<char*>(triangles.data() + done), now * sizeof(BucketTriangle)});
        done += now;
    }
    return triangles;
}

}  // namespace halflight::paging
