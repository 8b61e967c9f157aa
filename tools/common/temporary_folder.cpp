#include "tools/common/temporary_folder.h"

#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "engine/core/error.h"

namespace halflight {

TemporaryFolder::TemporaryFolder() {
    std::error_code missing;
    const std::filesystem::path base = std::filesystem::temp_directory_path(missing);
    std::string name = (missing ? "/tmp" : base) / "halflight-XXXXXX";
    if (!mkdtemp(name.data())) throw Error(name, "cannot be made: {}", std::generic_category().message(errno));
    path = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code stays;
    std::filesystem::remove_all(path, stays);
}

std::vector<std::string> TemporaryFolder::entries() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path)) names.push_back(entry.path().filename());
    std::ranges::sort(names);
    return names;
}

}  // namespace halflight
