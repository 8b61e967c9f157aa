// Tests `halflight info`, help and version.
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

using Info = Output;

TEST_F(Info, DescribesTheScene) {
    const Outcome text = run_program({"info", scene});
    EXPECT_EQ(text.status, 0) << text.err;
    EXPECT_EQ(text.err, "");
    EXPECT_NE(text.out.find("front"), std::string::npos) << text.out;
    const Outcome json = run_program({"info", "--json", scene});
    ASSERT_EQ(json.status, 0) << json.err;
    const auto facts = nlohmann::json::parse(json.out);
    EXPECT_EQ(facts.at("counts").at("triangles"), 4);
    EXPECT_EQ(facts.at("cameras").at(1).at("name"), "above");
    EXPECT_EQ(facts.at("lights").at("emissive_triangles"), 2);
    EXPECT_EQ(facts.at("repaired").at("normals_generated"), 12);
    EXPECT_NEAR(facts.at("bounds").at("size").at(0), 4, 1e-6);
}

TEST_F(Info, NamesThePassesThatRun) {
    const auto check = [&](const std::string& path) {
        const auto named = nlohmann::json::parse(run_program({"info", "--json", path}).out).at("passes").get<Strings>();
        const Outcome outcome = run_program({"render", path, file("a.exr"), "--env", "0,0,0", "--width", "8",
                                             "--height", "8", "--samples", "1", "--stats", file("stats.json")});
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        std::set<std::string> left_out;
        const auto stats = nlohmann::json::parse(read_text(file("stats.json")));
        for (const auto& part : stats.at("left_out")) left_out.insert(part.at("what").get<std::string>());
        for (const char* pass : {"gbuffer", "shadow", "diffuse", "glossy", "continuation", "path reuse"})
            EXPECT_NE(std::ranges::count(named, pass), left_out.count(pass)) << pass;
    };
    check(scene);
    check(copy_room(folder.path, false));
}

TEST_F(Info, ListsWhatIsLeftOutWithTheBytes) {
    const Outcome json = run_program({"info", "--needs", "--json", scene});
    ASSERT_EQ(json.status, 0) << json.err;
    std::map<std::string, nlohmann::json> parts;
    const auto facts = nlohmann::json::parse(json.out);
    for (const auto& part : facts.at("left_out")) parts[part.at("what")] = part;
    EXPECT_EQ(parts.at("alpha tests").at("fact"), "alpha decides no hit");
    EXPECT_GE(parts.at("sums of squares").at("bytes"), 1280 * 720 * 24);
    EXPECT_FALSE(parts.contains("area lights"));
    const Outcome text = run_program({"info", "--needs", scene});
    EXPECT_TRUE(std::regex_search(text.out, std::regex("alpha tests +0  alpha decides no hit"))) << text.out;
    EXPECT_TRUE(std::regex_search(text.out, std::regex(R"(\n  light tree \* +\d)"))) << text.out;
    // --keep accepts the listed names and no others.
    for (const auto& [name, part] : parts) {
        const Outcome keeping = run_program({"render", file("none.glb"), file("a.exr"), "--keep", name});
        const bool taken = keeping.err.find("cannot keep") == std::string::npos;
        EXPECT_EQ(taken, part.at("can_be_kept").get<bool>()) << name << ": " << keeping.err;
    }
    EXPECT_EQ(run_program({"info", scene}).out.find("alpha decides"), std::string::npos);
    EXPECT_EQ(run_program({"info", "--device", "--needs"}).status, 2);
    EXPECT_TRUE(parts.contains("environment"));
    const Outcome lit = run_program({"info", "--needs", "--json", scene, "--env", "0.5,0.5,0.5"});
    ASSERT_EQ(lit.status, 0) << lit.err;
    const auto of_lit = nlohmann::json::parse(lit.out);
    EXPECT_FALSE(of_lit.at("left_out").empty());
    for (const auto& part : of_lit.at("left_out")) EXPECT_NE(part.at("what"), "environment");
}

TEST_F(Info, EstimatesTheMemoryOfThePicture) {
    const auto memory = [&](const Strings& options) {
        Strings arguments{"info", "--json", scene};
        arguments.insert(arguments.end(), options.begin(), options.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return nlohmann::json::parse(outcome.out).at("memory");
    };
    const auto bytes = [&](const Strings& options) { return memory(options).at("render_bytes").get<std::size_t>(); };
    const auto usual = memory({});
    std::size_t sum = 0;
    for (const auto& [part, of_part] : usual.at("render_parts").items()) sum += of_part.get<std::size_t>();
    EXPECT_EQ(usual.at("render_bytes"), sum);
    EXPECT_EQ(usual.at("render_size").at(0), 1280);
    const Strings large{"--width", "1920", "--height", "1440"};
    EXPECT_EQ(memory(large).at("render_size"), nlohmann::json({1920, 1440}));
    const auto with = [&](const Strings& more) {
        Strings all = large;
        all.insert(all.end(), more.begin(), more.end());
        return bytes(all);
    };
    const std::size_t plain = bytes(large);
    EXPECT_GT(plain, usual.at("render_bytes").get<std::size_t>());
    const Strings options[] = {
        {"--aov", "depth"},      {"--png"},        {"--shutter", "0.5"},       {"--error", "0.1"},
        {"--preview", "filter"}, {"--aov", "all"}, {"--estimator", "shadow=2"}};
    for (const Strings& more : options) EXPECT_GT(with(more), plain) << more[0];
    EXPECT_LT(with({"--bounces", "1"}), plain);
    EXPECT_GT(with({"--aov", "all", "--shutter", "0.5"}), with({"--aov", "all"}) * 3 / 2);
    write_text(file("s.json"), R"({"halflight_settings": 1, "size": [1920, 1440]})");
    EXPECT_EQ(bytes({"--settings", file("s.json")}), plain);

    // The estimate is sufficient for the picture.
    const Strings small{"--width", "320", "--height", "180", "--aov", "all"};
    Strings render{"render", scene, file("a.exr"), "--samples", "2", "--stats", file("stats.json")};
    render.insert(render.end(), small.begin(), small.end());
    const Outcome rendered = run_program(render);
    ASSERT_EQ(rendered.status, 0) << rendered.err;
    const auto stats = nlohmann::json::parse(read_text(file("stats.json")));
#ifndef HALFLIGHT_SANITIZED
    EXPECT_GE(bytes(small), stats.at("peak_memory_bytes").get<std::size_t>());
#endif
}

/// A smaller budget gives smaller bands, less memory and the same picture.
TEST_F(Info, PicturesFitIntoTheBudget) {
    constexpr std::size_t kBudget = std::size_t{280} << 20;
    const auto stats_of = [&](const std::string& picture, const Strings& more) {
        Strings render{"render",    scene,       file(picture), "--width",         "480",           "--height",
                       "360",       "--samples", "1",           "--aov",           "all",           "--quiet",
                       "--bounces", "2",         "--stats",     file("fits.json"), "--reproducible"};
        render.insert(render.end(), more.begin(), more.end());
        const Outcome rendered = run_program(render);
        EXPECT_EQ(rendered.status, 0) << rendered.err;
        return nlohmann::json::parse(read_text(file("fits.json")));
    };
    const auto usual = stats_of("usual.exr", {}), fitted = stats_of("fitted.exr", {"--memory", "280MiB"});
    EXPECT_EQ(read_text(file("usual.exr")), read_text(file("fitted.exr")));
    const auto bands = [](const nlohmann::json& stats) {
        return stats.at("memory").at("part_bytes").at("bands").get<std::size_t>();
    };
    EXPECT_LT(bands(fitted), bands(usual));
    EXPECT_EQ(fitted.at("memory").at("limit_bytes"), kBudget);
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LE(fitted.at("peak_memory_bytes").get<std::size_t>(), kBudget);
#endif
    const Outcome refused = run_program(
        {"render", scene, file("b.exr"), "--width", "4000", "--height", "4000", "--aov", "all", "--memory", "280MiB"});
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find(scene + ": needs "), std::string::npos) << refused.err;
    EXPECT_EQ(std::ranges::count(refused.err, '\n'), 1) << refused.err;
}

TEST_F(Info, ListsDevices) {
    const Outcome text = run_program({"info", "--device"});
    EXPECT_EQ(text.status, 0) << text.err;
    EXPECT_EQ(std::count(text.out.begin(), text.out.end(), '*'), 1) << text.out;
    const auto devices = nlohmann::json::parse(run_program({"info", "--device", "--json"}).out).at("devices");
    EXPECT_FALSE(devices.empty());
    for (const auto& device : devices) EXPECT_FALSE(device.at("reason").get<std::string>().empty()) << device;
}

TEST_F(Info, FailsWhereNoDeviceWorks) {
    const auto all = nlohmann::json::parse(run_program({"info", "--device", "--json"}).out);
    for (const auto& device : all.at("devices")) {
        const auto name = device.at("name").get<std::string>();
        if (name.starts_with("EGL device") && name.find(", software") == std::string::npos)
            GTEST_SKIP() << "Mesa alone reads MESA_GL_VERSION_OVERRIDE";
    }
    const RunOptions old{.environment = {"MESA_GL_VERSION_OVERRIDE=3.3"}};
    const Outcome text = run_program({"info", "--device"}, old);
    EXPECT_EQ(text.status, 1);
    EXPECT_EQ(text.err, "halflight: GPU: no device works\n");
    EXPECT_NE(text.out.find("software: no OpenGL 4.5 core context"), std::string::npos) << text.out;
    const Outcome none = run_program({"info", "--device"}, {.environment = {"__EGL_VENDOR_LIBRARY_FILENAMES=/none"}});
    EXPECT_EQ(none.status, 1);
    EXPECT_EQ(none.err, "halflight: GPU: no device works; EGL lists none\n");
    const Outcome json = run_program({"info", "--device", "--json", scene}, old);
    EXPECT_EQ(json.status, 1);
    const auto facts = nlohmann::json::parse(json.out);
    EXPECT_GT(facts.at("devices").size(), 0u);
    EXPECT_GT(facts.at("counts").at("triangles"), 0);
}

TEST_F(Info, HelpAndVersion) {
    for (const Strings& arguments : {Strings{"--help"}, Strings{"render", "--help"}, Strings{"info", "-h"}}) {
        const Outcome help = run_program(arguments);
        EXPECT_EQ(help.status, 0);
        EXPECT_EQ(help.err, "");
        EXPECT_NE(help.out.find("Usage: halflight"), std::string::npos);
    }
    EXPECT_TRUE(std::regex_match(run_program({"--version"}).out, std::regex(R"(halflight \d+\.\d+\.\d+\n)")));
}

}  // namespace
}  // namespace halflight::test
