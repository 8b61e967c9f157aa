#include "tools/cli/installation.h"

#include "api/halflight/settings_file.h"
#include "engine/core/error.h"

namespace halflight {

std::filesystem::path program_folder() {
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    if (error) throw Error("/proc/self/exe", "cannot be read: {}; it tells the program's folder", error.message());
    return program.parent_path();
}

namespace {

std::filesystem::path installed_demo() {
    return (program_folder() / HALFLIGHT_DATA_FOLDER "/demo.glb").lexically_normal();
}

}  // namespace

std::filesystem::path settings_file_for(const std::filesystem::path& scene) {
    const std::filesystem::path usual = settings_file_of(scene);
    return scene == installed_demo() ? usual.filename() : usual;
}

std::filesystem::path demo_scene() {
    const std::filesystem::path folder = program_folder();
    const std::filesystem::path installed = installed_demo();
    std::error_code none;
    for (const std::filesystem::path& scene : {installed, folder / "demo.glb"})
        if (std::filesystem::exists(scene, none)) return scene;
    throw Error(installed.string(), "is missing; the demo scene is installed with the program");
}

}  // namespace halflight
