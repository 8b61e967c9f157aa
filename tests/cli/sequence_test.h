// Renders frames of a small animated scene into folders, for tests of sequences.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "engine/io/exr.h"
#include "tests/cli/animated_scenes.h"
#include "tests/support/process.h"

namespace halflight::test {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

class Sequence : public testing::Test {
  protected:
    /// Renders frames to folder/into/f.####.exr. Defaults: 16 x 16 pixels, two samples; `more` overrides them.
    Outcome run(const std::string& into, const std::string& frames, const Strings& more = {},
                const RunOptions& options = {}) {
        Strings arguments = {"render",    scene,      folder / into / "f.####.exr",
                             "--frames",  frames,     "--width",
                             "16",        "--height", "16",
                             "--samples", "2",        "--reproducible"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments, options);
    }
    /// Renders frame 1 into "out" with so many samples that the run takes hours; `options` has to end it.
    Outcome run_for_hours(const RunOptions& options) {
        return run_program({"render", scene, folder / "out/f.####.exr", "--frames", "1", "--width", "16", "--height",
                            "16", "--samples", "16777216", "--reproducible"},
                           options);
    }
    Outcome make(const std::string& into, const std::string& frames, const Strings& more = {},
                 const RunOptions& options = {}) {
        Outcome outcome = run(into, frames, more, options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return outcome;
    }
    fs::path file(const std::string& in, int frame) const { return folder / in / fmt::format("f.{:04}.exr", frame); }
    std::map<std::string, std::string> contents(const std::string& of) const {
        std::map<std::string, std::string> files;
        for (const auto& entry : fs::directory_iterator(folder / of))
            if (!entry.path().filename().string().starts_with(".")) files[entry.path().filename()] = read_text(entry);
        return files;
    }
    static bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
        return a.size() == b.size() &&
               std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;  // ids may be NaN
    }
    static bool same_pixels(const fs::path& a, const fs::path& b) {
        const ExrFile x = read_exr(a), y = read_exr(b);
        if (x.channels.size() != y.channels.size()) return false;
        for (std::size_t i = 0; i < x.channels.size(); ++i)
            if (x.channels[i].name != y.channels[i].name || !same_bits(x.channels[i].values, y.channels[i].values))
                return false;
        return true;
    }
    /// Returns the last line of stderr.
    static std::string last_line(const Outcome& outcome) {
        const std::string text = outcome.err.substr(0, outcome.err.find_last_not_of('\n') + 1);
        return text.substr(text.find_last_of('\n') + 1);
    }

    TemporaryFolder folder;
    std::string scene = write_animated_scene(folder.path);
};

}  // namespace halflight::test
