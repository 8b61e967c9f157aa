// Tests edits by name on the command line and in settings files, names of `info`, and pictures of all cameras.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "engine/core/image_tools.h"
#include "engine/io/exr.h"
#include "tests/support/process.h"

namespace halflight::test {
namespace {

class Edits : public testing::Test {
  protected:
    using Strings = std::vector<std::string>;
    std::string file(const std::string& name) const { return folder / name; }
    Outcome run(const std::string& output, const Strings& more) {
        Strings all{"render", scene, file(output), "--width", "24", "--height", "18", "--samples", "2", "--quiet"};
        all.insert(all.end(), more.begin(), more.end());
        return run_program(all);
    }
    Image render(const Strings& more) {
        const Outcome outcome = run("a.exr", more);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_exr(file("a.exr")).image({"R", "G", "B", "A"});
    }
    std::string settings(const std::string& more) {
        write_text(folder / "s.json", "{\"halflight_settings\": 1, " + more + "}");
        return file("s.json");
    }

    TemporaryFolder folder;
    std::string scene = copy_room(folder.path);
};

TEST_F(Edits, OptionsAndFilesMakeTheSamePictures) {
    const Image plain = render({});
    const std::pair<Strings, std::string> cases[] = {
        {{"--material", "floor.base_color=#20c040", "--material", "floor.roughness=0.25"},
         R"("materials": {"floor": {"base_color": "#20c040", "roughness": 0.25}})"},
        {{"--node", "1=translate:0.5,0,0,rotate:0,0,20"},
         R"("nodes": {"1": {"translate": [0.5, 0, 0], "rotate": [0, 0, 20]}})"},
        {{"--hide", "mesh:lamp", "--env", "white"}, R"("hide": ["mesh:lamp"], "environment": {"color": [1, 1, 1]})"},
        {{"--shadow-catcher", "*", "--env", "white"},
         R"("shadow_catchers": ["*"], "environment": {"color": [1, 1, 1]})"},
        {{"--light", "*=temperature:2700,factor:2", "--sky", "40,20"},
         R"("lights": {"*": {"temperature": 2700, "factor": 2}}, "environment": {"sky": {"elevation": 40, "azimuth": 20}})"}};
    for (const auto& [options, json] : cases) {
        const Image by_options = render(options);
        EXPECT_FALSE(same_bits(by_options, plain)) << options[1];
        EXPECT_TRUE(same_bits(by_options, render({"--settings", settings(json)}))) << options[1];
    }
    // Options come after the file, key by key.
    const std::string red = settings(R"("materials": {"floor": {"base_color": "#f00", "roughness": 0.25}})");
    EXPECT_TRUE(
        same_bits(render({"--settings", red, "--material", "floor.base_color=#20c040"}), render(cases[0].first)));
    // Earlier files have indices.
    const std::string old = settings(R"("materials": {"0": {"base_color": [1, 0, 0, 1], "roughness": 0.25}})");
    EXPECT_TRUE(same_bits(render({"--settings", old}), render({"--settings", red})));
}

TEST_F(Edits, UnusableEditsAreOneLine) {
    const auto refused = [&](const Strings& options) {
        const Outcome outcome = run("a.exr", options);
        EXPECT_NE(outcome.status, 0);
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
        return std::pair(outcome.status, outcome.err);
    };
    using Refusal = std::pair<int, std::string>;
    EXPECT_EQ(refused({"--material", "flor.roughness=0.2"}),
              Refusal(1, "halflight: --material: " + scene + ": there is no material 'flor'; did you mean 'floor'?\n"));
    EXPECT_EQ(refused({"--material", "floor.rough=0.2"}),
              Refusal(2, "halflight: --material: floor: materials have no property 'rough'\n"));
    EXPECT_EQ(refused({"--light", "sun"}),
              Refusal(2, "halflight: --light: expects NAME=KEY:VALUE,... or NAME=off, not 'sun'\n"));
    EXPECT_EQ(refused({"--light", "sun=off"}),
              Refusal(1, "halflight: --light: " + scene + ": there is no light 'sun'; the scene has none\n"));
    EXPECT_EQ(refused({"--hide", "nobody"}).first, 1);
    EXPECT_EQ(refused({"--settings", settings(R"("nodes": {"crate": {"scale": 2}})")}).second,
              "halflight: " + file("s.json") + ": nodes: " + scene +
                  ": there is no node 'crate'; `halflight info SCENE --names` lists the names\n");
}

TEST_F(Edits, NamesCanBePastedBack) {
    const Outcome names = run_program({"info", scene, "--names"});
    ASSERT_EQ(names.status, 0) << names.err;
    Strings options;
    std::istringstream lines(names.out);
    for (std::string line; std::getline(lines, line);) {
        const auto space = line.find(' ');
        const std::string option = line.substr(0, space), value = line.substr(space + 1);
        if (option == "--camera" || option == "--variant" || option == "--hide") continue;
        options.push_back(option);
        options.push_back(value.starts_with('\'') ? value.substr(1, value.size() - 2) : value);
    }
    EXPECT_NE(std::ranges::find(options, "floor.base_color=0.7,0.5,0.3,1"), options.end()) << names.out;
    EXPECT_NE(names.out.find("--camera above\n"), std::string::npos) << names.out;
    EXPECT_NE(names.out.find("--hide mesh:lamp\n"), std::string::npos) << names.out;
    EXPECT_TRUE(same_bits(render(options), render({})));
    const Outcome edited = run_program({"info", scene, "--names", "--material", "floor.metallic=0.5"});
    EXPECT_NE(edited.out.find("floor.metallic=0.5"), std::string::npos) << edited.out;
}

TEST_F(Edits, FingerprintsIncludeThem) {
    const auto sequence = [&](const Strings& more) {
        Strings all{"--frames", "1-2", "--bounces", "0"};
        all.insert(all.end(), more.begin(), more.end());
        return run("f.#.exr", all).status;
    };
    ASSERT_EQ(sequence({}), 0);
    EXPECT_EQ(sequence({}), 0) << "the frames are kept";
    for (const Strings& edit :
         {Strings{"--hide", "mesh:lamp"}, Strings{"--node", "1=scale:2"}, Strings{"--material", "floor.roughness=0.2"}})
        EXPECT_EQ(sequence(edit), 1) << edit[1] << ": those are other frames";
}

TEST_F(Edits, HoldInAllFramesWithMotionBlur) {
    ASSERT_EQ(run("m.#.exr", {"--frames", "1-2", "--shutter", "0.5", "--shutter-times", "2", "--hide", "mesh:lamp",
                              "--env", "white", "--aov", "motion"})
                  .status,
              0);
}

TEST_F(Edits, AllCamerasMakeAPictureEach) {
    ASSERT_EQ(run("shot.exr", {"--camera", "all"}).status, 0);
    for (const char* camera : {"front", "above"}) {
        const Image one = read_exr(file(fmt::format("shot.{}.exr", camera))).image({"R", "G", "B", "A"});
        EXPECT_TRUE(same_bits(one, render({"--camera", camera}))) << camera;
    }
    std::string text = read_text(scene);  // cameras whose names are numbers of each other
    for (const auto& [from, to] : {std::pair("\"front\"", "\"1\""), std::pair("\"above\"", "\"0\"")})
        for (std::size_t at = 0; (at = text.find(from)) != std::string::npos;) text.replace(at, 7, to);
    const std::string digits = file("digits.gltf"), named = std::exchange(scene, digits);
    write_text(digits, text);
    ASSERT_EQ(run("digit.exr", {"--camera", "all"}).status, 0);
    for (const auto& [digit, name] : {std::pair("1", "front"), std::pair("0", "above")})
        EXPECT_TRUE(same_bits(read_exr(file(fmt::format("digit.{}.exr", digit))).image({"R", "G", "B", "A"}),
                              read_exr(file(fmt::format("shot.{}.exr", name))).image({"R", "G", "B", "A"})))
            << name;
    scene = named;
    ASSERT_EQ(run("{camera}/shot.#.exr", {"--camera", "all", "--frames", "1-2"}).status, 0);
    EXPECT_TRUE(std::filesystem::exists(file("front/shot.2.exr")));
    EXPECT_TRUE(std::filesystem::exists(file("above/shot.1.exr")));
    EXPECT_FALSE(std::filesystem::exists(file("{camera}")));

    // One camera fails, and the other one does not.
    std::filesystem::create_directory(file("g.front.exr"));
    const Outcome failed = run("g.exr", {"--camera", "all"});
    EXPECT_EQ(failed.status, 1);
    EXPECT_NE(failed.err.find("g.front.exr: "), std::string::npos) << failed.err;
    EXPECT_NE(failed.err.find("--camera all: 1 of 2 cameras failed"), std::string::npos) << failed.err;
    EXPECT_TRUE(std::filesystem::exists(file("g.above.exr")));
}

TEST_F(Edits, NamesHoldThatOfTheCamera) {
    ASSERT_EQ(run("{camera}.exr", {}).status, 0);
    ASSERT_EQ(run("{camera}.exr", {"--camera", "above"}).status, 0);
    ASSERT_EQ(run("{camera}.#.exr", {"--camera", "1", "--frames", "1"}).status, 0);
    for (const char* name : {"front.exr", "above.exr", "above.1.exr"})
        EXPECT_TRUE(std::filesystem::exists(file(name))) << name;
    EXPECT_FALSE(std::filesystem::exists(file("{camera}.exr")));
    const Outcome free = run("{camera}.exr", {"--look-from", "1,1,1", "--look-at", "0,0,0"});
    EXPECT_EQ(free.status, 1);
    EXPECT_NE(free.err.find("{camera} stands for a camera of the scene"), std::string::npos) << free.err;
}

TEST_F(Edits, TheSunOfTheSkyLeavesNamesToTheScene) {
    auto json = nlohmann::json::parse(read_text(scene));
    json["extensionsUsed"].push_back("KHR_lights_punctual");
    json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"name", "sun"}, {"type", "directional"}}};
    json["scenes"][0]["nodes"].push_back(json["nodes"].size());
    json["nodes"].push_back({{"name", "sun"}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    write_text(scene, json.dump());
    EXPECT_EQ(run("a.exr", {"--sky", "40,120", "--light", "sun=0.5", "--light", "sky sun=0.5"}).status, 0);
}

}  // namespace
}  // namespace halflight::test
