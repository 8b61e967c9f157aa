#include "engine/tables/light_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace halflight {
namespace {

constexpr int kBuckets = 12;
constexpr std::uint32_t kBitsPerStep = 2;  // bits of a trail per step
constexpr double kRoundings = 1e-6;        // relative margin, larger than the roundings of a few floats

dvec3 any_perpendicular(const dvec3& v) {
    const dvec3 a = glm::abs(v);
    const dvec3 least = a.x <= a.y && a.x <= a.z ? dvec3(1, 0, 0) : a.y <= a.z ? dvec3(0, 1, 0) : dvec3(0, 0, 1);
    return glm::normalize(glm::cross(v, least));
}

double angle_between(const dvec3& a, const dvec3& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Returns the octahedral coordinates in 127 steps per axis, v in the second byte.
std::uint32_t octahedral_steps(const dvec3& axis) {
    const dvec3 a = axis / (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
    const auto fold = [&](double at, double other) { return a.z < 0 ? std::copysign(1 - std::abs(other), at) : at; };
    const auto step = [](double at) { return static_cast<std::uint32_t>(std::lround((1 + at) * 127)); };
    return step(fold(a.x, a.y)) | step(fold(a.y, a.x)) << 8;
}

/// Returns the cosine-weighted solid angle, sr, into which a group emits (Conty Estevez and Kulla 2018, eq. 1).
double orientation_measure(const LightBounds& b) {
    const double o = b.theta_o, w = std::min(o + b.theta_e, kPi);
    const double one_side = 2 * kPi * (1 - std::cos(o)) +
                            kPi / 2 * (2 * w * std::sin(o) - std::cos(o - 2 * w) - 2 * o * std::sin(o) + std::cos(o));
    return b.two_sided ? std::min(2 * one_side, 4 * kPi) : one_side;
}

/// Returns half of a box's surface area, plus a little for its extent. This separates lights on a line, whose boxes
/// have no area.
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
        : lights_(lights), names_(names), order_(lights.size()), trails_(lights.size()) {
        std::iota(order_.begin(), order_.end(), 0u);
    }

    LightTree build() {
        const LightBounds all = bounds_of(0, order_.size());
        const vec3 centre(0.5 * (all.lower + all.upper));
        const vec4 ball(centre, static_cast<float>(reach(all, centre)));
        add_nodes(1);
        fill(0, {0, order_.size(), all}, ball, 0, 0);
        LightTree tree;
        tree.rows.assign(shared::kLightTreeHeaderTexels, uvec4(0));
        tree.rows.insert(tree.rows.end(), children_.begin(), children_.end());
        tree.rows[0].w = static_cast<std::uint32_t>(tree.rows.size());
        tree.rows[1] = glm::floatBitsToUint(ball);
        tree.rows[2].x = glm::floatBitsToUint(static_cast<float>(brightest_));
        for (const auto& lights : leaves_) tree.rows.insert(tree.rows.end(), lights.begin(), lights.end());
        tree.trails = std::move(trails_);
        return tree;
    }

  private:
    using Index = std::size_t;

    dvec3 centre(std::uint32_t light) const { return 0.5 * (lights_[light].lower + lights_[light].upper); }

    struct Part {  // lights [first, last) of order_
        Index first, last;
        LightBounds bounds;
        Index count() const { return last - first; }
    };

    /// Appends nodes without children. Returns the index of the first one.
    std::uint32_t add_nodes(std::size_t count) {
        const std::size_t first = leaves_.size();
        leaves_.resize(first + count, {uvec4(0), uvec4(0)});
        children_.resize(leaves_.size() * shared::kLightTreeWidth, uvec4(0, 0, 0, shared::kLightTreeNone));
        return static_cast<std::uint32_t>(first);
    }

    /// Builds a node and all nodes below. `depth`: bits of the trail to it. `ball`: its bounds, as decoded.
    void fill(std::uint32_t node, const Part& all, const vec4& ball, std::uint32_t depth, std::uint32_t trail) {
        const std::vector<Part> parts = parts_of(all, depth);
        double brightest = 0;
        for (const Part& part : parts) brightest = std::max(brightest, part.bounds.intensity);
        if (node == 0) brightest_ = brightest;
        const auto inner = static_cast<std::uint32_t>(
            std::count_if(parts.begin(), parts.end(), [&](const Part& part) { return !is_leaf(part); }));
        const std::uint32_t below = add_nodes(inner);
        const std::uint32_t links[] = {below & shared::kLightTreeLinkMask, below >> shared::kLightTreeLinkBits, 0, 0};
        for (std::uint32_t k = 0; k < parts.size(); ++k) {
            const Part& part = parts[k];
            const std::uint32_t way = trail | (k << depth);
            const std::uint32_t kind = k < inner           ? 0
                                       : part.count() == 2 ? shared::kLightTreeLeaf | shared::kLightTreePair
                                                           : shared::kLightTreeLeaf;
            const uvec4 child = encoded(part.bounds, ball, brightest, links[k] | kind);
            children_[std::size_t{node} * shared::kLightTreeWidth + k] = child;
            if (k < inner) {
                leaves_[node][1][static_cast<int>(k)] = part.bounds.sized ? 1 : 0;
                const shared::LightNode bounds = shared::light_child(child, ball);
                fill(below + k, part, vec4(bounds.centre, bounds.radius), depth + kBitsPerStep, way);
            } else {
                for (std::uint32_t second = 0; second < part.count(); ++second) {
                    const std::uint32_t light = order_[part.first + second];
                    leaves_[node][second][static_cast<int>(k)] = names_[light];
                    trails_[light] = way | second << (depth + kBitsPerStep);
                }
            }
        }
    }

    /// Returns whether lights form a leaf: one, or two that act as one.
    bool is_leaf(const Part& part) const {
        if (part.count() != 2) return part.count() == 1;
        return act_as_one(lights_[order_[part.first]], lights_[order_[part.first + 1]]);
    }

    /// Splits lights into four parts, or into one per light; leaves come last. The part of the highest cost is split
    /// first, unless another part is too large for the remaining depth.
    std::vector<Part> parts_of(const Part& all, std::uint32_t depth) {
        const Index most = Index{1} << (shared::kLightTreeDepth - depth - kBitsPerStep);
        std::vector<Part> parts{all};
        while (parts.size() < shared::kLightTreeWidth) {
            auto next = parts.end();
            double greatest = -1;
            for (auto part = parts.begin(); part != parts.end(); ++part) {
                if (part->count() < 2) continue;
                const double worth = part->count() > most ? std::numeric_limits<double>::infinity()
                                     : is_leaf(*part)     ? 0
                                                          : cost(part->bounds);
                if (worth > greatest) greatest = worth, next = part;
            }
            if (next == parts.end()) break;
            const Index middle = split(next->first, next->last, parts.size() == 1 ? 2 * most : most);
            const Part rest{middle, next->last, bounds_of(middle, next->last)};
            *next = {next->first, middle, bounds_of(next->first, middle)};
            parts.insert(next + 1, rest);
        }
        std::stable_partition(parts.begin(), parts.end(), [&](const Part& part) { return !is_leaf(part); });
        return parts;
    }

    LightBounds bounds_of(Index first, Index last) const {
        LightBounds all = lights_[order_[first]];
        for (Index i = first + 1; i < last; ++i) all = united(all, lights_[order_[i]]);
        return all;
    }

    /// Partitions [first, last) into two parts of at most `most` lights and returns the start of the second.
    Index split(Index first, Index last, Index most) {
        assert(last - first >= 2 && last - first <= 2 * most);
        if (last - first == 2) return first + 1;
        dvec3 lower = centre(order_[first]), upper = lower;
        for (Index i = first; i < last; ++i) {
            lower = glm::min(lower, centre(order_[i]));
            upper = glm::max(upper, centre(order_[i]));
        }
        if (const auto plane = best_plane(first, last, most, lower, upper)) {
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

    /// Splits evenly. Lights at one position need this, and so do depths that allow nothing else.
    Index split_evenly(Index first, Index last, const dvec3& extent) {
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        const Index middle = first + (last - first) / 2;
        const auto at = [&](Index i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(first), at(middle), at(last), [&](std::uint32_t a, std::uint32_t b) {
            const double ca = centre(a)[axis], cb = centre(b)[axis];
            return ca != cb ? ca < cb : a < b;
        });
        // Sorting removes the arbitrary order within a part.
        std::sort(at(first), at(middle)), std::sort(at(middle), at(last));
        return middle;
    }

    int bucket_of(std::uint32_t light, int axis, const dvec3& lower, const dvec3& upper) const {
        const double at = (centre(light)[axis] - lower[axis]) / (upper[axis] - lower[axis]);
        return std::clamp(static_cast<int>(at * kBuckets), 0, kBuckets - 1);
    }

    struct Plane {
        int axis;
        int bucket;  // the last bucket of the first part
    };
    /// Returns the best split between buckets; none if every split would leave a part of more than `most` lights.
    std::optional<Plane> best_plane(Index first, Index last, Index most, const dvec3& lower, const dvec3& upper) const {
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
            std::array<double, kBuckets> after{};  // cost of the buckets after each one
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

    /// Returns the distance from a place to the farthest corner of the lights' box, rounded up.
    static double reach(const LightBounds& b, const vec3& from) {
        return glm::length(glm::max(b.upper - dvec3(from), dvec3(from) - b.lower)) * (1 + kRoundings);
    }

    /// Packs bounds, rounded outwards so that the decoded bounds hold the lights. `word` holds link and kind.
    static uvec4 encoded(const LightBounds& b, const vec4& ball, double brightest, std::uint32_t word) {
        const auto step = [&](double length, double zero, bool up) {  // converts a length to steps of 2^-15 radii
            const double at = ball.w > 0 ? zero + length / double(ball.w) * 32768 : zero;
            return static_cast<std::uint32_t>(std::clamp(up ? std::ceil(at) : std::round(at), 0.0, 65535.0));
        };
        const dvec3 from = 0.5 * (b.lower + b.upper) - dvec3(ball);
        uvec4 child(step(from.x, 32768, false) | step(from.y, 32768, false) << 16, step(from.z, 32768, false),
                    octahedral_steps(b.axis), word);
        const shared::LightNode rounded = shared::light_child(child, ball);
        child.y |= step(reach(b, rounded.centre), 0, true) << 16;
        const double theta_o = std::min(b.theta_o + angle_between(dvec3(rounded.axis), b.axis) + kRoundings, kPi);
        child.z |= static_cast<std::uint32_t>(std::min(std::ceil(std::sin(0.5 * theta_o) * 255), 255.0)) << 16;
        child.z |= static_cast<std::uint32_t>(std::max(std::floor((std::cos(b.theta_e) - kRoundings) * 255), 0.0))
                   << 24;
        child.w |= b.two_sided ? shared::kLightTreeTwoSided : 0;
        child.w |= glm::floatBitsToUint(static_cast<float>(b.intensity / brightest)) & 0xffff0000u;
        return child;
    }

    std::span<const LightBounds> lights_;
    std::span<const std::uint32_t> names_;
    std::vector<std::uint32_t> order_;
    std::vector<std::uint32_t> trails_;
    double brightest_ = 0;                      // intensity of the root's brightest child, cd
    std::vector<uvec4> children_;               // kLightTreeWidth texels per node
    std::vector<std::array<uvec4, 2>> leaves_;  // names of the lights of each node
};

}  // namespace

LightBounds united(const LightBounds& a, const LightBounds& b) {
    LightBounds all = a.theta_o >= b.theta_o ? a : b;
    const LightBounds& other = a.theta_o >= b.theta_o ? b : a;
    all.lower = glm::min(a.lower, b.lower);
    all.upper = glm::max(a.upper, b.upper);
    all.theta_e = std::max(a.theta_e, b.theta_e);
    all.intensity = a.intensity + b.intensity;
    all.two_sided = a.two_sided || b.two_sided;
    all.sized = a.sized || b.sized;
    if (all.theta_o >= kPi) return all;
    // A two-sided axis counts by its nearer direction.
    const double cosine = glm::dot(all.axis, other.axis);
    const dvec3 axis = all.two_sided && cosine < 0 ? -other.axis : other.axis;
    const double between = angle_between(all.axis, axis);
    if (std::min(between + other.theta_o, kPi) <= all.theta_o) return all;
    const double widened = 0.5 * (all.theta_o + between + other.theta_o);
    if (widened >= kPi) {
        all.theta_o = kPi;
        return all;
    }
    // Rotates one axis towards the other; if they are opposite, rotates about any perpendicular.
    const dvec3 across = axis - glm::dot(axis, all.axis) * all.axis;
    const double length = glm::length(across);
    const dvec3 towards = length > 1e-9 ? across / length : any_perpendicular(all.axis);
    const double turned = widened - all.theta_o;
    all.axis = glm::normalize(std::cos(turned) * all.axis + std::sin(turned) * towards);
    all.theta_o = widened;
    return all;
}

bool act_as_one(const LightBounds& a, const LightBounds& b) {
    const LightBounds both = united(a, b);
    const auto size = [](const LightBounds& x) { return glm::length(x.upper - x.lower); };
    const auto centre = [](const LightBounds& x) { return 0.5 * (x.lower + x.upper); };
    const double apart = glm::dot(both.axis, centre(a) - centre(b));
    const double brighter = std::max(a.intensity, b.intensity), wider = std::max(a.theta_o, b.theta_o);
    return brighter <= 1.25 * std::min(a.intensity, b.intensity) && both.theta_o <= wider + 0.02 &&
           a.theta_e == b.theta_e && a.two_sided == b.two_sided && std::abs(apart) <= 0.05 * size(both) &&
           size(both) <= 1.3 * std::max(size(a), size(b));  // rectangles have at most 1.27
}

LightTree build_light_tree(std::span<const LightBounds> lights, std::span<const std::uint32_t> names) {
    return Builder(lights, names).build();
}

std::vector<LightTreeChild> light_tree_children(std::span<const uvec4> rows, std::uint32_t node, const vec4& ball) {
    const std::span<const uvec4> children = rows.subspan(
        shared::kLightTreeHeaderTexels + std::size_t{node} * shared::kLightTreeWidth, shared::kLightTreeWidth);
    const auto link = [&](std::size_t k) { return children[k].w & shared::kLightTreeLinkMask; };
    const std::uint32_t below = link(0) + (link(1) << shared::kLightTreeLinkBits);
    std::vector<LightTreeChild> found;
    for (std::uint32_t k = 0; k < children.size() && children[k].w != shared::kLightTreeNone; ++k) {
        const bool leaf = (children[k].w & shared::kLightTreeLeaf) != 0;
        const bool pair = (children[k].w & shared::kLightTreePair) != 0;
        const auto light = [&](std::size_t which) {
            return rows[rows[0].w + 2 * std::size_t{node} + which][static_cast<int>(k)];
        };
        const std::uint32_t index = leaf ? light(0) : below + k;
        found.push_back(
            {shared::light_child(children[k], ball), leaf, index, pair ? light(1) : index, !leaf && light(1) != 0});
    }
    return found;
}

vec4 light_tree_ball(std::span<const uvec4> rows) {
    return glm::uintBitsToFloat(rows[1]);
}

shared::LightTreeHeader light_tree_header(std::span<const uvec4> rows) {
    return std::bit_cast<shared::LightTreeHeader>(rows[0]);
}

void set_light_tree_header(std::span<uvec4> rows, const shared::LightTreeHeader& header) {
    rows[0] = std::bit_cast<uvec4>(header);
}

}  // namespace halflight
