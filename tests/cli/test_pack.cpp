// Tests `halflight pack` as a user runs it, and `halflight info` of its files.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>

#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "tests/cli/pack_test.h"

namespace halflight::test {
namespace {

constexpr const char* kTwoTexels =  // a PNG of 2 x 1 pixels with four channels
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABEAYAAACksqPJAAAAGklEQVR4nGP4/7+BQeg/AwMjA8P/1Wf//wcAPtIIBqaX"
    "8jwAAAAASUVORK5CYII=";

const std::string atrium = HALFLIGHT_SOURCE_DIR "/scenes/atrium.glb";

/// Writes a floor below a canopy with transparent texels and textured lamps.
void write_scene_with_lamps(const std::filesystem::path& path) {
    constexpr int kSide = 60;
    GltfBuilder b;
    std::vector<float> positions, normals, uvs;
    std::vector<std::uint32_t> floor, canopy, lamps;
    for (int layer = 0; layer < 3; ++layer)
        for (int y = 0; y <= kSide; ++y)
            for (int x = 0; x <= kSide; ++x) {
                const float height[] = {float((x * y) % 7) / 7, 12 + float((x + y) % 2), 6};
                positions.insert(positions.end(), {float(x), height[layer], float(y)});
                normals.insert(normals.end(), {0, 1, 0});
                uvs.insert(uvs.end(), {float(x) / 4, float(y) / 4});
            }
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            for (int layer = 0; layer < 3; ++layer) {
                if (layer == 2 && (x % 10 != 3 || y % 10 != 3)) continue;
                const auto i = static_cast<std::uint32_t>((layer * (kSide + 1) + y) * (kSide + 1) + x);
                std::vector<std::uint32_t>& to = layer == 0 ? floor : layer == 1 ? canopy : lamps;
                to.insert(to.end(), {i, i + 1, i + kSide + 1, i + 1, i + kSide + 2, i + kSide + 1});
            }
    b.push("images", {{"uri", kTwoTexels}});
    b.json["textures"] = {{{"source", 0}}};
    b.json["materials"] = {
        {{"name", "floor"}},
        {{"name", "canopy"},
         {"alphaMode", "BLEND"},
         {"doubleSided", true},
         {"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.8, 0.8, 0.5}}, {"baseColorTexture", {{"index", 0}}}}}},
        {{"name", "lamps"}, {"emissiveFactor", {1, 0.8, 0.5}}, {"emissiveTexture", {{"index", 0}}}}};
    const Json attributes = {{"POSITION", b.floats("VEC3", positions)},
                             {"NORMAL", b.floats("VEC3", normals)},
                             {"TEXCOORD_0", b.floats("VEC2", uvs)}};
    Json& primitive = b.add_mesh(attributes);
    primitive["indices"] = b.accessor("SCALAR", kU32, floor);
    primitive["material"] = 0;
    Json& primitives = b.json["meshes"][0]["primitives"];
    for (const auto& [indices, material] : {std::pair(&canopy, 1), std::pair(&lamps, 2)})
        primitives.push_back(
            {{"attributes", attributes}, {"indices", b.accessor("SCALAR", kU32, *indices)}, {"material", material}});
    write_text(path, b.glb());
}

TEST_F(Pack, WritesAFileThatInfoDescribes) {
    const Outcome quiet = pack(atrium, file("a.pages"), {"--quiet"});
    EXPECT_EQ(quiet.status, 0) << quiet.err;
    EXPECT_EQ(quiet.out + quiet.err, "");
    const Outcome told = pack(atrium, file("b.pages"));
    EXPECT_EQ(told.status, 0) << told.err;
    EXPECT_EQ(told.out, "");
    EXPECT_TRUE(std::regex_search(told.err, std::regex("halflight: [0-9]+ %, 0:[0-9]+ elapsed, 0:[0-9]+ remaining\n")))
        << told.err;
    EXPECT_TRUE(std::regex_search(told.err, std::regex("b.pages: .* written in 0:[0-9]+\n$"))) << told.err;
    EXPECT_TRUE(read_text(file("a.pages")) == read_text(file("b.pages")));
    EXPECT_EQ(folder.entries(), (Strings{"a.pages", "b.pages"}));
    EXPECT_EQ(pack(atrium, file("new/folder/a.pages"), {"--quiet"}).status, 0);

    const Outcome info = run_program({"info", file("a.pages"), "--json"});
    ASSERT_EQ(info.status, 0) << info.err;
    const Json facts = Json::parse(info.out);
    EXPECT_EQ(facts.at("bytes"), std::filesystem::file_size(file("a.pages")));
    EXPECT_GT(facts.at("triangles"), 70000);
    EXPECT_GT(facts.at("pages"), 5);
    EXPECT_LT(facts.at("bytes_per_triangle").at("pages"), 22) << "the goal for pages on disk";
    EXPECT_NE(run_program({"info", file("a.pages")}).out.find("\nbytes_per_triangle\n  pages "), std::string::npos);
}

TEST_F(Pack, ShowsABarOnATerminal) {
    const Outcome bar = pack(atrium, file("a.pages"), {}, {.environment = {"TERM=xterm"}, .terminal = true});
    EXPECT_EQ(bar.status, 0);
    EXPECT_TRUE(std::regex_search(bar.err, std::regex("\r\\[[#.]+\\] [0-9]+ %, 0:00 elapsed"))) << bar.err;
}

TEST_F(Pack, RefusalsAreOneLine) {
    const auto expect = [&](const Outcome& outcome, int status, const std::string& text) {
        EXPECT_EQ(outcome.status, status) << outcome.err;
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    };
    expect(run_program({"pack"}), 2, "SCENE: is missing");
    expect(run_program({"pack", atrium}), 2, "OUTPUT: is missing");
    expect(pack(atrium, file("a"), {"--json"}), 2, "--json");
    write_text(file("x.glb"), "x");
    expect(pack(file("x.glb"), file("x.glb")), 2, "is both input and output");
    expect(pack(file("x.glb"), file("a")), 1, "x.glb: is neither GLB nor glTF's JSON");
    expect(pack(file("no.glb"), file("a")), 1, "no.glb: cannot read: No such file");
    expect(pack(file("no.parts.json"), file("a")), 1, "no.parts.json: cannot read: No such file");
    expect(pack(atrium, file("x.glb/a")), 1, "x.glb/a: cannot write: Not a directory");
    expect(pack(atrium, file("a"), {"--memory", "300M"}), 1, "conversion at least 256 MiB), and");
    expect(pack(atrium, file("a"), {"--quiet"}, {.wrapper = {"prlimit", "--fsize=100000"}}), 1, "File too large");
    EXPECT_EQ(folder.entries(), Strings{"x.glb"});

    EXPECT_EQ(pack(atrium, file("a"), {"--quiet"}).status, 0);
    std::string bytes = read_text(file("a"));
    bytes[bytes.size() - 100] = static_cast<char>(bytes[bytes.size() - 100] ^ 4);
    write_text(file("bad"), bytes);
    expect(run_program({"info", file("bad")}), 1, "bad: its index is damaged");
    expect(run_program({"info", file("a"), "--needs"}), 1, "a: is a page file: --needs describes glTF scenes");
    expect(run_program({"info", atrium, "--check"}), 1, "is no page file: --check tests page files");
    expect(run_program({"info", "--check"}), 2, "--check: needs a page file");
    EXPECT_EQ(run_program({"info", file("a"), "--check"}).status, 0);
    bytes = read_text(file("a"));
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
    write_text(file("bad"), bytes);
    EXPECT_EQ(run_program({"info", file("bad")}).status, 0);
    expect(run_program({"info", file("bad"), "--check"}), 1, "bad: ");
}

TEST_F(Pack, PicturesEqualThoseOfTheSceneInMemory) {
    const std::string scene = large_scene(6);
    ASSERT_EQ(pack(scene, file("a.pages"), {"--quiet"}).status, 0);
    const Strings layers = {
        "--aov", "direct_diffuse,indirect_diffuse,indirect_glossy,albedo,normal,depth,ids,cryptoobject,cryptomaterial"};
    const Strings view = {"--width",   "64",          "--samples", "2",         "--env",
                          "1,0.9,0.8", "--look-from", "40,60,-50", "--look-at", "200,0,90"};
    const auto render = [&](const std::string& output, Strings more) {
        more.insert(more.end(), layers.begin(), layers.end());
        return Pack::render(scene, output, view, more);
    };
    ASSERT_EQ(render("core.exr", {}).status, 0);
    const std::string core = read_text(file("core.exr"));
    for (const char* pool : {"1M", "4M", "64M"}) {
        const Outcome paged = render("paged.exr", {"--pages", file("a.pages"), "--page-pool", pool});
        ASSERT_EQ(paged.status, 0) << paged.err;
        EXPECT_TRUE(read_text(file("paged.exr")) == core) << pool;
    }

    // Every surface is resident in a pool with room for all pages, and numbers do not depend on what is resident.
    const auto residency = [&](const char* pool) {
        const Strings more = {"--pages", file("a.pages"), "--page-pool", pool, "--aov", "residency"};
        EXPECT_EQ(Pack::render(scene, "residency.exr", view, more).status, 0);
        const ExrFile exr = read_exr(file("residency.exr"));
        return std::pair(exr.find("residency.subtree")->values, exr.find("residency.resident")->values);
    };
    const auto [all_subtrees, all_resident] = residency("64M");
    const auto [subtrees, resident] = residency("1M");
    EXPECT_EQ(subtrees, all_subtrees);
    EXPECT_EQ(std::ranges::count(all_resident, 0.0f), std::ranges::count(subtrees, 0.0f));
    EXPECT_GT(std::ranges::count(resident, 0.0f), std::ranges::count(subtrees, 0.0f));
    EXPECT_GT(std::ranges::count(resident, 1.0f), 0);

    const auto refused = [&](const Strings& more, const std::string& text) {
        const Outcome outcome = render("no.exr", more);
        EXPECT_EQ(outcome.status, 1);
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(file("no.exr")));
    };
    refused({"--pages", file("field.glb")}, "field.glb: is not a page file");
    refused({"--pages", file("none")}, "none: cannot read");
    ASSERT_EQ(pack(atrium, file("atrium.pages"), {"--quiet"}).status, 0);
    refused({"--pages", file("atrium.pages")}, "atrium.pages: was not made of");
}

TEST_F(Pack, LampsAndTransparentSurfacesArePaged) {
    const std::string scene = file("lamps.glb");
    write_scene_with_lamps(scene);
    ASSERT_EQ(pack(scene, file("a.pages"), {"--quiet"}).status, 0);
    const auto render = [&](const std::string& output, const Strings& more) {
        return Pack::render(scene, output,
                            {"--width", "64", "--samples", "4", "--env", "none", "--look-from", "10,30,-20",
                             "--look-at", "30,0,30", "--aov", "direct_diffuse,indirect_diffuse,emission,ids"},
                            more);
    };
    for (const char* choice : {"power", "tree", "all"}) {
        ASSERT_EQ(render("core.exr", {"--estimator", std::string("lights=") + choice}).status, 0);
        const std::string core = read_text(file("core.exr"));
        for (const char* pool : {"1M", "64M"}) {
            Strings pages = {"--estimator", std::string("lights=") + choice, "--pages", file("a.pages"), "--page-pool",
                             pool};
            for (const char* textures : {"in memory", "in tiles"}) {
                const Outcome paged = render("paged.exr", pages);
                ASSERT_EQ(paged.status, 0) << paged.err;
                EXPECT_TRUE(read_text(file("paged.exr")) == core)
                    << choice << ", " << pool << ", textures " << textures;
                pages.insert(pages.end(), {"--texture-pool", "1"});
            }
        }
    }
    const Outcome small = render("no.exr", {"--pages", file("a.pages"), "--memory", "170M"});
    EXPECT_EQ(small.status, 1);
    EXPECT_EQ(std::ranges::count(small.err, '\n'), 1) << small.err;
}

TEST_F(Pack, SurfacesSeenInMirrorsAreDenoisedAlike) {
    const std::string scene = HALFLIGHT_SOURCE_DIR "/scenes/still-life.glb";
    ASSERT_EQ(pack(scene, file("a.pages"), {"--quiet"}).status, 0);
    const auto render = [&](const std::string& output, const Strings& more) {
        return Pack::render(scene, output, {"--width", "64", "--samples", "2", "--denoise"}, more);
    };
    ASSERT_EQ(render("core.exr", {}).status, 0);
    ASSERT_EQ(render("paged.exr", {"--pages", file("a.pages"), "--page-pool", "1M"}).status, 0);
    EXPECT_TRUE(read_text(file("paged.exr")) == read_text(file("core.exr")));
}

TEST_F(Pack, ScenesThatDoNotFitIntoMemoryAreConvertedOnce) {
    const std::string scene = large_scene(1, 500, 8);
    const auto render = [&](const std::string& input, const Strings& more, const RunOptions& options = {}) {
        RunOptions with_cache = options;
        with_cache.environment.push_back("XDG_CACHE_HOME=" + file("cache"));
        Strings arguments = {"render",    input,         file("a.exr"), "--width",   "32",
                             "--samples", "1",           "--env",       "1,0.9,0.8", "--memory",
                             "900M",      "--look-from", "40,60,-50",   "--look-at", "200,0,90"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments, with_cache);
    };
    const Outcome refused = render(scene, {"--pages", "none", "--quiet"});
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find("of the budget of 900 MiB are left (--memory)"), std::string::npos) << refused.err;
    EXPECT_EQ(std::ranges::count(refused.err, '\n'), 1) << refused.err;

    const std::filesystem::path cache = file("cache/halflight/scenes");
    for (const int signal : {SIGINT, SIGKILL}) {
        RunOptions interrupted;
        interrupted.watch = [&](pid_t child, const std::string& err) {
            if (std::ranges::count(err, '\n') >= 3) kill(child, signal);
        };
        const Outcome stopped = render(scene, {}, interrupted);
        EXPECT_EQ(stopped.status, 128 + signal);
        EXPECT_EQ(stopped.err.ends_with("field.glb: not converted: interrupted\n"), signal == SIGINT) << stopped.err;
        EXPECT_TRUE(std::filesystem::is_empty(cache));
        EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
    }

    const Outcome first = render(scene, {});
    EXPECT_EQ(first.status, 0) << first.err;
    EXPECT_NE(first.err.find("the scene does not fit into memory; it is converted to"), std::string::npos) << first.err;
    EXPECT_NE(first.err.find(" %, 0:"), std::string::npos) << first.err;
    ASSERT_EQ(std::distance(std::filesystem::directory_iterator(cache), {}), 1);
    const std::filesystem::path pages = std::filesystem::directory_iterator(cache)->path();
    const Outcome second = render(scene, {});
    EXPECT_EQ(second.status, 0) << second.err;
    EXPECT_EQ(second.err.find("converted"), std::string::npos) << second.err;

    // A damaged file is made anew, and a list of files is always rendered from pages.
    std::filesystem::resize_file(pages, 1000);
    write_text(file("list.parts.json"), R"({"parts": [{"uri": "field.glb"}]})");
    const Json facts = Json::parse(run_program({"info", file("list.parts.json"), "--json"}).out);
    EXPECT_EQ(facts.at("bytes"), std::filesystem::file_size(file("field.glb")));
    EXPECT_EQ(facts.at("files"), 1);
    EXPECT_GT(facts.at("triangles_with_instances"), 0);
    const Outcome needs = run_program({"info", file("list.parts.json"), "--needs"});
    EXPECT_EQ(needs.status, 1);
    EXPECT_NE(needs.err.find("list.parts.json: is a list of files: --needs describes single files"), std::string::npos);
    const Outcome list = render(file("list.parts.json"), {});
    EXPECT_EQ(list.status, 0) << list.err;
    EXPECT_NE(list.err.find("it is converted to"), std::string::npos) << list.err;
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(cache), {}), 1);
    const Outcome played = render(file("list.parts.json"), {"--animation", "lift", "--quiet"});
    EXPECT_EQ(played.status, 1);
    EXPECT_TRUE(played.err.ends_with("is a list of files, whose animations cannot play\n")) << played.err;
    const Outcome none = render(file("list.parts.json"), {"--pages", "none", "--quiet"});
    EXPECT_EQ(none.status, 1);
    EXPECT_NE(none.err.find("list.parts.json: is a list of files, which needs a page file"), std::string::npos);

    large_scene(1, 500, 8, true);
    const Outcome animated = render(scene, {"--animation", "lift", "--frame", "10"});
    EXPECT_EQ(animated.status, 0) << animated.err;
    EXPECT_NE(animated.err.find("it is converted to"), std::string::npos) << animated.err;
    const Outcome moving_list = render(file("list.parts.json"), {"--quiet"});
    EXPECT_EQ(moving_list.status, 1);
    EXPECT_TRUE(moving_list.err.ends_with("which lists of files cannot have\n")) << moving_list.err;
}

TEST_F(Pack, TakesGeneratedScenes) {
    const std::string generator = std::filesystem::path(HALFLIGHT_PROGRAM).parent_path() / "halflight-scenes";
    const auto pages_of = [&](const char* kind, const Strings& form, const std::string& scene) {
        Strings command = {generator, kind, file("scene.glb"), "--triangles", "250000"};
        command.insert(command.end(), form.begin(), form.end());
        const Outcome made = run(command);
        EXPECT_EQ(made.status, 0) << made.err;
        const Outcome packed = pack(file(scene), file("scene.pages"), {"--quiet"});
        EXPECT_EQ(packed.status, 0) << packed.err;
        const Json facts = Json::parse(run_program({"info", file("scene.pages"), "--json"}).out);
        EXPECT_NEAR(facts.at("triangles").get<double>(), 250000, 0.03 * 250000) << kind;
        return facts.at("triangles").get<std::uint64_t>();
    };
    const auto render = [&](const std::string& output, const Strings& more) {
        const Outcome outcome =
            Pack::render(file("scene.glb"), output,
                         {"--camera", "inside", "--width", "96", "--samples", "2", "--aov", "depth,normal,ids"}, more);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_text(file(output));
    };
    for (const char* kind : {"airliner", "powerplants"}) {
        const std::uint64_t shared = pages_of(kind, {}, "scene.glb");
        EXPECT_EQ(pages_of(kind, {"--parts"}, "scene.parts.json"), shared) << kind;
        EXPECT_EQ(pages_of(kind, {"--flatten"}, "scene.glb"), shared) << kind;
        const std::string core = render("core.exr", {});
        const std::string paged = render("paged.exr", {"--pages", file("scene.pages"), "--page-pool", "8M"});
        EXPECT_TRUE(paged == core) << kind;
    }
}

TEST_F(Pack, InterruptedConversionsLeaveNothing) {
    const std::string scene = large_scene();
    const std::string old = "\x89HLP\r\n\x1a\n and more of an older page file";
    write_text(file("a.pages"), old);
    const auto entries = folder.entries();
    for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
        for (const int lines : {1, 4, 7}) {  // progress in the three steps of the conversion
            bool sent = false;
            RunOptions options;
            options.watch = [&](pid_t child, const std::string& err) {
                if (!sent && std::ranges::count(err, '\n') >= lines) sent = kill(child, signal) == 0;
            };
            const Outcome outcome = pack(scene, file("a.pages"), {}, options);
            EXPECT_EQ(outcome.status, 128 + signal) << outcome.err;
            // A kill between naming the complete file and renaming it leaves a name, which the next run removes.
            if (signal == SIGKILL) remove_abandoned(std::vector<std::filesystem::path>{file("a.pages")});
            EXPECT_EQ(folder.entries(), entries) << signal << " after " << lines;
            EXPECT_TRUE(read_text(file("a.pages")) == old);
            if (signal == SIGKILL) continue;
            EXPECT_TRUE(outcome.err.ends_with("a.pages: not written: interrupted\n")) << outcome.err;
        }
    }
}

TEST_F(Pack, StaysWithinItsMemory) {
    const Outcome outcome = pack(large_scene(), file("a.pages"), {"--memory", "640M"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LT(outcome.peak_bytes, std::size_t{640} << 20);
#endif
}

}  // namespace
}  // namespace halflight::test
