// Tests real input of mouse and keys, regions, inspection and comparison in the viewer.
#include "tests/cli/animated_scenes.h"
#include "tests/cli/view_test.h"

namespace halflight::test {
namespace {

class ViewInput : public ViewTest {
  protected:
    /// Returns the exposure in a file of the command `state`.
    double exposure(const char* state) const { return json(state)["exposure"]; }
};

class RealInput : public ViewInput {
  protected:
    void SetUp() override {
        ViewInput::SetUp();
        if (!IsSkipped() && run({"sh", "-c", "command -v xdotool"}).status != 0)
            GTEST_SKIP() << "Debian's package xdotool is missing";
    }

    /// Runs the viewer with real input by a shell script, which starts once there is a picture. Returns the state after
    /// the input and a further command. `first` are commands before the input, `more` options.
    nlohmann::json input_state(const std::string& shell, const std::string& then, const std::string& first = "",
                               const Strings& more = {}) {
        for (const char* name : {"ready.json", "typed"}) std::filesystem::remove(folder / name);
        write_text(folder / "input.sh", fmt::format("until [ -f {0} ]; do sleep 0.1; done\n{1}\ntouch {2}\n",
                                                    file("ready.json"), shell, file("typed")));
        Process input({"sh", file("input.sh")}, ProcessOptions{.environment = {"DISPLAY=" + display->name()}});
        show(first + "wait samples 1\nstate @ready.json\ninput until @typed\n" + then + "\nstate @state.json\n", more);
        input.wait();
        return json("state.json");
    }
};

TEST_F(RealInput, NoInputIsLost) {
    const auto state = input_state(R"(
        xdotool mousemove 100 200
        for i in $(seq 50); do xdotool key --delay 1 bracketright; done
        for i in $(seq 25); do xdotool click --delay 1 2; xdotool click --delay 1 3; done
        xdotool key ctrl+s
        xdotool keydown ctrl keydown s keyup ctrl sleep 0.2 keyup s)",
                                   "");
    EXPECT_EQ(state["exposure"], 50 * 0.25) << "each tap adds a quarter of a stop";
    EXPECT_EQ(state["clicks"], 50);
    EXPECT_EQ(state["view"], json("ready.json")["view"])
        << "a change of exposure has discarded samples, or Ctrl-S has moved the camera";
}

TEST_F(RealInput, EditsAreRepeatedPastAnEnvironment) {
    const auto state = input_state(R"(
        xdotool mousemove 100 200 key bracketright sleep 0.5 key ctrl+z sleep 0.5 key ctrl+z
        sleep 3
        xdotool key ctrl+y sleep 0.5 key ctrl+y
        sleep 5)",
                                   "wait samples 1", "environment studio\n", {"--exposure", "0"});
    EXPECT_EQ(state["exposure"], 0.25) << "an environment loads for a while after the first Ctrl-Y";
}

TEST_F(RealInput, ALampsSizeIsPulledOutWithTheMouse) {
    hang_lamp();
    input_state(fmt::format(R"(
        xdotool mousemove 121 137 sleep 0.3 mousedown 1 sleep 0.3
        xdotool mousemove 128 143 sleep 0.3 mousemove 135 150 sleep 0.3 mouseup 1 sleep 0.3
        xdotool key ctrl+s sleep 1
        cp {} {}
        xdotool key ctrl+z sleep 0.5 key ctrl+s sleep 1)",
                            settings(), file("pulled.json")),
                "wait samples 1\nwindow @window.png", "key H\nselect light:bulb\n");
    EXPECT_GT(json("pulled.json").at("lights").at("bulb").at("radius"), 0.5);
    EXPECT_TRUE(json_file(settings()).at("lights").empty()) << "the whole drag is one edit";
    EXPECT_EQ(json("state.json")["camera"], json("ready.json")["camera"]);
}

TEST_F(RealInput, LampsAreAddedByKeysAndDeleted) {
    input_state(fmt::format(R"(
        xdotool mousemove 100 140 key ctrl+l sleep 0.5 key ctrl+d sleep 0.5 key ctrl+s sleep 1
        cp {0} {1}
        xdotool key Delete sleep 0.5 key ctrl+s sleep 1
        cp {0} {2}
        xdotool key ctrl+z sleep 0.5 key ctrl+z sleep 0.5 key ctrl+s sleep 1)",
                            settings(), file("two.json"), file("one.json")),
                "wait samples 1\nwindow @window.png", "key H\n");
    EXPECT_TRUE(json("two.json").at("added_lights").contains("point 2"));
    EXPECT_EQ(json("one.json").at("added_lights").size(), 1u) << "the selected copy is deleted";
    EXPECT_EQ(json_file(settings()).at("added_lights").size(), 1u) << "and comes back, and the copying is taken back";
}

TEST_F(RealInput, SavesInAnotherFile) {
    write_text(folder / "kept.json", "kept");
    input_state(fmt::format(R"(
        xdotool mousemove 100 200 key h key ctrl+shift+s sleep 1.5 key ctrl+a type {0}
        xdotool key Return sleep 1.5
        cp {0} {1}
        xdotool key Return sleep 1.5 key bracketright key ctrl+s)",
                            file("kept.json"), file("asked.json")),
                "wait samples 1");
    EXPECT_EQ(read_text(file("asked.json")), "kept") << "it was replaced before the user agreed";
    const auto saved = json("kept.json");
    EXPECT_EQ(saved["exposure"], 0.25) << "later saves go to the same file";
}

TEST_F(RealInput, SavesThePictureUnderAName) {
    // The second time with the box "All layers" and the button "Save" of the dialog.
    input_state(fmt::format(R"(
        xdotool mousemove 100 200 key h key ctrl+p sleep 1.5 key ctrl+a type {}
        xdotool key Return sleep 1 key ctrl+p sleep 1 key ctrl+a type {}
        xdotool mousemove 18 145 sleep 0.2 click 1 sleep 0.2 mousemove 27 223 sleep 0.2 click 1 sleep 1)",
                            file("named.exr"), file("all.exr")),
                "wait samples 1");
    EXPECT_EQ(exr("named.exr").width, size.x);
    EXPECT_EQ(channel_names(read_exr(file("named.exr"))).size(), 4u);
    EXPECT_GT(channel_names(read_exr(file("all.exr"))).size(), 20u) << "the box adds all layers";
}

TEST_F(RealInput, ChosenSizesStayInOtherWindows) {
    input_state("xdotool search --name halflight windowsize 500 400 sleep 1", "wait samples 1\nscreenshot @kept.png");
    const Image kept = png("kept.png");
    EXPECT_EQ(ivec2(kept.width, kept.height), ivec2(320, 240));
}

/// Keys over the side bar act on the selected object, and never on what a picture behind the bar would show.
TEST_F(RealInput, KeysOverTheSideBarActOnTheSelection) {
    const char* const over_bar = "xdotool mousemove 300 120 key f sleep 0.5";
    const auto nothing = input_state(over_bar, "", "key H\n");
    EXPECT_EQ(nothing["camera"], json("ready.json")["camera"]) << "everything was framed";
    const auto framed = input_state(over_bar, "", "key H\nselect node:1\n");
    EXPECT_NE(framed["camera"], json("ready.json")["camera"]);
    EXPECT_EQ(framed["selection"], "node 1");
    const auto focused =
        input_state("xdotool mousemove 300 120 key l mousemove 80 146 click 1 sleep 0.5", "", "key H\n");
    EXPECT_GT(focused["focus"], 0) << "L over the bar waits for a click";
    EXPECT_EQ(focused["selection"], "nothing") << "the click that focuses selects nothing";
    EXPECT_EQ(input_state("xdotool mousemove 80 146 click 1 sleep 0.5", "", "key H\n")["selection"], "node 0");
}

/// One tap of a key flies by centimetres, and Z takes it back.
TEST_F(RealInput, CameraMovesAreShortAndTakenBack) {
    const auto flown = input_state("xdotool mousemove 100 200 key d sleep 1", "")["camera"];
    const auto before = json("ready.json")["camera"];
    const double step = flown[0].get<double>() - before[0].get<double>();
    EXPECT_GT(step, 0.001);
    EXPECT_LT(step, 0.5);
    EXPECT_EQ(input_state("xdotool mousemove 100 200 key d sleep 1 key z sleep 0.5", "")["camera"], before);
}

TEST_F(RealInput, SpacePlaysTheFirstAnimation) {
    scene = write_animated_scene(folder.path).string();
    const auto state = input_state("xdotool mousemove 100 200 key space sleep 4", "", "", {"--quiet"});
    EXPECT_EQ(state["animation"], "bend");
    EXPECT_GT(state["frame"], 0) << "it does not play";
}

/// The picture fills its area from the first frame on, also if the window is smaller than was asked.
TEST_F(RealInput, ThePictureFillsItsAreaAtOnce) {
    write_text(folder / "keys.sh", fmt::format(R"(xdotool search --sync --onlyvisible --name '[(]front[)]$' >{0}
        xdotool mousemove 20 60
        while [ ! -f '{1}' ]; do xdotool key ctrl+s; sleep 0.5; done
        xdotool key ctrl+q
    )",
                                               file("window"), settings()));
    Process input({"timeout", "90", "sh", file("keys.sh")},
                  ProcessOptions{.environment = {"DISPLAY=" + display->name()}});
    const Outcome outcome = run_program(words("view", scene, "--exposure 0"), on_display(60));
    input.wait();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const auto saved = json_file(settings()).at("size");
    EXPECT_LT(saved[0], 1000) << "the display has 1280 pixels, of which the side bar takes more than 300";
}

TEST_F(ViewInput, OtherEnvironmentsAreMetered) {
    ExrLayer bright{{"R", "G", "B"}, Image(2, 1, 3)};
    std::ranges::fill(bright.image.pixels, 5000.0f);
    write_exr(file("bright.exr"), {bright}, {});
    show(R"(
        wait samples 1
        state @first.json
        environment @bright.exr
        wait samples 1
        window @a.png
        state @bright.json
        undo
        wait samples 1
        window @b.png
        state @undone.json
        environment @bright.exr
        wait samples 1
        window @c.png
        state @again.json
        undo
        intensity 0
        emission 10000
        wait samples 1
        state @edited.json
        key M
        window @m.png
        state @metered.json
        exposure 1
        environment white
        wait samples 1
        window @d.png
        state @chosen.json)");
    EXPECT_EQ(exposure("first.json"), 0);
    EXPECT_NEAR(exposure("bright.json"), -std::log2(5000), 3);
    EXPECT_EQ(exposure("undone.json"), 0);
    EXPECT_NEAR(exposure("again.json"), -std::log2(5000), 3) << "an undo has ended metering";
    EXPECT_EQ(exposure("edited.json"), 0) << "an edit of the light is not metered";
    EXPECT_NEAR(exposure("metered.json"), -std::log2(10000), 3);
    EXPECT_EQ(exposure("chosen.json"), 1) << "the user has chosen it";
}

TEST_F(ViewInput, InspectsPixelsAndCompares) {
    show(R"(
        wait samples 3
        screenshot @seen.exr
        screenshot @seen.png
        probe 160 170 @probe.json
        histogram @histogram.json
        state @before.json
        view albedo
        wait first
        view final
        wait first
        state @after.json
        against @seen.exr
        comparison difference
        screenshot @none.png
        exposure 1
        comparison split
        split 0
        screenshot @other.png
        exposure 0
        split 1
        view luminance
        wait first
        screenshot @luminance.png)");
    const auto probe = json("probe.json");
    const Image seen = exr("seen.exr");
    for (int c = 0; c < 3; ++c) EXPECT_EQ(probe["value"][std::size_t(c)].get<float>(), seen.at(160, 170)[c]);
    EXPECT_EQ(probe["samples"], 3);
    EXPECT_EQ(read_exr(file("seen.exr")).attributes.counts.at("samples"), 3);
    EXPECT_GT(probe["depth"], 0);
    EXPECT_EQ(probe["position"][1].get<double>(), 0) << "the floor";
    const auto histogram = json("histogram.json");
    double sum = histogram["black"];
    for (const double share : histogram["shares"]) sum += share;
    EXPECT_NEAR(sum, 1, 1e-4);
    EXPECT_EQ(json("after.json")["samples"], 3) << "a change of layer has discarded samples";
    EXPECT_EQ(json("after.json")["view"], json("before.json")["view"]);
    EXPECT_LE(mean(png("none.png")), 1e-3) << "a picture differs from itself";
    EXPECT_GT(difference(png("other.png"), png("seen.png")), 10) << "exposure applies to the file, too";
    EXPECT_GT(difference(png("luminance.png"), png("seen.png")), 10) << "it has no colours of its own";
    // The differences from black and from twice the picture are the picture.
    Image black = seen, twice = seen;
    for (int i = 0; i < seen.width * seen.height; ++i)
        for (int c = 0; c < 3; ++c) black.pixels[std::size_t(4 * i + c)] = 0, twice.pixels[std::size_t(4 * i + c)] *= 2;
    write_exr(file("black.exr"), {{{"R", "G", "B", "A"}, black}}, {});
    write_exr(file("twice.exr"), {{{"R", "G", "B", "A"}, twice}}, {});
    show(R"(
        wait samples 3
        against @black.exr
        comparison difference
        screenshot @from-black.png
        against @twice.exr
        screenshot @from-twice.png)");
    EXPECT_GT(std::ranges::max(png("seen.png").pixels), 0.5) << "black pictures would show no difference either";
    EXPECT_EQ(difference(png("from-black.png"), png("seen.png")), 0);
    EXPECT_EQ(difference(png("from-twice.png"), png("seen.png")), 0);
    expect_error("wait samples 1\nscreenshot @a.png\nagainst @a.png\ncomparison difference\n", 4, "comparison: ");
}

TEST_F(ViewInput, RegionsTakeSamplesAndKeepThem) {
    show(R"(
        wait samples 2
        screenshot @two.exr
        region 100 60 210 170
        wait samples 8
        state @state.json
        screenshot @region.exr
        region off
        wait samples 8
        screenshot @whole.exr)");
    EXPECT_EQ(json("state.json")["region"], nlohmann::json({100, 60, 210, 170}));
    const Image region = exr("region.exr"), two = exr("two.exr"), eight = render("eight.exr", "--samples 8");
    EXPECT_TRUE(same_bits(exr("whole.exr"), eight)) << "samples were lost";
    for (int y = 0; y < region.height; ++y)
        for (int x = 0; x < region.width; ++x)
            for (int c = 0; c < 3; ++c) {
                const bool inside = x >= 100 && x < 210 && y >= 60 && y < 170;
                if (inside)
                    ASSERT_NEAR(region.at(x, y)[c], eight.at(x, y)[c], 1e-5f * (1 + eight.at(x, y)[c]));
                else
                    ASSERT_EQ(region.at(x, y)[c], two.at(x, y)[c]) << "it has taken further samples";
            }
    expect_has(read_exr(file("region.exr")).attributes.comments, "8 in the region 100,60,210,170");
    expect_error("region 400 10 500 20\n", 1, "region: ");
    expect_error("region on\n", 1, "'region'");
}

TEST_F(RealInput, RegionsAreDrawnWithTheMouse) {
    const auto state = input_state(R"(
        xdotool key ctrl+b
        xdotool mousemove 140 120 mousedown 1
        xdotool mousemove 90 80 mousemove 40 50 mouseup 1
        xdotool key bracketright)",
                                   "wait samples 2");
    EXPECT_EQ(state["region"], nlohmann::json({40, 50, 140, 120}));
    EXPECT_EQ(state["exposure"], 0.25);
    EXPECT_EQ(state["view"], 1) << "the camera has moved";
    EXPECT_TRUE(input_state(R"(
        xdotool key ctrl+b key Escape
        xdotool mousemove 140 120 mousedown 1 mousemove 40 50 mouseup 1)",
                            "wait first")["region"]
                    .is_null());
}

}  // namespace
}  // namespace halflight::test
