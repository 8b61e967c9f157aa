#include "engine/core/cache_folder.h"

#include <cstdlib>

namespace halflight {

std::filesystem::path cache_folder(std::string_view name) {
    const auto absolute = [](const char* variable) {
        const char* value = std::getenv(variable);
        const std::filesystem::path path = value == nullptr ? "" : value;
        return path.is_absolute() ? path : std::filesystem::path();
    };
    std::filesystem::path cache = absolute("XDG_CACHE_HOME");
    if (const auto home = absolute("HOME"); cache.empty() && !home.empty()) cache = home / ".cache";
    return cache.empty() ? cache : cache / "halflight" / name;
}

}  // namespace halflight
