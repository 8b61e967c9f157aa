// Runs the viewer with scripts and compares the pictures that it leaves.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "engine/core/image_tools.h"
#include "engine/core/process.h"
#include "engine/io/exr.h"
#include "engine/io/png.h"
#include "tests/cli/virtual_display.h"
#include "tests/support/process.h"

namespace halflight::test {

inline constexpr int kMostSeconds = 240;  // limit for a viewer that hangs

/// Runs `halflight view` with scripts on a virtual display that the tests of a suite share.
class ViewTest : public testing::Test {
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

    static RunOptions on_display(const std::string& name) {
        RunOptions options;
        options.environment = {fmt::format("DISPLAY={}", name), "LIBGL_ALWAYS_SOFTWARE=1"};
        options.most_seconds = kMostSeconds;
        return options;
    }
    /// Runs `halflight view` without preview modes, with a script in which @ stands for the test's folder.
    Outcome view(const std::string& script, std::vector<std::string> more = {}) {
        more.insert(more.end(), {"--preview", "none"});
        return view_by_default(script, more);
    }
    Outcome view_by_default(std::string script, const std::vector<std::string>& more = {}) {
        for (std::size_t at = 0; (at = script.find('@')) != std::string::npos;)
            script.replace(at, 1, folder.path.string() + "/");
        write_text(folder / "script.txt", script);
        std::vector<std::string> arguments = {"view", scene, "--size", size, "--script", file("script.txt")};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments, on_display(display->name()));
    }
    void expect_done(const Outcome& outcome) {
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
    }
    void render(std::vector<std::string> more) {
        more.insert(more.begin(), {"render", scene, "--width", "320", "--height", "240", "--quiet"});
        const Outcome outcome = run_program(more);
        ASSERT_EQ(outcome.status, 0) << outcome.err;
    }
    Image png(const std::string& name) const { return read_png(file(name), read_text(file(name)), 4096); }
    Image exr(const std::string& name) const { return read_exr(file(name)).image({"R", "G", "B", "A"}); }

    /// Returns the largest difference of two pictures, in 8-bit steps.
    static double difference(const Image& a, const Image& b) {
        EXPECT_EQ(a.width, b.width);
        EXPECT_EQ(a.height, b.height);
        EXPECT_EQ(a.channels, b.channels);
        if (a.pixels.size() != b.pixels.size()) return 255;
        double most = 0;
        for (std::size_t i = 0; i < a.pixels.size(); ++i)
            most = std::max(most, std::abs(double{a.pixels[i]} - double{b.pixels[i]}));
        return 255 * most;
    }
    static bool same_values(const ExrChannel& a, const ExrChannel& b) {
        const auto bits = [](float v) { return std::bit_cast<std::uint32_t>(v); };
        return std::ranges::equal(a.values, b.values, {}, bits, bits);
    }
    /// Returns columns [first, end) of a picture.
    static Image crop(const Image& image, int first, int end) {
        Image part(end - first, image.height, image.channels);
        for (int y = 0; y < image.height; ++y)
            std::copy_n(image.at(first, y), (end - first) * image.channels, part.at(0, y));
        return part;
    }
    static double mean(const Image& image) {
        double sum = 0;
        for (const float v : image.pixels) sum += double{v};
        return sum / static_cast<double>(image.pixels.size());
    }

    TemporaryFolder folder;
    std::string scene = copy_room(folder.path);
    std::string size = "320x240";
    static inline VirtualDisplay* display = nullptr;
};

}  // namespace halflight::test
