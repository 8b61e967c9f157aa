#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "tools/cli/installation.h"
#include "tools/halflight/commands.h"

namespace halflight {

void start_viewer(char** argv) {
    const auto viewer = program_folder() / "halflight-view";
    execv(viewer.c_str(), argv);
    throw Error(viewer.string(), "cannot be started: {}; the viewer is a separate program, which some builds lack",
                std::generic_category().message(errno));
}

}  // namespace halflight
