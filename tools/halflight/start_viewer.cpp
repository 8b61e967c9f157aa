#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "tools/halflight/commands.h"

namespace halflight {

void start_viewer(char** argv) {
    std::error_code none;
    const auto own = std::filesystem::read_symlink("/proc/self/exe", none);
    if (none) throw Error("halflight-view", "cannot be started: /proc is not there, which tells its folder");
    const auto viewer = own.parent_path() / "halflight-view";
    execv(viewer.c_str(), argv);
    throw Error(viewer.string(), "cannot be started: {}; the viewer is a separate program, which some builds lack",
                std::generic_category().message(errno));
}

}  // namespace halflight
