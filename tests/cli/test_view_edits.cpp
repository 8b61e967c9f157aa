// Tests edits in the viewer by scripts: the edited picture is the one that `render --settings` makes of the saved file.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/core/image_tools.h"
#include "engine/io/exr.h"
#include "tests/cli/virtual_display.h"
#include "tests/support/process.h"

namespace halflight::test {
namespace {

class ViewEdit : public testing::Test {
  protected:
    static void SetUpTestSuite() { display = new VirtualDisplay; }
    static void TearDownTestSuite() {
        delete display;
        display = nullptr;
    }
    void SetUp() override {
        if (display->name().empty()) GTEST_SKIP() << display->why_not();
    }
    std::string file(const std::string& name) const { return folder / name; }
    /// Runs a script in which @ stands for the test's folder.
    Outcome view(std::string script) {
        for (std::size_t at = 0; (at = script.find('@')) != std::string::npos;)
            script.replace(at, 1, folder.path.string() + "/");
        write_text(folder / "script.txt", script);
        RunOptions options;
        options.environment = {fmt::format("DISPLAY={}", display->name()), "LIBGL_ALWAYS_SOFTWARE=1"};
        options.most_seconds = 240;
        return run_program({"view", scene, "--size", "160x120", "--script", file("script.txt"), "--preview", "none"},
                           options);
    }
    Image render(const std::vector<std::string>& more) {
        std::vector<std::string> all{"render", scene, file("render.exr"), "--quiet", "--samples", "2"};
        all.insert(all.end(), more.begin(), more.end());
        const Outcome outcome = run_program(all);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return exr("render.exr");
    }
    Image exr(const std::string& name) const { return read_exr(file(name)).image({"R", "G", "B", "A"}); }

    TemporaryFolder folder;
    std::string scene = copy_room(folder.path);
    static VirtualDisplay* display;
};
VirtualDisplay* ViewEdit::display = nullptr;

TEST_F(ViewEdit, PicturesEqualThoseOfTheSavedFileAndOfOptions) {
    const Outcome outcome = view(R"(
        wait samples 2
        screenshot @plain.exr
        material "floor.base_color=#20c040"
        material floor.roughness=0.25
        node "1=translate:0.5,0.1,0,rotate:0,0,20"
        wait samples 2
        screenshot @edited.exr
        save
    )");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_FALSE(same_bits(exr("edited.exr"), exr("plain.exr")));
    EXPECT_TRUE(same_bits(exr("edited.exr"), render({"--settings", scene + ".halflight.json"})));
    EXPECT_TRUE(same_bits(exr("edited.exr"), render({"--width", "160", "--height", "120", "--material",
                                                     "floor.base_color=#20c040", "--material", "floor.roughness=0.25",
                                                     "--node", "1=translate:0.5,0.1,0,rotate:0,0,20"})));
    const auto saved = nlohmann::json::parse(read_text(scene + ".halflight.json"));
    EXPECT_EQ(saved.at("nodes").at("1").at("rotate"), nlohmann::json({0, 0, 20}));
    EXPECT_EQ(saved.at("materials").at("floor").at("roughness"), 0.25);
}

TEST_F(ViewEdit, HiddenObjectsComeBack) {
    const Outcome outcome = view(R"(
        wait samples 2
        screenshot @plain.exr
        hide mesh:lamp
        wait samples 2
        screenshot @hidden.exr
        show mesh:lamp
        wait samples 2
        screenshot @shown.exr
    )");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(same_bits(exr("shown.exr"), exr("plain.exr")));
    EXPECT_TRUE(same_bits(exr("hidden.exr"),
                          render({"--width", "160", "--height", "120", "--hide", "mesh:lamp", "--env", "none"})));
}

TEST_F(ViewEdit, EditsAreUndoneAndRedone) {
    const Outcome outcome = view(R"(
        wait samples 2
        screenshot @plain.exr
        material floor.roughness=0.25
        environment studio
        wait samples 2
        screenshot @edited.exr
        undo
        undo
        wait samples 2
        screenshot @undone.exr
        redo
        redo
        wait samples 2
        screenshot @redone.exr
        save
    )");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_FALSE(same_bits(exr("edited.exr"), exr("plain.exr")));
    EXPECT_TRUE(same_bits(exr("undone.exr"), exr("plain.exr")));
    EXPECT_TRUE(same_bits(exr("redone.exr"), exr("edited.exr")));
    EXPECT_TRUE(same_bits(exr("redone.exr"), render({"--settings", scene + ".halflight.json"})));
    EXPECT_NE(view("undo\n").err.find("there is no edit"), std::string::npos);
}

TEST_F(ViewEdit, ErrorsNameTheObject) {
    const Outcome unknown = view("material flor.roughness=0.5\n");
    EXPECT_EQ(unknown.status, 1);
    EXPECT_NE(unknown.err.find("script.txt:1: "), std::string::npos) << unknown.err;
    EXPECT_NE(unknown.err.find("there is no material 'flor'; did you mean 'floor'?"), std::string::npos) << unknown.err;
    EXPECT_NE(view("show lamp\n").err.find("is not hidden"), std::string::npos);
}

}  // namespace
}  // namespace halflight::test
