// Runs the viewer with scripts and compares the pictures that it leaves.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/core/image_tools.h"
#include "engine/core/process.h"
#include "engine/io/png.h"
#include "tests/cli/command_test.h"
#include "tests/cli/virtual_display.h"

namespace halflight::test {

inline constexpr int kMostSeconds = 240;  // limit for a viewer that hangs

/// Runs `halflight view` with scripts on a virtual display that the tests of a suite share.
class ViewTest : public CommandTest {
  protected:
    static void SetUpTestSuite() { display = new VirtualDisplay; }
    static void TearDownTestSuite() {
        delete display;
        display = nullptr;
    }
    void SetUp() override {
        if (display->name().empty()) GTEST_SKIP() << display->why_not();
    }

    static RunOptions on_display(int most_seconds = kMostSeconds) {
        RunOptions options;
        options.environment = {"DISPLAY=" + display->name(), "LIBGL_ALWAYS_SOFTWARE=1"};
        options.most_seconds = most_seconds;
        return options;
    }
    /// Runs `halflight view` without preview modes, with a script in which @ stands for the test's folder.
    Outcome view(const std::string& script, const Strings& more = {}) {
        return view_by_default(script, words(more, "--preview none"));
    }
    Outcome view_by_default(std::string script, const Strings& more = {}) {
        for (std::size_t at = 0; (at = script.find('@')) != std::string::npos;)
            script.replace(at, 1, folder.path.string() + "/");
        write_text(file("script.txt"), script);
        return run_program(
            words("view", scene, "--size", fmt::format("{}x{}", size.x, size.y), "--script", file("script.txt"), more),
            on_display());
    }
    /// Runs the viewer as view() does, and expects success.
    void show(const std::string& script, const Strings& more = {}) { expect_done(view(script, more)); }
    static void expect_done(const Outcome& outcome) {
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
    }
    /// Expects that a script fails in a line with an error about `element`.
    void expect_error(const std::string& script, int line, const std::string& element, const Strings& more = {}) {
        const Outcome outcome = view(script, words(more, "--quiet"));
        EXPECT_EQ(outcome.status, 1) << script;
        EXPECT_TRUE(outcome.err.starts_with(fmt::format("halflight: {}:{}: ", file("script.txt"), line)))
            << outcome.err;
        expect_has(outcome.err, element);
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    }
    /// Renders a picture of the viewer's size, with two samples. Returns it if it is an .exr.
    template <class... Parts>
    Image render(const std::string& name, const Parts&... more) const {
        done(with_defaults(words("render", scene, file(name), "--quiet", more...),
                           fmt::format("--width {} --height {} --samples 2", size.x, size.y).c_str()));
        return name.ends_with(".exr") ? exr(name) : Image();
    }
    /// Hangs a lamp without a size 1 m to the right of the room's middle.
    void hang_lamp() const {
        nlohmann::json file = json_file(scene);
        file["extensionsUsed"] = {"KHR_lights_punctual"};
        file["extensions"]["KHR_lights_punctual"]["lights"] = {{{"name", "bulb"}, {"type", "point"}}};
        file["nodes"].push_back(
            {{"translation", {1, 1, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
        file["scenes"][0]["nodes"].push_back(file["nodes"].size() - 1);
        write_text(scene, file.dump());
    }
    std::string settings() const { return scene + ".halflight.json"; }
    Image png(const std::string& name) const { return read_png(file(name), read_text(file(name)), 4096); }
    Image exr(const std::string& name) const { return read_exr(file(name)).image({"R", "G", "B", "A"}); }
    nlohmann::json json(const std::string& name) const { return json_file(file(name)); }

    /// Returns the largest difference of two pictures, in 8-bit steps.
    static double difference(const Image& a, const Image& b) {
        EXPECT_EQ(ivec3(a.width, a.height, a.channels), ivec3(b.width, b.height, b.channels));
        if (a.pixels.size() != b.pixels.size()) return 255;
        double most = 0;
        for (std::size_t i = 0; i < a.pixels.size(); ++i)
            most = std::max(most, std::abs(double{a.pixels[i]} - double{b.pixels[i]}));
        return 255 * most;
    }
    static double mean(const Image& image) {
        double sum = 0;
        for (const float v : image.pixels) sum += double{v};
        return sum / static_cast<double>(image.pixels.size());
    }

    std::string scene = copy_room(folder.path);
    ivec2 size = {320, 240};
    static inline VirtualDisplay* display = nullptr;
};

}  // namespace halflight::test
