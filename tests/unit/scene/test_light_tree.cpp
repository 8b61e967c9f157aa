// Tests light trees: conservative bounds, trails that lead to each light, and probabilities with sum one.
#include "engine/tables/light_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <random>

namespace halflight {
namespace {

/// Random numbers that are equal on all platforms, unlike those of standard distributions.
class Numbers {
  public:
    explicit Numbers(std::uint32_t seed) : random_(seed) {}
    double in(double low, double high) { return low + (high - low) * random_() * 0x1p-32; }
    dvec3 point(double reach) { return {in(-reach, reach), in(-reach, reach), in(-reach, reach)}; }
    dvec3 direction() {
        const double y = in(-1, 1), turn = in(0, 2 * kPi), r = std::sqrt(1 - y * y);
        return {r * std::cos(turn), y, r * std::sin(turn)};
    }

  private:
    std::mt19937 random_;
};

/// Returns squares, point lights and spot lights of various sizes and intensities.
std::vector<LightBounds> mixed_lights(int count, std::uint32_t seed, bool squares_only = false) {
    Numbers random(seed);
    std::vector<LightBounds> lights;
    for (int i = 0; i < count; ++i) {
        LightBounds& b = lights.emplace_back();
        const dvec3 at = random.point(10);
        b.lower = b.upper = at;
        b.axis = random.direction();
        b.intensity = std::exp(random.in(-6, 6));
        b.sized = i % 17 == 1;
        if (squares_only || i % 3 == 0) {
            const dvec3 half = glm::abs(random.point(0.3));
            b.lower -= half, b.upper += half;
            b.two_sided = true;
        } else if (i % 3 == 1) {
            b.theta_o = kPi;
        } else {
            b.theta_o = random.in(0, 0.7);
            b.theta_e = random.in(0, 0.7);
        }
    }
    return lights;
}

LightTree tree_of(const std::vector<LightBounds>& lights) {
    std::vector<std::uint32_t> names(lights.size());
    std::iota(names.begin(), names.end(), 0u);
    return build_light_tree(lights, names);
}

double angle(const dvec3& a, const dvec3& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Returns whether the bounds of a node contain those of a light: sphere, emission angle, sides and cone.
bool holds(const shared::LightNode& node, const LightBounds& light) {
    const auto within = [&](const dvec3& axis) {
        return angle(dvec3(node.axis), axis) + light.theta_o <= std::acos(double(node.cos_o)) + 2e-5;
    };
    const dvec3 lower =
        glm::max(glm::abs(light.lower - dvec3(node.centre)), glm::abs(light.upper - dvec3(node.centre)));
    return glm::length(lower) <= double(node.radius) * (1 + 1e-6) + 1e-12 &&
           node.cos_e <= std::cos(light.theta_e) + 1e-6 && (!light.two_sided || node.two_sided) &&
           (node.cos_o <= -1 || within(light.axis) || (node.two_sided && within(-light.axis)));
}

/// Calls f(child, depth, trail) for every child of a node, parents first. `depth` is the number of bits in the trail of
/// the child's node.
void for_each_child(const LightTree& tree,
                    const std::function<void(const LightTreeChild&, std::uint32_t, std::uint32_t)>& f) {
    const std::function<void(std::uint32_t, const vec4&, std::uint32_t, std::uint32_t)> visit =
        [&](std::uint32_t node, const vec4& ball, std::uint32_t depth, std::uint32_t trail) {
            std::uint32_t k = 0;
            for (const LightTreeChild& child : light_tree_children(tree.rows, node, ball)) {
                const std::uint32_t way = trail | (k++ << depth);
                f(child, depth, way);
                if (!child.leaf) visit(child.index, vec4(child.bounds.centre, child.bounds.radius), depth + 2, way);
            }
        };
    visit(0, light_tree_ball(tree.rows), 0, 0);
}

/// Returns the probability of each light by the traversal of shaders/lib/light_tree_traversal.glsl, in double precision
/// except for the importances.
std::vector<double> probabilities(const LightTree& tree, const vec3& position, const vec3& normal) {
    std::vector<double> all(tree.trails.size());
    const std::function<void(std::uint32_t, const vec4&, double)> visit = [&](std::uint32_t node, const vec4& ball,
                                                                              double probability) {
        const std::vector<LightTreeChild> children = light_tree_children(tree.rows, node, ball);
        std::vector<double> importance;
        for (const LightTreeChild& child : children)
            importance.push_back(shared::light_importance(child.bounds, position, normal, false));
        const double total = std::accumulate(importance.begin(), importance.end(), 0.0);
        for (std::size_t k = 0; k < children.size(); ++k) {
            const LightTreeChild& child = children[k];
            const double here = total > 0 ? probability * importance[k] / total : 0;
            if (child.leaf)
                all[child.index] += 0.5 * here, all[child.other] += 0.5 * here;
            else if (here > 0)
                visit(child.index, vec4(child.bounds.centre, child.bounds.radius), here);
        }
    };
    visit(0, light_tree_ball(tree.rows), 1);
    return all;
}

/// Checks that every node bounds all lights below it, every trail ends at its light, and no trail is too long.
void expect_sound(const LightTree& tree, const std::vector<LightBounds>& lights) {
    std::vector<int> found(lights.size(), 0);
    for_each_child(tree, [&](const LightTreeChild& child, std::uint32_t depth, std::uint32_t way) {
        ASSERT_LT(depth, shared::kLightTreeDepth);
        EXPECT_TRUE(child.bounds.intensity >= 0 && child.bounds.intensity <= 1) << child.bounds.intensity;
        const std::uint32_t mask = (4u << depth) - 1;
        bool sized = false;
        for (std::size_t i = 0; i < lights.size(); ++i) {
            if (((tree.trails[i] ^ way) & mask) != 0) continue;
            EXPECT_TRUE(holds(child.bounds, lights[i])) << i << " at depth " << depth;
            sized = sized || lights[i].sized;
        }
        EXPECT_EQ(child.sized, sized && !child.leaf) << "at depth " << depth;
        if (!child.leaf) return;
        ++found[child.index];
        EXPECT_EQ(tree.trails[child.index], way);
        if (child.other == child.index) return;
        ++found[child.other];
        EXPECT_EQ(tree.trails[child.other], way | 4u << depth);
    });
    for (std::size_t i = 0; i < lights.size(); ++i) {
        EXPECT_EQ(found[i], 1) << i;
        EXPECT_LT(tree.trails[i], 1u << shared::kLightTreeDepth) << i;
    }
}

TEST(LightBounds, ConesOfUnionsContainBoth) {
    Numbers random(1);
    for (int i = 0; i < 4000; ++i) {
        LightBounds a, b;
        a.axis = random.direction();
        // The axes are opposite, equal, or random.
        b.axis = i % 4 == 0 ? -a.axis : i % 4 == 1 ? a.axis : random.direction();
        a.theta_o = i % 3 == 0 ? 0 : random.in(0, 2);
        b.theta_o = i % 5 == 0 ? 0 : random.in(0, 2);
        a.two_sided = i % 7 == 0, b.two_sided = i % 11 == 0;
        const LightBounds all = united(a, b);
        EXPECT_EQ(all.two_sided, a.two_sided || b.two_sided);
        EXPECT_NEAR(glm::length(all.axis), 1, 1e-12);
        for (const LightBounds& part : {a, b}) {
            const double off = angle(all.axis, part.axis), back = angle(all.axis, -part.axis);
            const double nearest = all.two_sided ? std::min(off, back) : off;
            EXPECT_TRUE(all.theta_o >= kPi || nearest + part.theta_o <= all.theta_o + 1e-9) << i;
        }
    }
}

TEST(LightTree, NodesBoundTheirLights) {
    std::vector<std::vector<LightBounds>> cases;
    for (const int count : {1, 2, 3, 16, 500}) {
        cases.push_back(mixed_lights(count, 7));
        cases.push_back(mixed_lights(count, 8, true));
    }
    cases.push_back(mixed_lights(300, 3));
    for (LightBounds& b : cases.back()) b.lower = b.upper = dvec3(1, 2, 3);
    // The best split of a row with exponential spaces separates one light at a time. Trails must still not become as
    // long as the row.
    cases.push_back(mixed_lights(300, 4));
    double at = 1e-30;
    for (LightBounds& b : cases.back()) {
        b.lower = b.upper = dvec3(at, 0, 0);
        b.intensity = at * at;
        at *= 1.3;
    }
    for (const auto& lights : cases) {
        SCOPED_TRACE(lights.size());
        const LightTree tree = tree_of(lights), again = tree_of(lights);
        expect_sound(tree, lights);
        EXPECT_TRUE(tree.trails == again.trails && tree.rows == again.rows) << "it is deterministic";
    }
}

/// The two triangles of a square form one light for the receiver, and therefore one leaf.
TEST(LightTree, SquaresAreLeaves) {
    std::vector<LightBounds> halves;
    for (const LightBounds& square : mixed_lights(256, 13, true)) halves.insert(halves.end(), 2, square);
    const LightTree tree = tree_of(halves);
    expect_sound(tree, halves);
    int pairs = 0, leaves = 0;
    for_each_child(tree, [&](const LightTreeChild& child, std::uint32_t, std::uint32_t) {
        leaves += child.leaf;
        pairs += child.leaf && child.other != child.index;
        EXPECT_TRUE(!child.leaf || child.index / 2 == child.other / 2);
    });
    EXPECT_EQ(leaves + pairs, 512);
    EXPECT_GT(pairs, 128) << "most squares share a leaf";
    const std::vector<LightBounds> unlike = mixed_lights(512, 14, true);
    for_each_child(tree_of(unlike), [&](const LightTreeChild& child, std::uint32_t, std::uint32_t) {
        EXPECT_TRUE(!child.leaf || child.index == child.other);
    });
}

/// Quantized bounds are little wider than the exact ones.
TEST(LightTree, RoundedBoundsAreTight) {
    const auto lights = mixed_lights(500, 15);
    const LightTree tree = tree_of(lights);
    const double whole = double(light_tree_ball(tree.rows).w);
    for_each_child(tree, [&](const LightTreeChild& child, std::uint32_t, std::uint32_t) {
        if (!child.leaf || child.index != child.other) return;
        const LightBounds& light = lights[child.index];
        EXPECT_LE(double(child.bounds.radius), 0.5 * glm::length(light.upper - light.lower) + 1e-4 * whole);
        EXPECT_LE(angle(dvec3(child.bounds.axis), light.axis), 0.02);
        EXPECT_GE(double(child.bounds.cos_o), std::cos(std::min(light.theta_o + 0.04, kPi)));
        EXPECT_GE(double(child.bounds.cos_e), std::cos(light.theta_e) - 0.005);
    });
}

TEST(LightTree, ProbabilitiesAddUp) {
    // Point lights shine in all directions. Without a receiver's normal no light is behind the surface, so no trail
    // ends at importance 0.
    std::vector<LightBounds> bulbs = mixed_lights(200, 6);
    for (LightBounds& b : bulbs) b.theta_o = kPi, b.two_sided = false;
    const LightTree tree = tree_of(bulbs);
    Numbers random(9);
    for (int i = 0; i < 200; ++i) {
        const vec3 below = vec3(random.point(10)) - vec3(0, 30, 0);
        const auto all = probabilities(tree, below, vec3(0, 1, 0));
        EXPECT_NEAR(std::accumulate(all.begin(), all.end(), 0.0), 1, 1e-6);
    }
    const LightTree mixed = tree_of(mixed_lights(200, 6));
    for (int i = 0; i < 200; ++i) {
        const auto all = probabilities(mixed, vec3(random.point(12)), vec3(random.direction()));
        EXPECT_LE(std::accumulate(all.begin(), all.end(), 0.0), 1 + 1e-6);
    }
}

/// Every light that shines at a receiver must have a probability there, or the estimate would be biased.
TEST(LightTree, EveryShiningLightIsReachable) {
    const auto lights = mixed_lights(200, 10);
    const LightTree tree = tree_of(lights);
    Numbers random(11);
    int lit = 0;
    for (int i = 0; i < 300; ++i) {
        const dvec3 position = random.point(12), normal = random.direction();
        const auto chance = probabilities(tree, vec3(position), vec3(normal));
        for (std::size_t k = 0; k < lights.size(); ++k) {
            const LightBounds& b = lights[k];
            const dvec3 to = 0.5 * (b.lower + b.upper) - position, direction = glm::normalize(to);
            if (glm::dot(direction, normal) < 0.02) continue;
            const double leaves = angle(b.axis, -direction);
            const double off = b.two_sided ? std::min(leaves, kPi - leaves) : leaves;
            if (off - b.theta_o > b.theta_e - 0.02) continue;
            ++lit;
            EXPECT_GT(chance[k], 0) << k;
        }
    }
    EXPECT_GT(lit, 10000);
}

/// 64 pairs of spot lights point away from each other. Each light is selected in proportion to its contribution.
TEST(LightTree, OppositeSpots) {
    std::vector<LightBounds> spots;
    Numbers random(12);
    for (int i = 0; i < 64; ++i) {
        LightBounds b;
        b.lower = b.upper = random.point(3) + dvec3(0, 10, 0);
        b.axis = {0, -1, 0};
        b.theta_o = 0.5, b.theta_e = 0.2;
        b.intensity = 1;
        spots.push_back(b);
        b.axis = {0, 1, 0};
        spots.push_back(b);
    }
    const LightTree tree = tree_of(spots);
    for (int i = 0; i < 100; ++i) {
        const auto chance = probabilities(tree, vec3(random.point(1)), vec3(0, 1, 0));
        double down = 0;
        for (std::size_t k = 0; k < spots.size(); k += 2) {
            const dvec3 lit = spots[k].lower;
            EXPECT_TRUE(angle({0, -1, 0}, -lit) >= 0.5 || chance[k] > 1 / 64.0 / 8) << k << ": " << chance[k];
            down += chance[k];
        }
        EXPECT_GT(down, 0.9);
    }
}

}  // namespace
}  // namespace halflight
