// Tests edits in the viewer by scripts: the edited picture is the one that `render --settings` makes of the saved file.
#include <nlohmann/json.hpp>

#include "tests/cli/view_test.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {
namespace {

class ViewEdit : public ViewTest {
  protected:
    ViewEdit() { size = "160x120"; }
    Image render(const std::vector<std::string>& more) {
        std::vector<std::string> all{"render", scene, file("render.exr"), "--quiet", "--samples", "2"};
        all.insert(all.end(), more.begin(), more.end());
        const Outcome outcome = run_program(all);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return exr("render.exr");
    }
};

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

/// Light in pages, and light that an animation brings later, is light of the scene, which needs no sky.
TEST_F(ViewEdit, ScenesLitElsewhereGetNoSkyByUndo) {
    GltfBuilder b;
    b.add_mesh({{"POSITION", b.floats("VEC3", {-2, 0, -2, 0, 0, 2, 2, 0, -2})}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 0}}};
    b.push("nodes", {{"translation", {0, 1, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_animation_pointer"};
    const Json pointer = {{"pointer", "/extensions/KHR_lights_punctual/lights/0/intensity"}};
    const Json target = {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", pointer}}}};
    const Json sampler = {{"input", b.floats("SCALAR", {0, 1})}, {"output", b.floats("SCALAR", {0, 30})}};
    b.push("animations", {{"channels", {{{"sampler", 0}, {"target", target}}}}, {"samplers", {sampler}}});
    write_text(file("dawn.glb"), b.glb());
    const std::string cornell = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";
    ASSERT_EQ(run_program({"pack", cornell, file("a.pages"), "--quiet"}).status, 0);
    const std::pair<std::string, std::vector<std::string>> lit[] = {
        {cornell, {"--pages", file("a.pages")}},
        {file("dawn.glb"), {"--animation", "all", "--frame", "12"}},
    };
    for (const auto& [name, more] : lit) {
        scene = name;
        const Outcome outcome = view(R"(
            wait samples 2
            screenshot @plain.exr
            environment studio
            wait samples 2
            screenshot @studio.exr
            undo
            wait samples 2
            screenshot @undone.exr
        )",
                                     more);
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(outcome.err.find("neutral sky"), std::string::npos) << outcome.err;
        EXPECT_TRUE(same_bits(exr("undone.exr"), exr("plain.exr"))) << name;
        EXPECT_FALSE(same_bits(exr("studio.exr"), exr("plain.exr"))) << name;
    }
}

TEST_F(ViewEdit, KeysUndoAndRedo) {
    const Outcome outcome = view(R"(
        material floor.roughness=0.25
        environment studio
        key Ctrl+Z
        key Ctrl+Z
        key Ctrl+Z
        save
        wait samples 2
        screenshot @undone.exr
        key Ctrl+Shift+Z
        key Ctrl+Y
        wait samples 2
        screenshot @redone.exr
        save
    )");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(same_bits(exr("redone.exr"), render({"--settings", scene + ".halflight.json"})));
    EXPECT_FALSE(same_bits(exr("redone.exr"), exr("undone.exr")));
    EXPECT_TRUE(same_bits(exr("undone.exr"), render({"--width", "160", "--height", "120"})));
}

TEST_F(ViewEdit, RevertRemovesAllEditsAsOneEdit) {
    const Outcome outcome = view(R"(
        material floor.roughness=0.25
        environment studio
        wait samples 2
        screenshot @edited.exr
        key Ctrl+Shift+R
        wait samples 2
        screenshot @reverted.exr
        key Ctrl+Z
        wait samples 2
        screenshot @back.exr
    )");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(same_bits(exr("reverted.exr"), render({"--width", "160", "--height", "120"})));
    EXPECT_FALSE(same_bits(exr("edited.exr"), exr("reverted.exr")));
    EXPECT_TRUE(same_bits(exr("back.exr"), exr("edited.exr")));
}

/// Handles and the choice of objects give the edits that options have.
TEST_F(ViewEdit, HandlesMoveTheSelectedNode) {
    const Outcome outcome = view(R"(
        key H
        select node:1
        handles move
        drag 80 60 100 50
        handles none
        select material:floor
        section Light
        section Scene
        search lamp
        window @window.png
        key H
        wait samples 2
        screenshot @moved.exr
        save
    )");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(same_bits(exr("moved.exr"), render({"--settings", scene + ".halflight.json"})));
    EXPECT_FALSE(same_bits(exr("moved.exr"), render({"--width", "160", "--height", "120"})));
    const auto nodes = nlohmann::json::parse(read_text(scene + ".halflight.json")).at("nodes");
    EXPECT_EQ(nodes.at("1").size(), 1u) << nodes;
    EXPECT_TRUE(nodes.at("1").contains("translate")) << nodes;
    EXPECT_NE(view("select node:1\ndrag 1 1 9 9\n").err.find("there is no handle at this pixel"), std::string::npos);
}

/// The viewer asks before it ends with edits that are not saved. Enter saves them.
TEST_F(ViewEdit, UnsavedEditsAreAskedAbout) {
    if (run({"sh", "-c", "command -v xdotool"}).status != 0) GTEST_SKIP() << "Debian's package xdotool is missing";
    const std::string settings = scene + ".halflight.json";
    // The title names the camera once the scene is loaded. Keys have no effect before.
    write_text(folder / "keys.sh", fmt::format(R"(xdotool search --sync --onlyvisible --name '[(]front[)]$' >{0}
        xdotool mousemove 20 60
        xdotool key bracketright
        xdotool search --sync --name 'not saved$' >{0}
        xdotool key ctrl+q
        touch {1}
        while [ ! -f '{2}' ]; do xdotool key Return; sleep 0.1; done
    )",
                                               file("window"), file("asked"), settings));
    // xdotool waits without end for a title that does not come.
    Process input({"timeout", "90", "sh", file("keys.sh")},
                  ProcessOptions{.environment = {fmt::format("DISPLAY={}", display->name())}});
    RunOptions options;
    options.environment = {fmt::format("DISPLAY={}", display->name()), "LIBGL_ALWAYS_SOFTWARE=1"};
    options.most_seconds = 60;
    const Outcome outcome = run_program({"view", scene, "--size", "64x48", "--exposure", "0"}, options);
    input.wait();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(file("asked"))) << "the viewer ended before it was asked to";
    EXPECT_EQ(nlohmann::json::parse(read_text(settings)).at("exposure"), 0.25);
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
