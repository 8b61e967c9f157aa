// A folder of shaders that is read in place of the embedded files.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/environment_variable.h"
#include "tools/common/temporary_folder.h"

namespace halflight::gpu {

/// Reads shaders from a temporary folder during its lifetime.
class ShaderFolder {
  public:
    ShaderFolder() { std::filesystem::create_directories(folder_ / "lib"); }
    void add(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
    void remove(const std::string& name) const { std::filesystem::remove(folder_ / name); }

  private:
    TemporaryFolder folder_;
    test::EnvironmentVariable variable_{"HALFLIGHT_SHADERS", folder_.path.string()};
};

}  // namespace halflight::gpu
