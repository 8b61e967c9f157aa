// Tests specular chains against closed forms: mirrors, glass, coats, limits, and the motion of mirror images.
#include "passes/light/specular_chain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "passes/picture/aov.h"
#include "passes/surface/gbuffer.h"
#include "renderer/frame_constants.h"
#include "renderer/noisy_frame.h"
#include "shaders/shared/chain_records.h"
#include "shaders/shared/pixel_order.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

const vec3 kBlue(0.2f, 0.5f, 0.8f);

class SpecularChainTest : public PassTest {
  protected:
    static constexpr int kSide = 8;  // size of the picture, pixels

    struct Found {
        std::vector<shared::SpecularChain> chains;
        std::vector<shared::ChainPlace> places;
    };
    Found follow(const Scene& scene, const Camera& camera, int bounces = 8, bool places = true) {
        Stage stage(programs, scene, camera, ivec2(kSide));
        graph::Graph graph;
        const SceneView view = stage.view(graph);
        const SpecularChains made =
            add_specular_chains(graph, view, add_gbuffer(graph, view), {.bounces = bounces, .places = places});
        graph.output(made.chains);
        if (places) graph.output(made.places);
        run(graph);
        Found found{executor.read<shared::SpecularChain>(made.chains), {}};
        if (places) found.places = executor.read<shared::ChainPlace>(made.places);
        return found;
    }
    /// Places of mirror images, as the denoiser of sequences keeps them.
    struct Taken {
        std::vector<shared::ChainPlace> places;
        NoisyFrame frame;
        Band band;
        dvec3 origin;

        const shared::ChainPlace& at(const ivec2& pixel) const {
            return places[shared::path_of_pixel(uvec2(pixel), band.tiles())];
        }
    };
    Taken take(const Scene& scene, const Camera& own, const Camera& other, const PreviousSurfaces* then, int side) {
        Stage stage(programs, scene, own, ivec2(side));
        graph::Graph graph;
        const SceneView view = stage.view(graph);
        const GBuffer gbuffer = add_gbuffer(graph, view);
        const graph::BufferHandle records = add_aov(graph, view, gbuffer);
        const SpecularChains made = add_specular_chains(graph, view, gbuffer, {.bounces = 4, .places = true});
        graph.output(records), graph.output(made.places);
        run(graph);
        Taken taken{executor.read<shared::ChainPlace>(made.places), {}, stage.band(), stage.trace_tables().origin};
        taken.frame.add_places(taken.band, executor.read<shared::AovRecord>(records), taken.places,
                               stage.trace_tables());
        taken.frame.add_motion(1, own, other, then);
        return taken;
    }
    /// Returns the chain of the picture's centre.
    shared::SpecularChain at_centre(const Scene& scene, const Camera& camera, int bounces = 8) {
        return follow(scene, camera, bounces).chains[shared::path_of_pixel(uvec2(kSide / 2), uvec2(1))];
    }

    /// Returns a floor that a camera sees at 45 degrees, and a blue wall at x = 2 that it shows.
    static Scene floor_and_wall(const Material& floor) {
        Scene scene = floor_scene(floor, 1);
        add_quad(scene, add_material(scene, diffuse_material(kBlue)), {2, -9, -9}, {0, 18, 0}, {0, 0, 18});
        return scene;
    }
    static Camera at_45_degrees() { return spot_camera(dvec3(0), {-1, 1, 0}, 0.01); }
};

void expect_near(const vec3& found, const vec3& expected, float tolerance) {
    EXPECT_LT(glm::distance(found, expected), tolerance)
        << found.x << ", " << found.y << ", " << found.z << " instead of " << expected.x << ", " << expected.y << ", "
        << expected.z;
}

TEST_F(SpecularChainTest, MirrorsShowTheWall) {
    for (const vec3 color : {vec3(1), vec3(0.9f, 0.6f, 0.3f)}) {
        const shared::SpecularChain c = at_centre(floor_and_wall(metal_material(color, 0)), at_45_degrees());
        EXPECT_EQ(c.bounces, 1);
        EXPECT_EQ(c.escaped, 0);
        EXPECT_NEAR(c.way, 2 * std::sqrt(2), 0.02);
        const float schlick = std::pow(1 - std::sqrt(0.5f), 5.0f);
        expect_near(c.albedo, (color + (1.0f - color) * schlick) * kBlue, 1e-4f);
        expect_near(c.normal, {-1, 0, 0}, 1e-5f);
    }
}

TEST_F(SpecularChainTest, RoughnessUpToTheLimitIsSharp) {
    const float beyond = std::nextafter(shared::kMostSharpRoughness, 1.0f);
    for (const bool coat : {false, true}) {
        const auto bounces = [&](float roughness) {
            Material m = metal_material(vec3(1), roughness);
            if (coat) m = diffuse_material(kBlue), m.clearcoat = 1, m.clearcoat_roughness = roughness;
            return at_centre(floor_and_wall(m), at_45_degrees()).bounces;
        };
        EXPECT_EQ(bounces(shared::kMostSharpRoughness), 1) << coat;
        EXPECT_EQ(bounces(beyond), 0) << coat;
        EXPECT_EQ(bounces(1), 0) << coat;
    }
    EXPECT_EQ(at_centre(floor_and_wall(diffuse_material(vec3(1))), at_45_degrees()).bounces, 0);
}

TEST_F(SpecularChainTest, ChainsEndAtTheLimit) {
    // Two mirrors face each other at a distance of 1. They are too large for the chain to leave.
    Scene scene = floor_scene(metal_material(vec3(1), 0), 100);
    add_quad(scene, 0, {-100, 1, -100}, {200, 0, 0}, {0, 0, 200});
    Camera camera = spot_camera(dvec3(0), {-1, 1, 0}, 0.01);
    for (const int bounces : {1, 2, 5, 6, 7, 64}) {
        const shared::SpecularChain c = at_centre(scene, camera, bounces);
        const int expected = std::min(bounces, shared::kMostChainBounces);
        EXPECT_EQ(c.bounces, static_cast<float>(expected)) << bounces;
        EXPECT_NEAR(c.way, std::sqrt(2) * expected, 1e-3) << bounces;
        EXPECT_EQ(c.escaped, 0) << bounces;
        expect_near(c.albedo, vec3(1), 1e-4f);
    }
}

TEST_F(SpecularChainTest, ChainsThatLeaveSeeTheEnvironment) {
    for (const float radiance : {0.0f, 0.5f, 300.0f}) {
        Scene scene = floor_scene(metal_material(vec3(1), 0), 1);
        scene.environment.color = vec3(radiance);
        const shared::SpecularChain c = at_centre(scene, at_45_degrees());
        EXPECT_EQ(c.bounces, 1);
        EXPECT_EQ(c.escaped, 1);
        EXPECT_EQ(c.way, 0);
        EXPECT_EQ(c.normal, vec3(0));
        expect_near(c.albedo, vec3(std::min(radiance, 1.0f)), 1e-5f);
    }
}

TEST_F(SpecularChainTest, GlassShowsWhatIsBehind) {
    const double reflected = 0.04;  // (0.5 / 2.5)^2
    for (const bool solid : {false, true}) {
        Scene scene;
        Material glass = glass_material(0);
        if (!solid) glass.thickness = 0;
        if (solid)
            add_box(scene, add_material(scene, glass), {-1, -1, 0}, {1, 1, 0.5f});
        else
            add_quad(scene, add_material(scene, glass), {-1, -1, 0.5f}, {2, 0, 0}, {0, 2, 0});
        add_quad(scene, add_material(scene, diffuse_material(kBlue)), {-9, -9, -1}, {18, 0, 0}, {0, 18, 0});
        const shared::SpecularChain c = at_centre(scene, spot_camera({0, 0, 1}, {0, 0, 1}, 0.01));
        EXPECT_EQ(c.bounces, solid ? 2 : 1);
        EXPECT_NEAR(c.way, 1.5, 1e-4);
        expect_near(c.normal, {0, 0, 1}, 1e-5f);
        if (!solid) continue;
        // Reflected light counts as white.
        const double passed = (1 - reflected) * (1 - reflected);
        expect_near(c.albedo, vec3(passed) * kBlue + vec3(reflected + (1 - reflected) * reflected), 1e-4f);
    }
}

TEST_F(SpecularChainTest, TotalReflectionIsFollowed) {
    // From inside of glass, the face y = 0 reflects everything at 45 degrees.
    Scene scene;
    add_box(scene, add_material(scene, glass_material(0)), {-9, -9, -9}, {9, 0, 9});
    add_box(scene, add_material(scene, diffuse_material(kBlue)), {1, -8, -8}, {2, -0.5f, 8});
    const shared::SpecularChain c = at_centre(scene, spot_camera(dvec3(0), {-1, -1, 0}, 0.01));
    EXPECT_EQ(c.bounces, 1);
    EXPECT_NEAR(c.way, std::sqrt(2), 0.02);
    expect_near(c.normal, {-1, 0, 0}, 1e-5f);
}

TEST_F(SpecularChainTest, CoatsThatWeighLittleEndChains) {
    Material coated = diffuse_material(kBlue);
    coated.clearcoat = 1, coated.clearcoat_roughness = 0;
    EXPECT_EQ(at_centre(floor_and_wall(coated), at_45_degrees()).bounces, 1) << "glossy light is filtered apart";
    Material metal = metal_material(vec3(0.8f), 0.5f);
    metal.clearcoat = 1, metal.clearcoat_roughness = 0;
    EXPECT_EQ(at_centre(floor_and_wall(metal), at_45_degrees()).bounces, 0) << "the metal below is brighter";
    // The diffuse light of a coated surface outweighs that of the coat where a mirror shows both.
    Scene scene = floor_and_wall(metal_material(vec3(1), 0));
    scene.materials[1] = coated;
    EXPECT_EQ(at_centre(scene, at_45_degrees()).bounces, 1);
}

TEST_F(SpecularChainTest, RoughMirrorsSpreadLikePaths) {
    // Rays of samples fill the lobe. Places belong to its centre.
    for (const bool places : {false, true}) {
        const Found found = follow(floor_and_wall(metal_material(vec3(1), 0.1f)), at_45_degrees(), 8, places);
        double sum = 0;
        float least = 9, most = 0;
        for (const shared::SpecularChain& chain : found.chains) {
            EXPECT_EQ(chain.bounces, chain.way > 0 ? 1.0f : 0.0f);
            if (chain.way == 0) continue;  // beyond the picture
            sum += double{chain.way} / (kSide * kSide);
            least = std::min(least, chain.way), most = std::max(most, chain.way);
        }
        EXPECT_NEAR(sum, 2 * std::sqrt(2), 0.05) << places;
        if (places)
            EXPECT_LT(most - least, 0.02f);
        else
            EXPECT_GT(most - least, 0.1f);
    }
}

TEST_F(SpecularChainTest, MirrorImagesMoveByTheReflectedMotion) {
    // A mirror at y = 0 shows a square above, which the camera does not see. The square moves upwards, to the side and
    // towards the camera; its image moves down instead.
    const auto scene_at = [](const vec3& at) {
        Scene scene = floor_scene(metal_material(vec3(1), 0), 50);
        add_quad(scene, add_material(scene, diffuse_material(kBlue)), at - vec3(3, 3, 0), {0, 6, 0}, {6, 0, 0});
        return scene;
    };
    const vec3 at(0, 4, -6), step(0.05f, 0.1f, 0.2f);
    const Scene now = scene_at(at), then = scene_at(at + step);
    const Camera camera = look_at_camera({0, 1, 3}, {0, -3, -6}, {0, 1, 0}, 0.4);
    const PreviousSurfaces surfaces(now, then);
    Taken taken = take(now, camera, camera, &surfaces, kSide);
    NoisyFrame& frame = taken.frame;
    ASSERT_NE(frame.motion(1), nullptr);
    ASSERT_NE(frame.glossy_motion(1), nullptr);
    const std::vector<float> own = frame.motion(1)->read_float(), mirrored = frame.glossy_motion(1)->read_float();

    const dmat4 to_clip = world_to_clip(camera, ivec2(kSide), 1);
    const auto pixel_of = [&](const dvec3& p) {
        const dvec4 clip = to_clip * dvec4(p, 1);
        return dvec2(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * double{kSide};
    };
    int seen = 0;
    for (const auto& [x, y] : pixels_of(ivec2(kSide))) {
        const shared::ChainPlace& place = taken.at({x, y});
        if (place.bounces == 0 || place.triangle == shared::kMiss) continue;
        ++seen;
        const dvec3 image = dvec3(place.position) + taken.origin;
        const dvec2 expected = pixel_of((image + dvec3(step)) * dvec3(1, -1, 1)) - pixel_of(image * dvec3(1, -1, 1));
        const float* motion = &mirrored[std::size_t(4 * (y * kSide + x))];
        EXPECT_NEAR(motion[0], expected.x, 2e-3) << x << ", " << y;
        EXPECT_NEAR(motion[1], expected.y, 2e-3) << x << ", " << y;
        EXPECT_EQ(motion[3], 2.5f) << "the square, in a mirror";
        EXPECT_EQ(own[std::size_t(4 * (y * kSide + x)) + 3], 1) << "the mirror itself";
        EXPECT_NEAR(own[std::size_t(4 * (y * kSide + x))], 0, 1e-3);
    }
    EXPECT_GT(seen, kSide * kSide / 4);
}

TEST_F(SpecularChainTest, ImagesInCurvedMirrorsAreFoundAgain) {
    // A ball of chrome in a room. Pixels of a frame point to the pixels that show the same points in another one.
    Scene scene = closed_box(diffuse_material(kBlue));
    add_smooth_ball(scene, add_material(scene, metal_material(vec3(1), 0)), vec3(0), 0.3f, 48);
    const auto camera_at = [](double x) { return look_at_camera({x, 0, 0.9}, dvec3(0), {0, 1, 0}, 0.5); };
    constexpr int kSize = 64;
    Taken first = take(scene, camera_at(0), camera_at(0.1), nullptr, kSize),
          second = take(scene, camera_at(0.1), camera_at(0), nullptr, kSize);
    const std::vector<float> motion = first.frame.glossy_motion(1)->read_float();
    double found = 0, still = 0;
    int count = 0;
    for (const auto& [x, y] : pixels_of({20, 20}, {44, 44})) {
        const float* way = &motion[std::size_t(4 * (y * kSize + x))];
        const ivec2 to(x + static_cast<int>(std::lround(way[0])), y + static_cast<int>(std::lround(way[1])));
        if (way[3] == 0 || to.x < 0 || to.y < 0 || to.x >= kSize || to.y >= kSize) continue;
        const vec3& here = first.at({x, y}).position;
        found += glm::distance(here, second.at(to).position);
        still += glm::distance(here, second.at({x, y}).position);
        ++count;
    }
    EXPECT_GT(count, 400);
    EXPECT_LT(found, 0.35 * still);
}

}  // namespace
}  // namespace halflight::test
