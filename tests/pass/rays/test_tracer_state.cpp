// Tests that tile lists kept from run to run save time and change no hit. The lists are garbage, come from other
// cameras and scenes, or have single wrong bits. Cameras move, cut and stop.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <random>

#include "engine/rays/tiles.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using namespace test;
using graph::Access;
using rays::NodeFormat;

constexpr std::uint32_t kRays = 64 * 64;
const rays::RayBatch kAll = [] {
    rays::RayBatch batch;
    batch.capacity = kRays;
    return batch;
}();

/// Record of a tile list, in words.
struct Record {
    std::span<std::uint32_t> words;
    std::size_t entry_words;
    std::size_t capacity;

    std::uint32_t& counts() const { return words[7]; }
    /// Returns a random word that has a meaning: part of a corner, the checksum, the counts, or an entry.
    std::uint32_t& any_word(std::mt19937& random) const {
        const std::size_t leaves = counts() & 0xffffu, others = counts() >> 16, entries = leaves + others;
        std::size_t i = random() % (14 + entries * entry_words);
        if (i < 14) return words[i < 11 ? i : i + 1];  // words 11 and 15 are unused
        i -= 14;
        const std::size_t entry = i / entry_words;
        const std::size_t place = entry < leaves ? entry : capacity - 1 - (entry - leaves);
        return words[4 * shared::kTileHeaderTexels + place * entry_words + i % entry_words];
    }
};

/// Runs the steps of culling by compute on lists and blockers that the test owns.
class Steps {
  public:
    Steps(gpu::ProgramCache& programs, const Scene& scene, NodeFormat format, const rays::TileSettings& settings = {})
        : tables_(build_trace_tables(scene)),
          scene_(tables_, roomy(rays::pack_scene(tables_, format)), {}),
          entry_words_(format == NodeFormat::grid ? 4 : 8),
          settings_(settings),
          tiles(rays::tile_count(kAll, settings)),
          lists(rays::tile_list_bytes(scene_, kAll, settings) / sizeof(std::uint32_t)),
          blockers(tiles * sizeof(shared::TileBlockers) / sizeof(std::uint32_t)),
          executor_(programs) {
        executor_.poison(true);
    }

    Answers plain(std::span<const Ray> rays) { return answers(executor_, {rays}, scene_); }

    /// Runs closest and any hits with `lists` and `blockers`, and stores the new ones. If `cull` is false, the lists
    /// are used unchanged.
    Answers by_tiles(std::span<const Ray> rays, bool cull = true) {
        const auto before = lists;
        Answers found;
        found.hits = run<Hit>(rays, false, cull);
        const std::uint32_t culled_for_hits = culled;
        lists = before;
        found.occluded = run<std::uint32_t>(rays, true, cull);
        EXPECT_EQ(culled, culled_for_hits);
        return found;
    }

    Record record(std::size_t tile) {
        const std::size_t words = lists.size() / tiles;
        return {std::span(lists).subspan(tile * words, words), entry_words_, settings_.capacity};
    }

  private:
    template <class Result>
    std::vector<Result> run(std::span<const Ray> rays, bool any, bool cull) {
        gpu::Buffer lists_buffer = gpu::Buffer::from("lists", lists);
        gpu::Buffer blockers_buffer = gpu::Buffer::from("blockers", blockers);
        const gpu::Buffer culled_buffer("culled", sizeof(std::uint32_t));
        const auto add = [&](graph::Graph& graph, const rays::RayBatch& batch, graph::BufferHandle results) {
            rays::TileBuffers t;
            t.settings = settings_;
            t.lists = graph.import_buffer("lists", lists_buffer);
            t.blockers = graph.import_buffer("blockers", blockers_buffer);
            t.rest = graph.create_buffer("rest", {rest_bytes(batch, settings_)});
            t.rest_header = graph.create_buffer("rest header", {sizeof(shared::RestHeader)});

            graph::Pass pass = graph.add_pass("cull");
            pass.read(batch.rays, Access::texture_read);
            t.lists = pass.write(t.lists, Access::storage_read_write);
            t.blockers = pass.write(t.blockers, Access::storage_read_write);
            pass.execute([=, this, &culled_buffer](graph::Resources& r) {
                if (cull) cull_tiles(r, scene_, batch, t, any, culled_buffer);
            });

            pass = graph.add_pass("search");
            pass.read(batch.rays, Access::texture_read);
            pass.read(t.lists, Access::texture_read);
            t.blockers = pass.write(t.blockers, Access::storage_read_write);
            t.rest = pass.write(t.rest, Access::storage_write);
            t.rest_header = pass.write(t.rest_header, Access::storage_write);
            results = pass.write(results, Access::storage_write);
            pass.execute([=, this](graph::Resources& r) { search_tiles(r, scene_, batch, t, results, any); });

            pass = graph.add_pass("rest");
            pass.read(batch.rays, Access::texture_read);
            pass.read(t.lists, Access::texture_read);
            pass.read(t.rest, Access::storage_read);
            pass.read(t.rest_header, Access::storage_read);
            pass.read(t.rest_header, Access::indirect_read);
            results = pass.write(results, Access::storage_read_write);
            pass.execute([=, this](graph::Resources& r) { search_rest(r, scene_, batch, t, results, any); });
            return results;
        };
        const std::vector<Result> results = run_trace<Result>(executor_, {rays}, add);
        lists = lists_buffer.read<std::uint32_t>();
        blockers = blockers_buffer.read<std::uint32_t>();
        culled = culled_buffer.read<std::uint32_t>().front();
        return results;
    }

    TraceTables tables_;
    rays::TraceScene scene_;
    std::size_t entry_words_;
    rays::TileSettings settings_;

  public:
    std::uint32_t tiles;
    std::vector<std::uint32_t> lists;
    std::vector<std::uint32_t> blockers;
    std::uint32_t culled = 0;  // lists made in the last run

  private:
    graph::Executor executor_;
};

class TracerState : public GpuTest {
  protected:
    gpu::ProgramCache programs;
    std::mt19937 random{1};
    const std::vector<Ray> here = camera_rays(vec3(0.1f, 0.2f, 2), vec3(0));
    const std::vector<Ray> there = camera_rays(vec3(1.6f, -0.4f, 1), vec3(0));
};

struct ListKind {
    const char* name;
    NodeFormat format = NodeFormat::grid;
    rays::TileSettings settings{};
};
class TracerStateOfKind : public TracerState, public testing::WithParamInterface<ListKind> {
  protected:
    Steps steps{programs, soup(2000, 0.08f, vec3(1), 3), GetParam().format, GetParam().settings};
};
INSTANTIATE_TEST_SUITE_P(ListKinds, TracerStateOfKind,
                         testing::Values(ListKind{"Grid"}, ListKind{"Floating", NodeFormat::floating},
                                         ListKind{"LargeTiles", NodeFormat::grid, {16, 32}},
                                         ListKind{"ShortLists", NodeFormat::grid, {8, 12}},
                                         ListKind{"LongLists", NodeFormat::grid, {8, 64}},
                                         ListKind{"LargeTilesShortLists", NodeFormat::floating, {16, 12}}),
                         [](const auto& kind) { return kind.param.name; });

TEST_P(TracerStateOfKind, ListsAreKeptAndUsed) {
    const Answers plain = steps.plain(here);
    EXPECT_EQ(different(steps.by_tiles(here), plain), 0u);
    EXPECT_EQ(steps.culled, steps.tiles);
    EXPECT_EQ(different(steps.by_tiles(here), plain), 0u);
    EXPECT_EQ(steps.culled, 0u);

    // Validates the tests below: wrong lists give wrong hits if nothing checks them.
    const auto good = steps.lists;
    EXPECT_EQ(different(steps.by_tiles(here, false), plain), 0u);
    EXPECT_GT(different(steps.by_tiles(there, false), steps.plain(there)), kRays / 20);
    for (std::size_t tile = 0; tile < steps.tiles; ++tile) steps.record(tile).counts() = 0;
    EXPECT_GT(different(steps.by_tiles(here, false), plain), kRays / 20);
    steps.lists = good;
    for (const std::size_t tile : {0u, steps.tiles / 3, steps.tiles - 1}) steps.record(tile).counts() = 0;
    EXPECT_EQ(different(steps.by_tiles(here), plain), 0u);
    EXPECT_EQ(steps.culled, 3u);
}

TEST_P(TracerStateOfKind, GarbageChangesNoHit) {
    const Answers plain = steps.plain(here);
    const auto fill = [&](auto word) {
        for (std::uint32_t& w : steps.lists) w = word();
        for (std::uint32_t& w : steps.blockers) w = word();
    };
    const std::vector<std::function<std::uint32_t()>> garbage{
        [&] { return static_cast<std::uint32_t>(random()); },
        [&] { return static_cast<std::uint32_t>(random() % 20); },
        [&] { return std::bit_cast<std::uint32_t>(std::ldexp(1.0f, static_cast<int>(random() % 40) - 20)); },
        [] { return 0u; },
        [] { return ~0u; },          // a NaN
        [] { return 0x7f800000u; },  // an infinity
        [] { return 0x00100010u; },  // 16 leaves and 16 other entries
    };
    for (std::size_t i = 0; i < garbage.size(); ++i) {
        for (int turn = 0; turn < (i < 3 ? 3 : 1); ++turn) {
            fill(garbage[i]);
            if (turn % 2 == 1) {  // the counts are valid
                const std::uint32_t half = GetParam().settings.capacity / 2;
                for (std::size_t t = 0; t < steps.tiles; ++t)
                    steps.record(t).counts() = random() % (half + 1) | random() % half << 16;
            }
            EXPECT_EQ(different(steps.by_tiles(here), plain), 0u) << i;
            EXPECT_EQ(steps.culled, steps.tiles) << i;
        }
    }
}

// A record has some 130 words. 1900 flipped bits for each kind of small tiles find an unchecked word with near
// certainty.
TEST_P(TracerStateOfKind, OneWrongBitIsDetected) {
    const Answers plain = steps.plain(here);
    steps.by_tiles(here);
    const auto good = steps.lists;
    for (int turn = 0; turn < 30; ++turn) {
        steps.lists = good;
        for (std::size_t t = 0; t < steps.tiles; ++t) steps.record(t).any_word(random) ^= 1u << random() % 32;
        EXPECT_EQ(different(steps.by_tiles(here), plain), 0u) << turn;
        EXPECT_EQ(steps.culled, steps.tiles) << turn;
    }
}

TEST_P(TracerStateOfKind, WrongCountsAreDetected) {
    const Answers plain = steps.plain(here);
    steps.by_tiles(here);
    const auto good = steps.lists;
    const std::vector<std::function<std::uint32_t(std::uint32_t)>> wrong{
        [](std::uint32_t) { return 0u; },
        [](std::uint32_t c) { return c - 1; },
        [](std::uint32_t c) { return c + 1; },
        [](std::uint32_t c) { return c + 0x10000u; },
        [](std::uint32_t c) { return (c & 0xffffu) | 0xffff0000u; },
        [](std::uint32_t c) { return c << 16 | c >> 16; },
    };
    for (std::size_t i = 0; i < wrong.size(); ++i) {
        steps.lists = good;
        std::uint32_t changed = 0;
        for (std::size_t t = 0; t < steps.tiles; ++t) {
            std::uint32_t& counts = steps.record(t).counts();
            changed += wrong[i](counts) != counts ? 1 : 0;
            counts = wrong[i](counts);
        }
        EXPECT_EQ(different(steps.by_tiles(here), plain), 0u) << i;
        EXPECT_EQ(steps.culled, changed) << i;
        EXPECT_GT(changed, steps.tiles / 2) << i;
    }
}

TEST_P(TracerStateOfKind, ListsOfOtherTilesAndCameras) {
    steps.by_tiles(there);
    EXPECT_EQ(different(steps.by_tiles(here), steps.plain(here)), 0u);
    EXPECT_GT(steps.culled, steps.tiles / 2);

    // A record is valid for all rays inside its shaft, wherever it is stored.
    std::rotate(steps.lists.begin(), steps.lists.begin() + 5 * static_cast<long>(steps.record(0).words.size()),
                steps.lists.end());
    std::shuffle(steps.blockers.begin(), steps.blockers.end(), random);
    EXPECT_EQ(different(steps.by_tiles(here), steps.plain(here)), 0u);
}

/// Returns random triangles inside fixed bounds.
Scene boxed_soup(std::uint32_t seed) {
    Scene scene = soup(2000, 0.08f, vec3(1), seed);
    for (const float corner : {-1.2f, 1.2f}) {
        Mesh& mesh = scene.meshes[0];
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (int k = 0; k < 3; ++k)
            mesh.positions.emplace_back(corner, k == 1 ? 0.99f * corner : corner, k == 2 ? 0.99f * corner : corner);
        mesh.normals.resize(mesh.positions.size(), vec3(0, 1, 0));
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        mesh.triangle_material.push_back(0);
    }
    return scene;
}

TEST_P(TracerStateOfKind, ListsOfOtherScenes) {
    Steps one(programs, boxed_soup(3), GetParam().format, GetParam().settings),
        other(programs, boxed_soup(4), GetParam().format, GetParam().settings);
    one.by_tiles(here);
    other.lists = one.lists;
    other.blockers = one.blockers;
    EXPECT_EQ(different(other.by_tiles(here), other.plain(here)), 0u);
    EXPECT_EQ(other.culled, other.tiles);
    // Validates the test: if nothing checks the lists of another scene, hits are wrong.
    other.lists = one.lists;
    EXPECT_GT(different(other.by_tiles(here, false), other.plain(here)), kRays / 20);
}

/// Returns camera rays along a path through [-1, 1]^3 with a cut every 20 frames.
std::vector<Ray> frame_of_path(int frame) {
    const float a = 0.02f * static_cast<float>(frame) + 2.4f * static_cast<float>(frame / 20);
    const vec3 eye = (1.2f + 0.9f * std::sin(2.3f * a)) * vec3(std::cos(a), 0.3f * std::sin(3 * a), std::sin(a));
    return camera_rays(eye, 0.5f * vec3(std::sin(5 * a), 0, std::cos(4 * a)));
}

TEST_F(TracerState, MovingCameraWithCuts) {
    AgainstPlain pair(programs, build_trace_tables(instanced_spheres()), NodeFormat::grid, kTilesAlone);
    std::size_t bytes = 0;
    for (int frame = 0; frame < 100; ++frame) {
        if (frame == 40) {  // only this cut is signalled
            pair.history().invalidate("cut");
            pair.tiles().invalidate();
        }
        ASSERT_EQ(pair.differences({frame_of_path(frame)}), "") << frame;
        if (frame == 0) bytes = pair.history().bytes();
        ASSERT_EQ(pair.history().bytes(), bytes) << frame;
    }
    EXPECT_GT(bytes, 0u);
}

TEST_F(TracerState, StillFramesSoonKeepTheirLists) {
    AgainstPlain pair(programs, build_trace_tables(soup(2000, 0.08f, vec3(1), 3)), NodeFormat::grid, kTilesAlone);
    std::uniform_real_distribution<float> uniform;
    const std::uint32_t tiles = rays::tile_count(kAll, {});
    const auto made_in = [&](int frames) {
        const auto culled = [&] {
            const auto all = pair.tiles().statistics();
            return all.empty() ? 0 : all.front().tiles_culled;
        };
        const std::uint64_t before = culled();
        for (int i = 0; i < frames; ++i) {
            const vec2 jitter(uniform(random), uniform(random));
            EXPECT_EQ(pair.differences({camera_rays(vec3(0.1f, 0.2f, 2), vec3(0), jitter)}), "");
        }
        return culled() - before;
    };
    EXPECT_EQ(made_in(1), tiles);
    made_in(31);
    EXPECT_LT(made_in(16), tiles);  // 32 times as many are possible
    pair.history().invalidate("new scene, say");
    EXPECT_EQ(made_in(1), tiles);
}

TEST_F(TracerState, RememberedLeavesThatEndRaysAreCounted) {
    AgainstPlain pair(programs, build_trace_tables(soup(2000, 0.08f, vec3(1), 3)), NodeFormat::grid, kTilesAlone);
    pair.tiles().count();
    const auto remembered = [&] { return pair.tiles().statistics().front().lists.remembered; };
    for (int i = 0; i < 2; ++i) EXPECT_EQ(pair.differences({here}), "");
    const std::uint64_t before = remembered();
    EXPECT_EQ(pair.differences({here}), "");
    const std::vector<std::uint32_t> occluded =
        Steps(programs, soup(2000, 0.08f, vec3(1), 3), NodeFormat::grid).plain(here).occluded;
    const auto ended = static_cast<std::uint64_t>(std::ranges::count(occluded, shared::kOccluded));
    EXPECT_LE(remembered() - before, ended);
    EXPECT_GT(remembered() - before, ended / 8);  // the rest of their lists ended the other rays
}

}  // namespace
}  // namespace halflight
