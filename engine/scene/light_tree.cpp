#include "engine/scene/light_tree.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "shaders/shared/word.h"

namespace halflight {
namespace {

constexpr int kBuckets = 12;

dvec3 any_perpendicular(const dvec3& v) {
    const dvec3 a = glm::abs(v);
    const dvec3 least = a.x <= a.y && a.x <= a.z ? dvec3(1, 0, 0) : a.y <= a.z ? dvec3(0, 1, 0) : dvec3(0, 0, 1);
    return glm::normalize(glm::cross(v, least));
}

/// Directions that a group's light takes, weighted by their cosines, in sr (Conty Estevez and Kulla 2018, eq. 1).
double orientation_measure(const LightBounds& b) {
    const double o = b.theta_o, w = std::min(o + b.theta_e, kPi);
    const double one_side = 2 * kPi * (1 - std::cos(o)) +
                            kPi / 2 * (2 * w * std::sin(o) - std::cos(o - 2 * w) - 2 * o * std::sin(o) + std::cos(o));
    return b.two_sided ? std::min(2 * one_side, 4 * kPi) : one_side;
}

/// Half of a box's surface; what is thin in two directions keeps a little for its length, so that lights on a line are
/// told apart.
double area_measure(const LightBounds& b) {
    const dvec3 e = b.upper - b.lower;
    return e.x * e.y + e.y * e.z + e.z * e.x + 1e-3 * glm::dot(e, e);
}

double cost(const LightBounds& b) {
    return b.intensity * orientation_measure(b) * area_measure(b);
}

class Builder {
  public:
    Builder(std::span<const LightBounds> lights, std::span<const std::uint32_t> names)
        : lights_(lights), names_(names), order_(lights.size()) {
        std::iota(order_.begin(), order_.end(), 0u);
        tree_.trails.resize(lights.size());
        tree_.rows.reserve(shared::kLightTreeHeaderTexels + (lights.size() - 1) * shared::kLightTreePairTexels);
        tree_.rows.resize(shared::kLightTreeHeaderTexels, vec4(0));
    }

    LightTree build() {
        add_pair(0, order_.size(), 0, 0);
        return std::move(tree_);
    }

  private:
    using Index = std::size_t;

    dvec3 centre(std::uint32_t light) const { return 0.5 * (lights_[light].lower + lights_[light].upper); }

    /// The children of lights [first, last) of order_, at the end of a way of `depth` steps. Returns the pair.
    std::uint32_t add_pair(Index first, Index last, std::uint32_t depth, std::uint32_t trail) {
        const auto pair = static_cast<std::uint32_t>((tree_.rows.size() - shared::kLightTreeHeaderTexels) /
                                                     shared::kLightTreePairTexels);
        tree_.rows.resize(tree_.rows.size() + shared::kLightTreePairTexels);
        const Index middle = split(first, last, depth);
        const std::array<LightBounds, 2> bounds{bounds_of(first, middle), bounds_of(middle, last)};
        const double brighter = std::max(bounds[0].intensity, bounds[1].intensity);
        for (std::uint32_t k = 0; k < 2; ++k) {
            const Index from = k == 0 ? first : middle, to = k == 0 ? middle : last;
            const std::uint32_t way = trail | (k << depth);
            std::uint32_t word = bounds[k].two_sided ? shared::kLightTreeTwoSided : 0;
            if (to - from == 1) {
                word |= shared::kLightTreeLeaf | names_[order_[from]];
                tree_.trails[order_[from]] = way;
            } else {
                word |= add_pair(from, to, depth + 1, way);
            }
            write(pair, k, bounds[k], brighter, word);
        }
        return pair;
    }

    LightBounds bounds_of(Index first, Index last) const {
        LightBounds all = lights_[order_[first]];
        for (Index i = first + 1; i < last; ++i) all = united(all, lights_[order_[i]]);
        return all;
    }

    /// Orders [first, last) so that the two parts are before and after what is returned.
    Index split(Index first, Index last, std::uint32_t depth) {
        assert(last - first >= 2 && last - first <= std::size_t{1} << (shared::kLightTreeDepth - depth));
        if (last - first == 2) return first + 1;
        dvec3 lower = centre(order_[first]), upper = lower;
        for (Index i = first; i < last; ++i) {
            lower = glm::min(lower, centre(order_[i]));
            upper = glm::max(upper, centre(order_[i]));
        }
        if (const auto plane = best_plane(first, last, depth, lower, upper)) {
            const auto [axis, bucket] = *plane;
            const auto before = [&, a = axis, b = bucket](std::uint32_t light) {
                return bucket_of(light, a, lower, upper) <= b;
            };
            const auto at = order_.begin();
            const auto middle = std::stable_partition(at + static_cast<std::ptrdiff_t>(first),
                                                      at + static_cast<std::ptrdiff_t>(last), before);
            return static_cast<Index>(middle - at);
        }
        return split_evenly(first, last, upper - lower);
    }

    /// Lights in one place, or ways that have become so long that only even splits bring them to an end.
    Index split_evenly(Index first, Index last, const dvec3& extent) {
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        const Index middle = first + (last - first) / 2;
        const auto at = [&](Index i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(first), at(middle), at(last), [&](std::uint32_t a, std::uint32_t b) {
            const double ca = centre(a)[axis], cb = centre(b)[axis];
            return ca != cb ? ca < cb : a < b;
        });
        // What is left of chance in the order within a part.
        std::sort(at(first), at(middle)), std::sort(at(middle), at(last));
        return middle;
    }

    int bucket_of(std::uint32_t light, int axis, const dvec3& lower, const dvec3& upper) const {
        const double at = (centre(light)[axis] - lower[axis]) / (upper[axis] - lower[axis]);
        return std::clamp(static_cast<int>(at * kBuckets), 0, kBuckets - 1);
    }

    struct Plane {
        int axis;
        int bucket;  // the last one of the first part
    };
    /// The best split between buckets; none where each would leave a part that is too large for the ways left to it.
    std::optional<Plane> best_plane(Index first, Index last, std::uint32_t depth, const dvec3& lower,
                                    const dvec3& upper) const {
        const Index most = Index{1} << (shared::kLightTreeDepth - depth - 1);
        const dvec3 extent = upper - lower;
        const double longest = std::max({extent.x, extent.y, extent.z});
        std::optional<Plane> best;
        double least = std::numeric_limits<double>::infinity();
        for (int axis = 0; axis < 3; ++axis) {
            if (!(extent[axis] > 0)) continue;
            std::array<std::optional<LightBounds>, kBuckets> buckets;
            std::array<Index, kBuckets> counts{};
            for (Index i = first; i < last; ++i) {
                const auto b = static_cast<std::size_t>(bucket_of(order_[i], axis, lower, upper));
                add(buckets[b], lights_[order_[i]]);
                ++counts[b];
            }
            std::array<double, kBuckets> after{};  // cost of the buckets after each
            std::optional<LightBounds> part;
            for (std::size_t b = kBuckets - 1; b > 0; --b) {
                if (buckets[b]) add(part, *buckets[b]);
                after[b - 1] = part ? cost(*part) : 0;
            }
            part.reset();
            Index count = 0;
            for (std::size_t b = 0; b + 1 < kBuckets; ++b) {
                if (buckets[b]) add(part, *buckets[b]);
                count += counts[b];
                if (count == 0 || count == last - first || std::max(count, last - first - count) > most) continue;
                // Thin slices of long groups are worth less (the paper's K_r).
                const double sum = (cost(*part) + after[b]) * longest / extent[axis];
                if (sum < least) least = sum, best = Plane{axis, static_cast<int>(b)};
            }
        }
        return best;
    }

    static void add(std::optional<LightBounds>& to, const LightBounds& more) { to = to ? united(*to, more) : more; }

    /// Rounded outwards, so that what the shaders bound holds the lights.
    void write(std::uint32_t pair, std::uint32_t which, const LightBounds& b, double brighter, std::uint32_t word) {
        constexpr double kRoundings = 1e-6, kAngle = 1e-3;  // angles near 0 are known to half of a float's bits
        const vec3 centre(0.5 * (b.lower + b.upper));
        const double radius = glm::length(glm::max(b.upper - dvec3(centre), dvec3(centre) - b.lower));
        const auto cosine = [](double angle, double most) {
            return static_cast<float>(angle + kAngle >= most ? std::cos(most) : std::cos(angle + kAngle));
        };
        vec4* row = &tree_.rows[shared::kLightTreeHeaderTexels + std::size_t{pair} * shared::kLightTreePairTexels +
                                which * shared::kLightTreeNodeTexels];
        row[0] = vec4(centre, static_cast<float>(radius * (1 + kRoundings)));
        row[1] = vec4(vec3(b.axis), cosine(b.theta_o, kPi));
        row[2] = vec4(std::max(cosine(b.theta_e, kPi / 2), 0.0f), static_cast<float>(b.intensity / brighter), 0,
                      shared::float_of_word(word));
    }

    std::span<const LightBounds> lights_;
    std::span<const std::uint32_t> names_;
    std::vector<std::uint32_t> order_;
    LightTree tree_;
};

const vec4* node_row(std::span<const vec4> rows, std::uint32_t pair, int which) {
    return &rows[shared::kLightTreeHeaderTexels + std::size_t{pair} * shared::kLightTreePairTexels +
                 static_cast<std::size_t>(which * shared::kLightTreeNodeTexels)];
}

}  // namespace

LightBounds united(const LightBounds& a, const LightBounds& b) {
    LightBounds all = a.theta_o >= b.theta_o ? a : b;
    const LightBounds& other = a.theta_o >= b.theta_o ? b : a;
    all.lower = glm::min(a.lower, b.lower);
    all.upper = glm::max(a.upper, b.upper);
    all.theta_e = std::max(a.theta_e, b.theta_e);
    all.intensity = a.intensity + b.intensity;
    all.two_sided = a.two_sided || b.two_sided;
    if (all.theta_o >= kPi) return all;
    // Of axes that go both ways, the nearer ones.
    const double cosine = glm::dot(all.axis, other.axis);
    const dvec3 axis = all.two_sided && cosine < 0 ? -other.axis : other.axis;
    const double between = std::atan2(glm::length(glm::cross(all.axis, axis)), glm::dot(all.axis, axis));
    if (std::min(between + other.theta_o, kPi) <= all.theta_o) return all;
    const double widened = 0.5 * (all.theta_o + between + other.theta_o);
    if (widened >= kPi) {
        all.theta_o = kPi;
        return all;
    }
    // Turned towards the other axis, about whichever way that is where they are opposite.
    const dvec3 across = axis - glm::dot(axis, all.axis) * all.axis;
    const double length = glm::length(across);
    const dvec3 towards = length > 1e-9 ? across / length : any_perpendicular(all.axis);
    const double turned = widened - all.theta_o;
    all.axis = glm::normalize(std::cos(turned) * all.axis + std::sin(turned) * towards);
    all.theta_o = widened;
    return all;
}

LightTree build_light_tree(std::span<const LightBounds> lights, std::span<const std::uint32_t> names) {
    return Builder(lights, names).build();
}

shared::LightNode light_node(std::span<const vec4> rows, std::uint32_t pair, int which) {
    const vec4* row = node_row(rows, pair, which);
    return {vec3(row[0]),
            row[0].w,
            vec3(row[1]),
            row[1].w,
            row[2].x,
            row[2].y,
            (light_node_word(rows, pair, which) & shared::kLightTreeTwoSided) != 0};
}

std::uint32_t light_node_word(std::span<const vec4> rows, std::uint32_t pair, int which) {
    return shared::word_of_float(node_row(rows, pair, which)[2].w);
}

}  // namespace halflight
