// Renders a small room with the program, for tests of its files and messages.
#pragma once

#include <string>

#include "tests/cli/command_test.h"

namespace halflight::test {

class Output : public CommandTest {
  protected:
    /// Renders the room and expects success. Defaults: 32 x 32 pixels, one sample; `more` overrides them.
    Outcome render(const Strings& more, const RunOptions& options = {}) {
        Outcome outcome = done(command(more), options);
        EXPECT_EQ(outcome.out, "");
        return outcome;
    }
    Strings command(const Strings& more) const {
        return with_defaults(words("render", scene, more), "--width 32 --height 32 --samples 1");
    }

    std::string scene = copy_room(folder.path);
    const RunOptions fixed_date{.environment = {"SOURCE_DATE_EPOCH=0"}};
};

}  // namespace halflight::test
