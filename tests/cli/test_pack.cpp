// Tests `halflight pack` as a user runs it, and `halflight info` of its files.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/support/process.h"
#include "tests/unit/io/gltf_builder.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {
namespace {

using Strings = std::vector<std::string>;

class Pack : public testing::Test {
  protected:
    std::string file(const std::string& name) const { return folder / name; }
    Outcome pack(const std::string& from, const std::string& to, Strings more = {},
                 const RunOptions& options = {}) const {
        Strings arguments = {"pack", from, to};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments, options);
    }
    /// Writes a field of 10 000 triangles for each instance, and returns its name. 200 of them take some seconds.
    std::string large_scene(int instances = 200) const {
        constexpr int kSide = 71;
        GltfBuilder b;
        std::vector<float> positions, places;
        std::vector<std::uint32_t> indices;
        for (int y = 0; y <= kSide; ++y)
            for (int x = 0; x <= kSide; ++x)
                positions.insert(positions.end(), {float(x), float((x * y) % 7), float(y)});
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) {
                const auto i = static_cast<std::uint32_t>(y * (kSide + 1) + x);
                indices.insert(indices.end(), {i, i + 1, i + kSide + 1, i + 1, i + kSide + 2, i + kSide + 1});
            }
        for (int i = 0; i < instances; ++i)
            places.insert(places.end(), {float(kSide * (i % 14)), 0, float(kSide * (i / 14))});
        Json& primitive = b.add_mesh({{"POSITION", b.floats("VEC3", positions)}});
        primitive["indices"] = b.accessor("SCALAR", kU32, indices);
        const Json attributes = {{"TRANSLATION", b.floats("VEC3", places)}};
        b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = attributes;
        b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
        write_text(file("field.glb"), b.glb());
        return file("field.glb");
    }
    TemporaryFolder folder;
    const std::string atrium = HALFLIGHT_SOURCE_DIR "/scenes/atrium.glb";
};

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
    expect(pack(atrium, file("no/a")), 1, "no/a: cannot write: No such file");
    expect(pack(atrium, file("a"), {"--memory", "300M"}), 1, "conversion at least 256 MiB), and");
    expect(pack(atrium, file("a"), {"--quiet"}, {.wrapper = {"prlimit", "--fsize=100000"}}), 1, "File too large");
    EXPECT_EQ(folder.entries(), Strings{"x.glb"});

    EXPECT_EQ(pack(atrium, file("a"), {"--quiet"}).status, 0);
    std::string bytes = read_text(file("a"));
    bytes[bytes.size() - 100] = static_cast<char>(bytes[bytes.size() - 100] ^ 4);
    write_text(file("bad"), bytes);
    expect(run_program({"info", file("bad")}), 1, "bad: its index is damaged");
    expect(run_program({"info", file("a"), "--needs"}), 1, "a: is a page file: --needs describes glTF scenes");
}

TEST_F(Pack, PicturesEqualThoseOfTheSceneInMemory) {
    const std::string scene = large_scene(6);
    ASSERT_EQ(pack(scene, file("a.pages"), {"--quiet"}).status, 0);
    const auto render = [&](const std::string& output, const Strings& more) {
        Strings arguments = {"render",
                             scene,
                             file(output),
                             "--width",
                             "64",
                             "--samples",
                             "2",
                             "--aov",
                             "direct_diffuse,indirect_diffuse,indirect_glossy,albedo,normal,depth,ids,cryptoobject",
                             "--env",
                             "1,0.9,0.8",
                             "--primary",
                             "traced",
                             "--reproducible",
                             "--look-from",
                             "40,60,-50",
                             "--look-at",
                             "200,0,90",
                             "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments);
    };
    ASSERT_EQ(render("core.exr", {}).status, 0);
    const std::string core = read_text(file("core.exr"));
    for (const char* pool : {"1M", "4M", "64M"}) {
        const Outcome paged = render("paged.exr", {"--pages", file("a.pages"), "--page-pool", pool});
        ASSERT_EQ(paged.status, 0) << paged.err;
        EXPECT_TRUE(read_text(file("paged.exr")) == core) << pool;
    }

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
    const Outcome alpha = run_program({"render", atrium, file("no.exr"), "--pages", file("atrium.pages"), "--quiet"});
    EXPECT_NE(alpha.err.find("alpha tests, which pages do not support"), std::string::npos) << alpha.err;
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
        Strings arguments = {"render", file("scene.glb"), file(output), "--camera", "inside",           "--width",
                             "96",     "--samples",       "2",          "--aov",    "depth,normal,ids", "--primary",
                             "traced", "--reproducible",  "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_text(file(output));
    };
    for (const char* kind : {"airliner", "powerplants"}) {
        const std::uint64_t shared = pages_of(kind, {}, "scene.glb");
        EXPECT_EQ(pages_of(kind, {"--parts"}, "scene.parts.json"), shared) << kind;
        EXPECT_EQ(pages_of(kind, {"--flatten"}, "scene.glb"), shared) << kind;
        const std::string core = render("core.exr", {});
        const std::string paged = render("paged.exr", {"--pages", file("scene.pages"), "--page-pool", "8M"});
        // Emissive triangles in pages are no lights yet, so pictures of the airliner's cabin differ in their noise.
        EXPECT_TRUE(paged == core || std::string_view(kind) == "airliner") << kind;
    }
}

TEST_F(Pack, InterruptedConversionsLeaveNothing) {
    const std::string scene = large_scene();
    write_text(file("a.pages"), "old");
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
            EXPECT_EQ(folder.entries(), entries) << signal << " after " << lines;
            EXPECT_TRUE(read_text(file("a.pages")) == "old");
            if (signal == SIGKILL) continue;
            EXPECT_TRUE(outcome.err.ends_with("a.pages: not written: interrupted\n")) << outcome.err;
        }
    }
}

TEST_F(Pack, StaysWithinItsMemory) {
    const Outcome outcome = pack(large_scene(), file("a.pages"), {"--memory", "640M"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
#ifndef __SANITIZE_ADDRESS__
    EXPECT_LT(outcome.peak_bytes, std::size_t{640} << 20);
#endif
}

}  // namespace
}  // namespace halflight::test
