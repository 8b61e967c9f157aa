// Tests `halflight pack` as a user runs it, and `halflight info` of its files.
#include <signal.h>

#include <regex>

#include "engine/io/files.h"
#include "tests/cli/pack_test.h"

namespace halflight::test {
namespace {

const std::string kAtrium = HALFLIGHT_SOURCE_DIR "/scenes/atrium.glb";

/// Writes a floor below a canopy with transparent texels and textured lamps.
void write_scene_with_lamps(const std::filesystem::path& path) {
    constexpr int kSide = 60;
    GltfBuilder b;
    const float heights[] = {0, 12, 6};  // heights of floor, canopy and lamps
    const auto [floor, triangles] = field(kSide, 7, 1.0f / 7);
    std::vector<float> positions, normals, uvs;
    std::vector<std::uint32_t> indices[3];
    for (std::uint32_t layer = 0; layer < 3; ++layer) {
        const auto first = static_cast<std::uint32_t>(positions.size() / 3);
        for (std::size_t i = 0; i < floor.size(); i += 3) {
            positions.insert(positions.end(),
                             {floor[i], heights[layer] + (layer < 2 ? floor[i + 1] : 0), floor[i + 2]});
            normals.insert(normals.end(), {0, 1, 0});
            uvs.insert(uvs.end(), {floor[i] / 4, floor[i + 2] / 4});
        }
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            const std::size_t cell = i / 6, x = cell % kSide, y = cell / kSide;
            if (layer < 2 || (x % 10 == 3 && y % 10 == 3)) indices[layer].push_back(first + triangles[i]);
        }
    }
    b.push("images", {{"uri", kPng16}});
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
    b.add_mesh(attributes);
    Json primitives = Json::array();
    for (int layer = 0; layer < 3; ++layer)
        primitives.push_back(
            {{"attributes", attributes}, {"indices", b.accessor("SCALAR", kU32, indices[layer])}, {"material", layer}});
    b.json["meshes"][0]["primitives"] = primitives;
    write_text(path, b.glb());
}

TEST_F(Pack, WritesAFileThatInfoDescribes) {
    const Outcome quiet = done(words("pack", kAtrium, file("a.pages"), "--quiet"));
    EXPECT_EQ(quiet.out + quiet.err, "");
    const Outcome told = done({"pack", kAtrium, file("new/folder/b.pages")});
    EXPECT_EQ(told.out, "");
    EXPECT_TRUE(std::regex_search(told.err, std::regex("halflight: [0-9]+ %, 0:[0-9]+ elapsed, "))) << told.err;
    EXPECT_TRUE(read_text(file("a.pages")) == read_text(file("new/folder/b.pages")));
    EXPECT_EQ(folder.entries(), words("a.pages new"));

    const Json facts = Json::parse(done({"info", file("a.pages"), "--json"}).out);
    EXPECT_EQ(facts.at("bytes"), std::filesystem::file_size(file("a.pages")));
    EXPECT_GT(facts.at("triangles"), 70000);
    EXPECT_GT(facts.at("pages"), 5);
    EXPECT_LT(facts.at("bytes_per_triangle").at("pages"), 22) << "the goal for pages on disk";
    expect_has(done({"info", file("a.pages")}).out, "bytes_per_triangle\n  pages ");
    const Outcome bar = done({"pack", kAtrium, file("a.pages")}, {.environment = {"TERM=xterm"}, .terminal = true});
    EXPECT_TRUE(std::regex_search(bar.err, std::regex("\r\\[[#.]+\\] [0-9]+ %, 0:00 elapsed"))) << bar.err;
}

TEST_F(Pack, RefusalsAreOneLine) {
    write_text(file("x.glb"), "x");
    const Strings atrium = words("pack", kAtrium, file("a.pages"));
    refused(2, {"pack", file("x.glb"), file("x.glb")}, "is both input and output");
    for (const char* scene : {"x.glb", "no.glb", "no.parts.json"})
        refused(1, {"pack", file(scene), file("a.pages")}, scene + std::string(": "));
    refused(1, {"pack", kAtrium, file("x.glb/a")}, "x.glb/a: cannot write");
    refused(1, words(atrium, "--memory 300M"), "atrium.glb: needs ");
    refused(1, words(atrium, "--quiet"), "a.pages: ", {.wrapper = {"prlimit", "--fsize=100000"}});

    std::string bytes = read_text(packed(kAtrium));
    const auto damaged = [&](std::size_t at) {
        std::string bad = bytes;
        bad[at] = static_cast<char>(bad[at] ^ 4);
        write_text(file("bad"), bad);
        return file("bad");
    };
    refused(1, {"info", damaged(bytes.size() - 100)}, "bad: ");  // damages the index
    refused(1, {"info", file("a.pages"), "--needs"}, "a.pages: ");
    refused(1, {"info", kAtrium, "--check"}, "atrium.glb: ");
    done({"info", file("a.pages"), "--check"});
    done({"info", damaged(bytes.size() / 2)});
    refused(1, {"info", file("bad"), "--check"}, "bad: ");
}

TEST_F(Pack, PicturesEqualThoseOfTheSceneInMemory) {
    const std::string scene = large_scene(6), pages = packed(scene);
    const Strings view = words("--width 64 --samples 2 --env 1,0.9,0.8 --look-from 40,60,-50 --look-at 200,0,90");
    const Strings layers = words(
        view,
        "--aov direct_diffuse,indirect_diffuse,indirect_glossy,albedo,normal,depth,ids,cryptoobject,cryptomaterial");
    const std::string core = picture(scene, layers);
    for (const char* pool : {"1M", "64M"})
        EXPECT_TRUE(picture(scene, layers, "--pages", pages, "--page-pool", pool) == core) << pool;

    // Every surface is resident in a pool with room for all pages, and numbers do not depend on what is resident.
    const auto residency = [&](const char* pool) {
        picture(scene, view, "--pages", pages, "--aov residency --page-pool", pool);
        const ExrFile exr = read_exr(file("a.exr"));
        return std::pair(exr.find("residency.subtree")->values, exr.find("residency.resident")->values);
    };
    const auto [all_subtrees, all_resident] = residency("64M");
    const auto [subtrees, resident] = residency("1M");
    EXPECT_EQ(subtrees, all_subtrees);
    EXPECT_EQ(std::ranges::count(all_resident, 0.0f), std::ranges::count(subtrees, 0.0f));
    EXPECT_GT(std::ranges::count(resident, 0.0f), std::ranges::count(subtrees, 0.0f));
    EXPECT_GT(std::ranges::count(resident, 1.0f), 0);

    done(words("pack", kAtrium, file("atrium.pages"), "--quiet"));
    for (const char* other : {"field.glb", "none", "atrium.pages"})
        refused(1, words("render", scene, file("no.exr"), "--quiet --pages", file(other), view),
                other + std::string(": "));
}

TEST_F(Pack, LampsAndTransparentSurfacesArePaged) {
    write_scene_with_lamps(file("lamps.glb"));
    const std::string pages = packed(file("lamps.glb"));
    const Strings view = words("--width 64 --samples 4 --env none --look-from 10,30,-20 --look-at 30,0,30",
                               "--aov direct_diffuse,indirect_diffuse,emission,ids");
    for (const char* lights : {"lights=power", "lights=tree", "lights=all"}) {
        const Strings with = words(view, "--estimator", lights);
        const std::string core = picture(file("lamps.glb"), with);
        for (const char* pool : {"--page-pool 1M", "--page-pool 64M"})
            for (const char* textures : {"", "--texture-pool 1"})
                EXPECT_TRUE(picture(file("lamps.glb"), with, "--pages", pages, pool, textures) == core)
                    << lights << pool << textures;
    }
    refused(1, words("render", file("lamps.glb"), file("no.exr"), "--pages", pages, "--memory 170M --quiet", view),
            "memory");
}

TEST_F(Pack, SurfacesSeenInMirrorsAreDenoisedAlike) {
    const std::string scene = HALFLIGHT_SOURCE_DIR "/scenes/still-life.glb";
    const Strings pages = words("--pages", packed(scene), "--page-pool 1M");
    const char* const view = "--width 64 --samples 2 --denoise";
    EXPECT_TRUE(picture(scene, view, pages) == picture(scene, view));
}

TEST_F(Pack, ScenesThatDoNotFitIntoMemoryAreConvertedOnce) {
    const std::string scene = large_scene(1, 500, 8);
    const std::string list = file("list.parts.json");
    const auto command = [&](const std::string& input, const char* more) {
        return words("render", input, file("a.exr"), "--width 32 --samples 1 --env 1,0.9,0.8 --memory 900M",
                     "--look-from 40,60,-50 --look-at 200,0,90", more);
    };
    std::filesystem::create_directory(file("cache"));
    const RunOptions cached{.environment = {"XDG_CACHE_HOME=" + file("cache")}};
    const auto converts = [&](const std::string& input, const char* more = "") {
        return has(done(command(input, more), cached).err, "it is converted to");
    };
    refused(1, command(scene, "--pages none --quiet"), "(--memory)", cached);

    const std::filesystem::path cache = file("cache/halflight/scenes");
    for (const int signal : {SIGINT, SIGKILL}) {
        RunOptions interrupted = cached;
        interrupted.watch = [&](pid_t child, const std::string& err) {
            if (std::ranges::count(err, '\n') >= 3) kill(child, signal);
        };
        const Outcome stopped = run_program(command(scene, ""), interrupted);
        EXPECT_EQ(stopped.status, 128 + signal);
        EXPECT_EQ(stopped.err.ends_with("field.glb: not converted: interrupted\n"), signal == SIGINT) << stopped.err;
        EXPECT_TRUE(std::filesystem::is_empty(cache));
        EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
    }

    EXPECT_TRUE(converts(scene));
    ASSERT_EQ(std::distance(std::filesystem::directory_iterator(cache), {}), 1);
    const std::filesystem::path pages = std::filesystem::directory_iterator(cache)->path();
    EXPECT_FALSE(converts(scene));

    // A damaged file is made anew, and a list of files is always rendered from pages.
    std::filesystem::resize_file(pages, 1000);
    write_text(list, R"({"parts": [{"uri": "field.glb"}]})");
    const Json facts = Json::parse(done({"info", list, "--json"}).out);
    EXPECT_EQ(facts.at("bytes"), std::filesystem::file_size(file("field.glb")));
    EXPECT_EQ(facts.at("files"), 1);
    EXPECT_GT(facts.at("triangles_with_instances"), 0);
    EXPECT_TRUE(converts(list));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(cache), {}), 1);
    refused(1, {"info", list, "--needs"}, "list.parts.json: ");
    refused(1, command(list, "--animation lift --quiet"), "list.parts.json: ", cached);
    refused(1, command(list, "--pages none --quiet"), "list.parts.json: ", cached);

    large_scene(1, 500, 8, true);
    EXPECT_TRUE(converts(scene, "--animation lift --frame 10"));
    refused(1, command(list, "--quiet"), "lists of files", cached);
}

TEST_F(Pack, TakesGeneratedScenes) {
    const auto triangles_of = [&](const char* kind, const char* form, const std::string& scene) {
        const Outcome made =
            run(words(std::string(HALFLIGHT_SCENES), kind, file("scene.glb"), "--triangles 250000", form));
        EXPECT_EQ(made.status, 0) << made.err;
        const std::uint64_t triangles =
            Json::parse(done({"info", packed(file(scene)), "--json"}).out).at("triangles").get<std::uint64_t>();
        EXPECT_NEAR(static_cast<double>(triangles), 250000, 0.03 * 250000) << kind;
        return triangles;
    };
    for (const char* kind : {"powerplants"}) {
        const std::uint64_t shared = triangles_of(kind, "", "scene.glb");
        EXPECT_EQ(triangles_of(kind, "--parts", "scene.parts.json"), shared) << kind;
        EXPECT_EQ(triangles_of(kind, "--flatten", "scene.glb"), shared) << kind;
        const char* const view = "--camera inside --width 96 --samples 2 --aov depth,normal,ids";
        EXPECT_TRUE(picture(file("scene.glb"), view, "--page-pool 8M --pages", file("a.pages")) ==
                    picture(file("scene.glb"), view))
            << kind;
    }
}

TEST_F(Pack, InterruptedConversionsLeaveNothing) {
    const std::string scene = large_scene();
    const std::string old = "\x89HLP\r\n\x1a\n and more of an older page file";
    write_text(file("a.pages"), old);
    const auto entries = folder.entries();
    // Lines of progress, in the three steps of the conversion.
    for (const auto& [signal, lines] : {std::pair(SIGINT, 1), {SIGTERM, 4}, {SIGINT, 7}, {SIGKILL, 4}, {SIGKILL, 7}}) {
        bool sent = false;
        RunOptions options;
        options.watch = [&, signal = signal, lines = lines](pid_t child, const std::string& err) {
            if (!sent && std::ranges::count(err, '\n') >= lines) sent = kill(child, signal) == 0;
        };
        const Outcome outcome = run_program({"pack", scene, file("a.pages")}, options);
        EXPECT_EQ(outcome.status, 128 + signal) << outcome.err;
        // A kill between naming the complete file and renaming it leaves a name, which the next run removes.
        if (signal == SIGKILL) remove_abandoned(std::vector<std::filesystem::path>{file("a.pages")});
        EXPECT_EQ(folder.entries(), entries) << signal << " after " << lines;
        EXPECT_TRUE(read_text(file("a.pages")) == old);
        if (signal == SIGKILL) continue;
        EXPECT_TRUE(outcome.err.ends_with("a.pages: not written: interrupted\n")) << outcome.err;
    }
}

TEST_F(Pack, StaysWithinItsMemory) {
    [[maybe_unused]] const Outcome outcome = done(words("pack", large_scene(), file("a.pages"), "--memory 640M"));
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LT(outcome.peak_bytes, std::size_t{640} << 20);
#endif
}

}  // namespace
}  // namespace halflight::test
