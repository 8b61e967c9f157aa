#include "tools/cli/installation.h"

#include "engine/core/error.h"

namespace halflight {

std::filesystem::path program_folder() {
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    if (error) throw Error("/proc/self/exe", "cannot be read: {}; it tells the program's folder", error.message());
    return program.parent_path();
}

std::filesystem::path demo_scene() {
    const std::filesystem::path folder = program_folder();
    const auto installed = (folder / HALFLIGHT_DATA_FOLDER "/demo.glb").lexically_normal();
    std::error_code none;
    for (const std::filesystem::path& scene : {installed, folder / "demo.glb"})
        if (std::filesystem::exists(scene, none)) return scene;
    throw Error(installed.string(), "is missing; the demo scene is installed with the program");
}

}  // namespace halflight
