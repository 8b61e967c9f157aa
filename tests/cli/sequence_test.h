// Renders frames of a small animated scene into folders, for tests of sequences.
#pragma once

#include <fmt/format.h>

#include <map>
#include <string>

#include "tests/cli/animated_scenes.h"
#include "tests/cli/command_test.h"

namespace halflight::test {

namespace fs = std::filesystem;

class Sequence : public CommandTest {
  protected:
    /// Returns the command that renders frames to folder/into/f.####.exr. Defaults: 16 x 16 pixels, two samples.
    template <class... Parts>
    Strings command(const std::string& into, const std::string& frames, const Parts&... more) const {
        return with_defaults(
            words("render", scene, folder / into / "f.####.exr", "--frames", frames, "--reproducible", more...),
            "--width 16 --height 16 --samples 2");
    }
    Outcome run(const std::string& into, const std::string& frames, const Strings& more = {},
                const RunOptions& options = {}) const {
        return run_program(command(into, frames, more), options);
    }
    /// Renders frames and expects success.
    Outcome make(const std::string& into, const std::string& frames, const Strings& more = {},
                 const RunOptions& options = {}) const {
        return done(command(into, frames, more), options);
    }
    /// Renders frame 1 into "out" with so many samples that the run takes hours; `options` has to end it.
    Outcome run_for_hours(const RunOptions& options) const {
        return run("out", "1", words("--samples 16777216"), options);
    }
    using CommandTest::file;
    fs::path file(const std::string& in, int number) const { return folder / in / fmt::format("f.{:04}.exr", number); }
    std::map<std::string, std::string> contents(const std::string& of) const {
        std::map<std::string, std::string> files;
        for (const auto& entry : fs::directory_iterator(folder / of))
            if (!entry.path().filename().string().starts_with(".")) files[entry.path().filename()] = read_text(entry);
        return files;
    }
    /// Returns the last line of stderr.
    static std::string last_line(const Outcome& outcome) {
        const std::string text = outcome.err.substr(0, outcome.err.find_last_not_of('\n') + 1);
        return text.substr(text.find_last_of('\n') + 1);
    }

    std::string scene = write_animated_scene(folder.path);
};

}  // namespace halflight::test
