#include "engine/rays/pairs.h"

#include <algorithm>
#include <bit>

#include "engine/tables/tables.h"

namespace halflight::rays {
namespace {

// Ratios of the area of the common box to the sum of both areas. Halves of parallelograms, for which it is 1/2, and
// similar pairs come first.
constexpr double kLimits[] = {0.6, 1.0};
// Entries of the edge table, 8 bytes each. A newer edge evicts an older one, so meshes whose neighbours are far apart
// in the file keep more unpaired triangles.
constexpr std::size_t kMostEdges = std::size_t{1} << 20;

constexpr std::uint32_t kNone = 0xffffffffu;

struct EdgeOf {
    std::uint32_t triangle = kNone;
    std::uint8_t apex = 0;  // corner that is not on the edge
};

vec3 corner(const Corners& triangle, int k) {
    return triangle[static_cast<std::size_t>(k % 3)];
}

Bounds box_of(const Corners& triangle) {
    Bounds box;
    for (const vec3& p : triangle) box.add(p);
    return box;
}

double half_area(const Bounds& box) {
    const dvec3 e(box.extent());
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

std::uint64_t hash_of(const vec3& p) {
    std::uint64_t h = 0;
    for (int a = 0; a < 3; ++a) {
        h = (h ^ std::bit_cast<std::uint32_t>(p[a] + 0.0f)) * 0x9e3779b97f4a7c15u;  // adding 0 gives -0 and 0 one hash
        h ^= h >> 29;
    }
    return h;
}

class Pairing {
  public:
    Pairing(std::span<const Corners> triangles, std::span<const std::uint32_t> words)
        : triangles_(triangles),
          words_(words),
          taken_(triangles.size()),
          edges_(std::min(std::bit_ceil(6 * triangles.size() + 1), kMostEdges)) {}

    std::vector<TrianglePair> pairs() {
        const auto count = static_cast<std::uint32_t>(triangles_.size());
        for (const double limit : kLimits) {
            std::ranges::fill(edges_, EdgeOf{});
            for (std::uint32_t i = 0; i < count; ++i)
                if (!taken_[i]) match(i, limit);
        }
        for (std::uint32_t i = 0; i < count; ++i)
            if (!taken_[i]) pairs_.push_back({{i, i}, {0, 0}, true});
        return std::move(pairs_);
    }

  private:
    EdgeOf& place_of(std::uint32_t triangle, int apex) {
        const Corners& t = triangles_[triangle];
        return edges_[(hash_of(corner(t, apex + 1)) + hash_of(corner(t, apex + 2))) & (edges_.size() - 1)];
    }

    /// Pairs the triangle with the best of its earlier neighbours, or stores it for a later one.
    void match(std::uint32_t triangle, double limit) {
        TrianglePair best{};
        bool found = false;
        for (int k = 0; k < 3; ++k) {
            const EdgeOf other = place_of(triangle, k);
            if (other.triangle == kNone || taken_[other.triangle] || facing(other.triangle) != facing(triangle))
                continue;
            const vec3 a = corner(triangles_[triangle], k + 1), b = corner(triangles_[triangle], k + 2);
            const vec3 c = corner(triangles_[other.triangle], other.apex + 1),
                       d = corner(triangles_[other.triangle], other.apex + 2);
            const bool reversed = a == c && b == d;
            const double growth = growth_of(other.triangle, triangle);
            if (!(reversed || (a == d && b == c)) || !(growth <= limit)) continue;
            limit = growth;
            found = true;
            best = {{other.triangle, triangle}, {other.apex, static_cast<std::uint8_t>(k)}, reversed};
        }
        if (found) {
            for (const std::uint32_t t : best.triangles) taken_[t] = true;
            pairs_.push_back(best);
        } else {
            for (int k = 0; k < 3; ++k) place_of(triangle, k) = {triangle, static_cast<std::uint8_t>(k)};
        }
    }

    std::uint32_t facing(std::uint32_t triangle) const {
        return words_.empty() ? 0 : words_[triangle] & (kTriangleOneSided | kTriangleMirrored);
    }

    double growth_of(std::uint32_t one, std::uint32_t other) const {
        Bounds both = box_of(triangles_[one]);
        const Bounds box = box_of(triangles_[other]);
        const double apart = half_area(both) + half_area(box);
        both.add(box);
        return half_area(both) / apart;
    }

    std::span<const Corners> triangles_;
    std::span<const std::uint32_t> words_;
    std::vector<bool> taken_;
    std::vector<EdgeOf> edges_;
    std::vector<TrianglePair> pairs_;
};

}  // namespace

std::array<std::uint8_t, 3> corners_in_pair(const TrianglePair& pair, int which) {
    const std::uint8_t apex = pair.apex[static_cast<std::size_t>(which)];
    const auto after = static_cast<std::uint8_t>((apex + 1) % 3), before = static_cast<std::uint8_t>((apex + 2) % 3);
    if (which == 0 || pair.reversed) return {before, after, apex};
    return {after, before, apex};
}

Ring ring_of(const TrianglePair& pair, std::span<const Corners> triangles) {
    const Corners &first = triangles[pair.triangles[0]], &second = triangles[pair.triangles[1]];
    const auto [start, end, apex] = corners_in_pair(pair, 0);
    return {first[start], first[apex], first[end], second[pair.apex[1]]};
}

std::vector<TrianglePair> pair_triangles(std::span<const Corners> triangles, std::span<const std::uint32_t> words) {
    return Pairing(triangles, words).pairs();
}

}  // namespace halflight::rays
