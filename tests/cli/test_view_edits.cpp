// Tests edits in the viewer by scripts: the edited picture is the one that `render --settings` makes of the saved file.
#include "tests/cli/animated_scenes.h"
#include "tests/cli/view_test.h"

namespace halflight::test {
namespace {

class ViewEdit : public ViewTest {
  protected:
    ViewEdit() { size = {160, 120}; }
};

TEST_F(ViewEdit, PicturesEqualThoseOfTheSavedFileAndOfOptions) {
    show(R"(
        wait samples 2
        screenshot @plain.exr
        material "floor.base_color=#20c040"
        material floor.roughness=0.25
        node "1=translate:0.5,0.1,0,rotate:0,0,20"
        wait samples 2
        screenshot @edited.exr
        save
        undo
        undo
        undo
        hide mesh:lamp
        wait samples 2
        screenshot @hidden.exr
        show mesh:lamp
        wait samples 2
        screenshot @shown.exr
    )",
         {"--quiet"});
    const Image edited = exr("edited.exr"), plain = exr("plain.exr");
    EXPECT_FALSE(same_bits(edited, plain));
    EXPECT_TRUE(same_bits(edited, render("render.exr", "--settings", settings())));
    EXPECT_TRUE(
        same_bits(edited, render("render.exr", "--material floor.base_color=#20c040",
                                 "--material floor.roughness=0.25 --node 1=translate:0.5,0.1,0,rotate:0,0,20")));
    const auto saved = json_file(settings());
    EXPECT_EQ(saved.at("nodes").at("1").at("rotate"), nlohmann::json({0, 0, 20}));
    EXPECT_EQ(saved.at("materials").at("floor").at("roughness"), 0.25);
    EXPECT_TRUE(same_bits(exr("hidden.exr"), render("render.exr", "--hide mesh:lamp --env none")));
    EXPECT_TRUE(same_bits(exr("shown.exr"), plain));
}

TEST_F(ViewEdit, AddedLampsAreThoseOfTheSavedFile) {
    show(R"(
        wait samples 2
        screenshot @plain.exr
        lamp spot
        lamp rectangle
        add-light "day=kind:sun,intensity:0.5,direction:1,-2,-1"
        light rectangle=factor:0.5
        wait samples 2
        screenshot @added.exr
        save
        key Ctrl+D
        wait samples 2
        screenshot @twice.exr
        key Delete
        wait samples 2
        screenshot @deleted.exr
        select light:day
        key Delete
        state @state.json
        undo
        wait samples 2
        screenshot @undone.exr
    )",
         {"--quiet"});
    const Image added = exr("added.exr");
    EXPECT_FALSE(same_bits(added, exr("plain.exr")));
    EXPECT_TRUE(same_bits(added, render("render.exr", "--settings", settings())));
    EXPECT_FALSE(same_bits(added, exr("twice.exr")));
    EXPECT_TRUE(same_bits(added, exr("deleted.exr")));
    EXPECT_TRUE(same_bits(added, exr("undone.exr")));
    EXPECT_EQ(json("state.json")["selection"], "nothing");
    const auto saved = json_file(settings()).at("added_lights");
    EXPECT_EQ(saved.at("spot").at("kind"), "spot");
    EXPECT_EQ(saved.at("rectangle").at("factor"), 0.5);
    expect_error("add-light day=kind:lamp\n", 1, "kind: 'lamp'");
}

/// "Always" shows, saves and hands on what --denoise makes of the same samples.
TEST_F(ViewEdit, DenoisedPicturesEqualThoseOfRender) {
    show(R"(
        wait samples 8
        screenshot @noisy.exr
        denoise always
        wait samples 8
        screenshot @denoised.exr
        save
        undo
        wait samples 8
        screenshot @undone.exr
    )",
         {"--quiet"});
    const Image denoised = exr("denoised.exr");
    EXPECT_TRUE(same_bits(denoised, render("render.exr", "--samples 8 --denoise")));
    EXPECT_TRUE(same_bits(denoised, render("render.exr", "--samples 8 --settings", settings())));
    EXPECT_FALSE(same_bits(denoised, exr("noisy.exr")));
    EXPECT_TRUE(same_bits(exr("undone.exr"), exr("noisy.exr")));
    expect_has(bias_of(file("denoised.exr")), "denoised");
    EXPECT_EQ(bias_of(file("undone.exr")), "");
    expect_error("denoise never\n", 1, "denoise: ");
}

/// Commands and keys undo and redo; reverting removes all edits as one edit.
TEST_F(ViewEdit, EditsAreUndoneAndRedone) {
    show(R"(
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
        key Ctrl+Z
        key Ctrl+Z
        key Ctrl+Z
        wait samples 2
        screenshot @undone-by-keys.exr
        key Ctrl+Shift+Z
        key Ctrl+Y
        wait samples 2
        screenshot @redone-by-keys.exr
        key Ctrl+Shift+R
        wait samples 2
        screenshot @reverted.exr
        key Ctrl+Z
        wait samples 2
        screenshot @back.exr
    )",
         {"--quiet"});
    const Image edited = exr("edited.exr"), plain = exr("plain.exr");
    EXPECT_FALSE(same_bits(edited, plain));
    EXPECT_TRUE(same_bits(edited, render("render.exr", "--settings", settings())));
    for (const char* name : {"redone.exr", "redone-by-keys.exr", "back.exr"})
        EXPECT_TRUE(same_bits(exr(name), edited)) << name;
    for (const char* name : {"undone.exr", "undone-by-keys.exr", "reverted.exr"})
        EXPECT_TRUE(same_bits(exr(name), plain)) << name;
    expect_error("undo\n", 1, "there is no edit");
}

/// Light in pages, and light that an animation brings later, is light of the scene, which needs no sky.
TEST_F(ViewEdit, ScenesLitElsewhereGetNoSkyByUndo) {
    GltfBuilder b;
    b.add_mesh({{"POSITION", b.floats("VEC3", {-2, 0, -2, 0, 0, 2, 2, 0, -2})}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 0}}};
    b.push("nodes", {{"translation", {0, 1, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.json["extensionsUsed"] = {"KHR_lights_punctual"};
    animate_pointer(b, "/extensions/KHR_lights_punctual/lights/0/intensity", "SCALAR", {0, 30});
    write_text(file("dawn.glb"), b.glb());
    const std::string cornell = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";
    done(words("pack", cornell, file("a.pages"), "--quiet"));
    const std::pair<std::string, Strings> lit[] = {{cornell, {"--pages", file("a.pages")}},
                                                   {file("dawn.glb"), words("--animation all --frame 12")}};
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
        EXPECT_FALSE(has(outcome.err, "neutral sky")) << outcome.err;
        EXPECT_TRUE(same_bits(exr("undone.exr"), exr("plain.exr"))) << name;
        EXPECT_FALSE(same_bits(exr("studio.exr"), exr("plain.exr"))) << name;
    }
}

/// Handles and the choice of objects give the edits that options have.
TEST_F(ViewEdit, HandlesMoveTheSelectedNode) {
    show(R"(
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
    )",
         {"--quiet"});
    EXPECT_TRUE(same_bits(exr("moved.exr"), render("render.exr", "--settings", settings())));
    EXPECT_FALSE(same_bits(exr("moved.exr"), render("render.exr")));
    const auto nodes = json_file(settings()).at("nodes");
    EXPECT_EQ(nodes.at("1").size(), 1u) << nodes;
    EXPECT_TRUE(nodes.at("1").contains("translate")) << nodes;
    expect_error("select node:1\ndrag 1 1 9 9\n", 2, "handle");
}

/// The square beside a lamp gives it a radius, which the saved file and the option have, too.
TEST_F(ViewEdit, HandlesPullOutTheSizeOfALamp) {
    hang_lamp();
    show(R"(
        key H
        select light:bulb
        drag 225 138 245 158
        lamps on
        window @window.png
        key H
        wait samples 2
        screenshot @sized.exr
        save
        undo
        undo
        wait samples 2
        screenshot @undone.exr
    )",
         {"--quiet"});
    const double radius = json_file(settings()).at("lights").at("bulb").at("radius");
    EXPECT_GT(radius, 0.2);
    EXPECT_LT(radius, 0.8);
    EXPECT_TRUE(same_bits(exr("sized.exr"), render("render.exr", "--settings", settings())));
    EXPECT_TRUE(same_bits(exr("sized.exr"),
                          render("render.exr", "--show-lamps --light", fmt::format("bulb=radius:{}", radius))));
    EXPECT_TRUE(same_bits(exr("undone.exr"), render("render.exr")));
    EXPECT_FALSE(same_bits(exr("sized.exr"), exr("undone.exr")));
}

/// The viewer asks before it ends with edits that are not saved. Enter saves them.
TEST_F(ViewEdit, UnsavedEditsAreAskedAbout) {
    if (run({"sh", "-c", "command -v xdotool"}).status != 0) GTEST_SKIP() << "Debian's package xdotool is missing";
    const std::string saved = settings();
    // The title names the camera once the scene is loaded. Keys have no effect before.
    write_text(folder / "keys.sh", fmt::format(R"(xdotool search --sync --onlyvisible --name '[(]front[)]$' >{0}
        xdotool mousemove 20 60
        xdotool key bracketright
        xdotool search --sync --name 'not saved$' >{0}
        xdotool key ctrl+q
        touch {1}
        while [ ! -f '{2}' ]; do xdotool key Return; sleep 0.1; done
    )",
                                               file("window"), file("asked"), saved));
    // xdotool waits without end for a title that does not come.
    Process input({"timeout", "90", "sh", file("keys.sh")},
                  ProcessOptions{.environment = {"DISPLAY=" + display->name()}});
    const Outcome outcome = run_program(words("view", scene, "--size 64x48 --exposure 0"), on_display(60));
    input.wait();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(file("asked"))) << "the viewer ended before it was asked to";
    EXPECT_EQ(json_file(saved).at("exposure"), 0.25);
}

TEST_F(ViewEdit, ErrorsNameTheObject) {
    expect_error("material flor.roughness=0.5\n", 1, "there is no material 'flor'; did you mean 'floor'");
    expect_error("show lamp\n", 1, "is not hidden");
}

}  // namespace
}  // namespace halflight::test
