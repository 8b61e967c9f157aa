// Tests previous positions of surface points in another pose.
#include "engine/scene/motion.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

namespace halflight {
namespace {

/// Returns two instances, at nodes 3 and 5, of a mesh of two triangles.
Scene pair_of_squares() {
    Scene scene;
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.meshes.push_back(mesh);
    scene.instances = {{"a", 0, dmat4(1), 3}, {"b", 0, glm::translate(dmat4(1), dvec3(0, 0, 7)), 5}};
    return scene;
}

TEST(PreviousSurfaces, StaticSurfacesHaveNoMotion) {
    const Scene now = pair_of_squares();
    const PreviousSurfaces surfaces(now, pair_of_squares());
    EXPECT_FALSE(surfaces.moved(0));
    EXPECT_FALSE(surfaces.moved(1));
}

TEST(PreviousSurfaces, FollowsNodesAndCorners) {
    const Scene now = pair_of_squares();
    Scene before = now;
    std::swap(before.instances[0], before.instances[1]);  // nodes identify the instances
    before.instances[0].object_to_world = glm::scale(dmat4(1), dvec3(2, 1, 1));
    PreviousSurfaces turned(now, before);
    EXPECT_FALSE(turned.moved(0));
    ASSERT_TRUE(turned.moved(1));
    EXPECT_LT(glm::distance(turned.before(1, 0, {0.75, 0.25, 7}), dvec3(1.5, 0.25, 0)), 1e-15);
    EXPECT_LT(glm::distance(turned.before(1, 1, {0.25, 0.75, 7 + 1e-3}), dvec3(0.5, 0.75, 0)), 1e-12)
        << "beside its plane, as rounding may have it";

    Scene bent = pair_of_squares();
    bent.meshes[0].positions[2].z = 4;
    PreviousSurfaces deformed(now, bent);
    ASSERT_TRUE(deformed.moved(0));
    EXPECT_LT(glm::distance(deformed.before(0, 0, {0.75, 0.25, 0}), dvec3(0.75, 0.25, 1)), 1e-15);
}

TEST(PreviousSurfaces, UnmatchedInstancesCountAsStatic) {
    const Scene now = pair_of_squares();
    Scene before = now;
    before.instances[0].node = 4;
    before.meshes[0].triangles.pop_back();
    before.instances[1].object_to_world = glm::scale(dmat4(1), dvec3(2, 1, 1));
    const PreviousSurfaces surfaces(now, before);
    EXPECT_FALSE(surfaces.moved(0)) << "was not there";
    EXPECT_FALSE(surfaces.moved(1)) << "other triangles";
}

}  // namespace
}  // namespace halflight
