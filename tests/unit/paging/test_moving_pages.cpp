// Tests the pages of moving geometry: rows of tables, pages, and the pages of a file beside them.
#include "engine/paging/moving_pages.h"

#include <gtest/gtest.h>

#include <bit>
#include <glm/gtc/matrix_transform.hpp>
#include <map>

#include "engine/paging/convert.h"
#include "engine/tables/shading_tables.h"
#include "shaders/shared/bvh_nodes.h"
#include "tests/support/error_message.h"
#include "tests/support/scenes.h"
#include "tests/unit/paging/scene_meshes.h"
#include "tools/common/temporary_folder.h"

namespace halflight::paging {
namespace {

/// Returns the Cornell box, of which the second object moves, the third deforms, and a shared mesh has a still and a
/// moving instance.
Scene scene_at(double time) {
    Scene scene = test::cornell_box();
    scene.name = "box";
    scene.instances[1].moves = true;
    scene.instances[1].object_to_world = glm::translate(scene.instances[1].object_to_world, dvec3(time, 0, 0));
    Mesh& bent = scene.meshes[static_cast<std::size_t>(scene.instances[2].mesh)];
    bent.deforms = true;
    for (vec3& p : bent.positions) p.y += static_cast<float>(time) * p.x;
    Instance copy = scene.instances[0];
    copy.moves = true;
    copy.object_to_world = glm::translate(copy.object_to_world, dvec3(0, 0, 1 + time));
    scene.instances.push_back(copy);
    return scene;
}

/// Returns the triangles of all pages from `first` on, with the number of pages that have each.
std::map<std::uint32_t, int> triangles_of(const PageSource& source, std::uint32_t first) {
    std::map<std::uint32_t, int> found;
    for (std::uint32_t p = first; p < source.index().pages.size(); ++p) {
        const Page page = source.read(p);
        for (const uvec4& pair : page.pairs) {
            const uvec2 ids = uvec2(pair) & shared::kBvhTriangleMask;
            ++found[ids.x];
            if (ids.y != ids.x) ++found[ids.y];
        }
    }
    return found;
}

class MovingPagesTest : public testing::Test {
  protected:
    MovingPagesTest() {
        test::SceneMeshes meshes(scene_at(0));
        convert(meshes, folder / "a.pages", {});
        file = std::make_shared<PageFile>(folder / "a.pages");
    }
    const TemporaryFolder folder;
    std::shared_ptr<const PageFile> file;
};

TEST_F(MovingPagesTest, RowsEqualThoseInMemory) {
    MovingPages pages(file);
    for (const double time : {0.0, 0.25, 3.0}) {
        const Scene scene = scene_at(time);
        EXPECT_TRUE(pages.pose(scene));
        const TraceTables trace = build_trace_tables(scene, ~std::size_t{0}, file->index().origin);
        const ShadingTables shading = build_shading_tables(scene, trace);
        const PageIndex& index = pages.index();
        ASSERT_EQ(index.triangles, trace.triangles.size());
        EXPECT_EQ(index.origin, trace.origin);
        EXPECT_EQ(index.bounds.lower, trace.bounds.lower);
        EXPECT_EQ(index.bounds.upper, trace.bounds.upper);
        ASSERT_EQ(index.ranges.size(), scene.instances.size());
        std::vector<bool> met(scene.instances.size(), false);
        for (const MeshRange& range : index.ranges) {
            ASSERT_FALSE(met.at(range.instance));
            met[range.instance] = true;
            const bool moves = is_moving(scene, scene.instances[range.instance]);
            EXPECT_EQ(range.moves, moves);
            EXPECT_EQ(range.first_triangle >= pages.still().triangles, moves);
            const MeshRange& known = trace.ranges[range.instance];
            ASSERT_EQ(range.triangle_count, known.triangle_count);
            std::vector<std::uint32_t> here, there;
            for (std::uint32_t t = 0; t < range.triangle_count; ++t) {
                here.push_back(range.first_triangle + t);
                there.push_back(known.first_triangle + t);
            }
            TriangleRows rows;
            pages.read_rows(here, rows);
            const TriangleRows expected = test::rows_of(trace, shading, there);
            EXPECT_TRUE(test::same_bytes(rows.positions, expected.positions)) << range.instance;
            EXPECT_TRUE(test::same_bytes(rows.attributes, expected.attributes)) << range.instance;
            for (std::size_t t = 0; t < rows.triangles.size(); ++t) {
                EXPECT_EQ(rows.triangles[t].w, expected.triangles[t].w);
                EXPECT_EQ(rows.triangles[t].x - range.first_vertex, expected.triangles[t].x - known.first_vertex);
            }
        }
        const std::map<std::uint32_t, int> found = triangles_of(pages, pages.still().pages);
        EXPECT_EQ(found.size(), index.triangles - pages.still().triangles);
        EXPECT_EQ(found.begin()->first, pages.still().triangles);
        for (const auto& [triangle, count] : found) EXPECT_EQ(count, 1) << triangle;
    }
}

TEST_F(MovingPagesTest, RowsOfBothPartsMix) {
    MovingPages pages(file);
    pages.pose(scene_at(1));
    const std::uint32_t still = pages.still().triangles;
    const std::vector<std::uint32_t> mixed = {still + 1, 2, still, 0, 2, still + 1};
    TriangleRows rows, one;
    pages.read_rows(mixed, rows);
    for (std::size_t i = 0; i < mixed.size(); ++i) {
        pages.read_rows(std::span(&mixed[i], 1), one);
        EXPECT_EQ(rows.triangles[i], one.triangles[0]);
        for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(rows.positions[3 * i + k], one.positions[k]);
    }
}

TEST_F(MovingPagesTest, APoseIsAFunctionOfTheScene) {
    MovingPages pages(file), others(file);
    EXPECT_TRUE(pages.pose(scene_at(2)));
    EXPECT_FALSE(pages.pose(scene_at(2))) << "nothing has moved";
    EXPECT_TRUE(pages.pose(scene_at(1)));
    others.pose(scene_at(1));
    ASSERT_EQ(pages.index().pages.size(), others.index().pages.size());
    for (std::uint32_t p = pages.still().pages; p < pages.index().pages.size(); ++p) {
        EXPECT_TRUE(test::same_bytes(pages.read(p).nodes, others.read(p).nodes));
        EXPECT_TRUE(test::same_bytes(pages.read(p).pairs, others.read(p).pairs));
    }
}

TEST_F(MovingPagesTest, OtherScenesAreRefused) {
    MovingPages pages(file);
    Scene fewer = scene_at(0), painted = scene_at(0);
    fewer.instances.erase(fewer.instances.begin());
    painted.materials.emplace_back();
    const auto message = [&](const Scene& scene) { return error_message([&] { MovingPages(file).pose(scene); }); };
    for (const Scene& other : {fewer, painted})
        EXPECT_TRUE(message(other).starts_with("box: its pages were made of another scene: ")) << message(other);
    Scene far = scene_at(0);
    far.instances[1].object_to_world = glm::translate(dmat4(1), dvec3(1e15, 0, 0));
    EXPECT_TRUE(message(far).starts_with("box: instance 1 "));
}

}  // namespace
}  // namespace halflight::paging
