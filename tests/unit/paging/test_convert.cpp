// Tests the conversion of scenes to page files: rows of tables, pages, independence from threads and memory, failures.
#include "engine/paging/convert.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <iterator>
#include <limits>
#include <set>
#include <tuple>

#include "api/halflight/pack.h"
#include "engine/io/gltf/parts.h"
#include "engine/io/png.h"
#include "engine/scene/material_properties.h"
#include "engine/tables/shading_tables.h"
#include "shaders/shared/bvh_nodes.h"
#include "tests/support/process.h"
#include "tests/support/scenes.h"
#include "tests/unit/io/file_size_limit.h"
#include "tests/unit/io/gltf_builder.h"
#include "tests/unit/paging/scene_meshes.h"

namespace halflight::paging {
namespace {

using test::rows_of;
using test::same_bytes;
using test::SceneMeshes;

constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

std::string bytes_of(const std::filesystem::path& path) {
    return read_file(path, 1u << 30);
}

/// Checks that each triangle is in one page, and only there, with its corners and its flag.
void check_pages(const PageFile& file, const TraceTables& trace) {
    const PageIndex& index = file.index();
    std::vector<int> met(trace.triangles.size(), 0);
    std::size_t alpha = 0, expected_alpha = 0;
    for (const uvec4& triangle : trace.triangles) expected_alpha += (triangle.w & kTriangleAlpha) != 0;
    for (std::uint32_t p = 0; p < index.pages.size(); ++p) {
        const Page page = file.read(p);
        ASSERT_EQ(page.pairs.size(), index.pages[p].pairs);
        ASSERT_EQ(page.nodes.size(), index.pages[p].nodes * std::size_t{shared::kBvhPageTexels});
        ASSERT_EQ(page.vertices.size(), index.pages[p].vertices);
        for (const uvec4& pair : page.pairs) {
            for (const std::uint32_t word :
                 std::set{pair.x & ~shared::kBvhPageFacing, pair.y & ~shared::kBvhPageFacing}) {
                alpha += (word & shared::kBvhPageAlpha) != 0;
                const std::uint32_t id = word & shared::kBvhTriangleMask;
                ASSERT_LT(id, met.size());
                ++met[id];
                const uvec4& row = trace.triangles[id];
                for (int k = 0; k < 3; ++k) {
                    const vec3& corner = trace.positions[row[k]];
                    bool found = false;
                    for (int c = 0; c < 4; ++c)
                        found =
                            found || corner == page.vertices[(pair[2 + c / 2] >> (c % 2 * shared::kBvhPageCornerBits)) &
                                                             shared::kBvhPageCornerMask];
                    ASSERT_TRUE(found) << id;
                }
            }
        }
    }
    EXPECT_EQ(std::ranges::count(met, 1), std::ptrdiff_t(met.size()));
    EXPECT_EQ(alpha, expected_alpha);
}

/// Checks that a page file equals the tables of a scene in memory.
void expect_tables(const PageFile& file, const Scene& scene) {
    const TraceTables trace = build_trace_tables(scene, kAll);
    const ShadingTables shading = build_shading_tables(scene, trace);
    const PageIndex& index = file.index();
    EXPECT_EQ(index.origin, trace.origin);
    EXPECT_EQ(index.bounds.lower, trace.bounds.lower);
    EXPECT_EQ(index.bounds.upper, trace.bounds.upper);
    EXPECT_EQ(index.slivers, trace.slivers);
    EXPECT_EQ(index.vertices, trace.vertex_count());
    EXPECT_EQ(index.ranges, trace.ranges);
    EXPECT_EQ(index.vertex_texels, static_cast<std::uint32_t>(shading.needs.vertex_stride()));
    ASSERT_EQ(index.triangles, trace.triangles.size());
    const std::vector<std::uint32_t> triangles = test::all_triangles(trace.triangles.size());
    const TriangleRows expected = rows_of(trace, shading, triangles);
    TriangleRows rows;
    file.read_rows(triangles, rows);
    EXPECT_TRUE(same_bytes(rows.triangles, expected.triangles));
    EXPECT_TRUE(same_bytes(rows.positions, expected.positions));
    EXPECT_TRUE(same_bytes(rows.attributes, expected.attributes));
    check_pages(file, trace);
}

class Convert : public testing::Test {
  protected:
    std::filesystem::path path() const { return folder / "scene.pages"; }
    /// Converts a scene file with small buckets.
    PageFile converted(const std::filesystem::path& scene, std::uint32_t bucket_triangles = 1000) const {
        convert(*open_parts(scene), path(), {.bucket_triangles = bucket_triangles, .progress = {}});
        return PageFile(path());
    }
    /// Makes a scene with halflight-scenes, and returns its path.
    std::filesystem::path generated(const std::string& name, std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), {HALFLIGHT_PROGRAM, "city", (folder / name).string()});
        const test::Outcome outcome = test::run(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return folder / name;
    }
    TemporaryFolder folder;
};

TEST_F(Convert, RowsOfOurScenesEqualThoseInMemory) {
    for (const char* name : {"atrium", "cornell", "furnace", "still-life", "room"}) {
        SCOPED_TRACE(name);
        const std::filesystem::path scene =
            std::filesystem::path(HALFLIGHT_SOURCE_DIR) / "scenes" / fmt::format("{}.glb", name);
        expect_tables(converted(scene), load_gltf(scene));
    }
}

TEST_F(Convert, RowsOfCitiesEqualThoseInMemory) {
    for (const bool flatten : {true, false}) {
        std::vector<std::string> arguments = {"--triangles", "100000"};
        if (flatten) arguments.push_back("--flatten");
        const std::filesystem::path scene = generated("city.glb", arguments);
        const PageFile file = converted(scene, 20000);
        expect_tables(file, load_gltf(scene));
        EXPECT_GE(file.index().pages.size(), 8u);
    }
}

/// Adds a mesh of two primitives, which loading joins and repairs: textures with alpha, colours, a normal map, a
/// degenerate triangle, no material.
void add_details(GltfBuilder& b, const std::filesystem::path& folder) {
    write_png(folder / "image.png", 2, 1, 4, {255, 255, 255, 255, 0, 9, 99, 100});
    const int texture = b.push("textures", {{"source", b.push("images", {{"uri", "image.png"}})}});
    b.push("materials", {{"alphaMode", "MASK"},
                         {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}},
                         {"normalTexture", {{"index", texture}, {"texCoord", 1}}}});
    b.push("materials", {{"emissiveFactor", {1, 2, 3}}, {"alphaMode", "BLEND"}});
    std::vector<float> positions, uvs, colors;
    for (int i = 0; i < 60; ++i) {
        positions.insert(positions.end(), {float(i % 7), float(i % 5) + 0.1f * float(i), i == 30 ? NAN : float(i % 3)});
        uvs.insert(uvs.end(), {0.1f * float(i % 4), 0.3f * float(i % 9)});
        colors.insert(colors.end(), {0.5f, 0.25f, 1, i > 40 ? 0.5f : 1});
    }
    const int position = b.floats("VEC3", positions), uv = b.floats("VEC2", uvs);
    Json& first = b.add_mesh({{"POSITION", position}, {"TEXCOORD_0", uv}, {"TEXCOORD_1", uv}});
    first["material"] = 0;
    b.json["meshes"].back()["primitives"].push_back(
        {{"attributes", {{"POSITION", position}, {"COLOR_0", b.floats("VEC4", colors)}}}, {"material", 1}});
    b.json["meshes"].back()["primitives"].push_back({{"attributes", {{"POSITION", position}}}, {"mode", 5}});
}

TEST_F(Convert, ScenesInSeveralFilesAreJoined) {
    GltfBuilder b;
    add_details(b, folder.path);
    write_file(folder / "a.glb", b.glb());
    std::filesystem::copy_file(std::filesystem::path(HALFLIGHT_SOURCE_DIR) / "scenes/still-life.glb",
                               folder / "b c.glb");
    write_file(folder / "x.parts.json", R"({"parts": [{"uri": "a.glb"}, {"uri": "b%20c.glb"}]})");
    Scene both = load_gltf(folder / "a.glb");
    Scene second = load_gltf(folder / "b c.glb");
    if (both.materials.size() == 2) both.materials.emplace_back();  // each part has a default material
    const auto materials = static_cast<std::uint32_t>(both.materials.size());
    const int meshes = static_cast<int>(both.meshes.size()), images = static_cast<int>(both.images.size());
    for (Mesh& mesh : second.meshes)
        for (std::uint32_t& material : mesh.triangle_material) material += materials;
    for (Instance& instance : second.instances) instance.mesh += meshes;
    for (Material& material : second.materials)
        for (const MaterialTexture& texture : material_textures())
            if (material.*texture.field) (material.*texture.field).image += images;
    const auto append = [](auto& to, auto& from) { std::ranges::move(from, std::back_inserter(to)); };
    append(both.meshes, second.meshes), append(both.instances, second.instances);
    append(both.materials, second.materials), append(both.images, second.images);
    expect_tables(converted(folder / "x.parts.json"), both);
    EXPECT_EQ(open_parts(folder / "x.parts.json")->scene().cameras.size(), second.cameras.size());

    const std::pair<const char*, const char*> cases[] = {
        {"{}", "bad.parts.json: has no list of parts"},
        {R"({"parts": []})", "bad.parts.json: has no list of parts"},
        {R"({"parts": [{}]})", "bad.parts.json: parts[0]: "},
        {R"({"parts": [{"uri": "data:,"}]})", "bad.parts.json: parts[0]: "},
        {R"({"parts": [{"uri": "a.glb"}, {"uri": "../x.glb"}]})", "is outside the scene's folder"},
        {R"({"parts": [{"uri": "none.glb"}]})", "none.glb: cannot read"},
        {"[1,", "bad.parts.json: parse error"}};
    for (const auto& [text, message] : cases) {
        write_file(folder / "bad.parts.json", text);
        const std::string error = error_message([&] { open_parts(folder / "bad.parts.json"); });
        EXPECT_NE(error.find(message), std::string::npos) << error;
    }
}

TEST_F(Convert, DetailsAreThoseOfTheLoader) {
    GltfBuilder b;
    add_details(b, folder.path);
    b.add_triangle();
    b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 1, 1, 2, 2, 2})}});  // loading drops it
    b.push("nodes", {{"mesh", 0}, {"translation", {1e6, 5, 2}}, {"scale", {-1, 2, 3}}});
    b.push("nodes", {{"mesh", 2}});
    b.push("nodes", {{"mesh", 1}, {"scale", {1, 1, 0}}});     // flattened
    b.push("nodes", {{"mesh", 1}, {"scale", {1e-6, 1, 1}}});  // ill-conditioned, with slivers
    const std::filesystem::path scene = folder / "scene.glb";
    write_file(scene, b.glb());
    const Scene in_memory = load_gltf(scene);
    expect_tables(converted(scene, 10), in_memory);
    EXPECT_EQ(PageFile(path()).index().vertex_texels, 4u);
    EXPECT_TRUE(PageFile(path()).index().slivers);

    // Repairs and warnings are reported once, although meshes are read twice.
    const std::unique_ptr<MeshSource> source = open_parts(scene);
    convert(*source, path());
    const auto facts = [](const SceneReport& r) {
        return std::tuple(r.degenerate_triangles_dropped, r.non_finite_triangles_dropped, r.normals_generated,
                          std::set(r.warnings.begin(), r.warnings.end()));
    };
    EXPECT_EQ(facts(source->report()), facts(in_memory.report));
}

TEST_F(Convert, ScenesWithoutTrianglesAreEmptyFiles) {
    write_file(folder / "empty.gltf", R"({"asset": {"version": "2.0"}})");
    const PageFile file = converted(folder / "empty.gltf");
    EXPECT_EQ(file.index().triangles, 0u);
    EXPECT_TRUE(file.index().pages.empty());
    expect_tables(file, load_gltf(folder / "empty.gltf"));
}

TEST_F(Convert, FilesDoNotDependOnThreadsAndMemory) {
    const std::filesystem::path scene = generated("city.glb", {"--triangles", "25000"});
    converted(scene, 1500);
    const std::string bytes = bytes_of(path());
    for (const std::size_t threads : {1, 3}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const std::size_t memory = kLeastConvertBytes * threads;
        convert(*open_parts(scene), path(), {.memory = memory, .bucket_triangles = 1500, .progress = {}});
        EXPECT_TRUE(bytes_of(path()) == bytes) << threads;
    }
}

TEST_F(Convert, ManyTrianglesInOnePlaceAreSliced) {
    Scene scene;
    scene.name = "test";
    scene.materials.emplace_back();
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.positions = {vec3(0), vec3(1, 0, 0), vec3(0, 1, 0)};
    mesh.normals.assign(3, vec3(0, 0, 1));
    mesh.triangles.assign(5000, uvec3(0, 1, 2));
    mesh.triangle_material.assign(5000, 0);
    scene.instances.push_back({"one", 0, dmat4(1), kNone, false});
    SceneMeshes source(scene);
    convert(source, path(), {.bucket_triangles = 100, .progress = {}});
    expect_tables(PageFile(path()), scene);
}

TEST_F(Convert, RefusalsAreOneLineAndLeaveNothing) {
    write_file(path(), "old");
    const auto message = [&](const Scene& scene, const ConvertOptions& options = {}, rlim_t room = RLIM_INFINITY) {
        SceneMeshes source(scene);
        const std::string text = error_message([&] {
            const test::FileSizeLimit tight(room);
            convert(source, path(), options);
        });
        EXPECT_TRUE(bytes_of(path()) == "old");
        EXPECT_EQ(folder.entries(), std::vector<std::string>{"scene.pages"});
        return text;
    };
    const Scene box = test::cornell_box();
    Scene far = box;
    far.name = "box";
    far.instances[0].object_to_world = glm::translate(dmat4(1), dvec3(1e15, 0, 0));
    EXPECT_TRUE(message(far).starts_with("box: instance 0 "));
    EXPECT_NE(message(box, {.memory = 1000, .progress = {}}).find("needs 256 MiB of memory"), std::string::npos);
    // Progress may stop the conversion at any time.
    for (const double until : {0.0, 0.3, 0.7}) {
        const auto stop = [&](double share) {
            if (share >= until) throw Error("test", "stopped");
        };
        EXPECT_EQ(message(box, {.expected_triangles = 1, .progress = stop}), "test: stopped");
    }
    for (const rlim_t room : {10, 500, 1000}) {
        const std::string text = message(box, {}, room);
        EXPECT_TRUE(text.find(": cannot write") != std::string::npos && text.ends_with("File too large")) << text;
    }
}

TEST_F(Convert, MovingGeometryIsLeftOut) {
    GltfBuilder b;
    b.add_triangle();
    b.add_triangle();
    b.push("nodes", {{"mesh", 0}, {"translation", {3, 0, 0}}});  // a still instance of the mesh that moves
    b.json["nodes"][1]["children"] = {b.push("nodes", {{"mesh", 1}})};
    const int times = b.floats("SCALAR", {0, 1}), values = b.floats("VEC3", {0, 0, 0, 1, 0, 0});
    for (const int node : {0, 1}) b.animate(node, "translation", times, values);
    const std::filesystem::path scene = folder / "moving.glb";
    write_file(scene, b.glb());
    pack_scene(scene, path());
    const PageFile file(path());
    EXPECT_EQ(file.index().triangles, 1u) << "of four instances, one does not move";
    EXPECT_EQ(file.index().bounds.lower.x + file.index().origin.x, 3);

    // Lists of files have no poses.
    write_file(folder / "list.parts.json", R"({"parts": [{"uri": "moving.glb"}]})");
    EXPECT_TRUE(error_message([&] {
                    pack_scene(folder / "list.parts.json", folder / "list.pages");
                }).starts_with(scene.string() + ": has animations"));
    EXPECT_FALSE(std::filesystem::exists(folder / "list.pages"));
}

}  // namespace
}  // namespace halflight::paging
