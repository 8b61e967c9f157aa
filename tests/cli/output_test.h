// Renders a small room with the program, for tests of its files and messages.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/io/exr.h"
#include "tests/support/process.h"

namespace halflight::test {

using Strings = std::vector<std::string>;

class Output : public testing::Test {
  protected:
    /// Renders the room and expects success. Defaults: 32 x 32 pixels, one sample; `more` overrides them.
    Outcome render(Strings more, const RunOptions& options = {}) {
        Strings arguments = {"render", scene};
        const auto add = [&](const char* option, const char* value) {
            if (std::find(more.begin(), more.end(), option) == more.end())
                arguments.insert(arguments.end(), {option, value});
        };
        add("--width", "32"), add("--height", "32"), add("--samples", "1");
        arguments.insert(arguments.end(), more.begin(), more.end());
        Outcome outcome = run_program(arguments, options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(outcome.out, "");
        return outcome;
    }
    std::string file(const std::string& name) const { return folder / name; }

    TemporaryFolder folder;
    std::string scene = copy_room(folder.path);
    const RunOptions fixed_date{.environment = {"SOURCE_DATE_EPOCH=0"}};
};

inline Strings channel_names(const ExrFile& exr) {
    Strings names;
    for (const ExrChannel& channel : exr.channels) names.push_back(channel.name);
    return names;
}

inline bool same_pixels(const std::string& a, const std::string& b) {
    const ExrFile x = read_exr(a), y = read_exr(b);
    if (channel_names(x) != channel_names(y)) return false;
    for (std::size_t i = 0; i < x.channels.size(); ++i)
        if (x.channels[i].values != y.channels[i].values) return false;
    return true;
}

}  // namespace halflight::test
