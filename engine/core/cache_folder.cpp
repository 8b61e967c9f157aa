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

std::filesystem::path scratch_folder() {
    std::error_code none;
    if (const char* wanted = std::getenv("TMPDIR"); wanted && std::filesystem::is_directory(wanted, none))
        return wanted;
    const std::filesystem::path cache = cache_folder("temporary");
    if (!cache.empty()) std::filesystem::create_directories(cache, none);
    return !cache.empty() && std::filesystem::is_directory(cache, none) ? cache
                                                                        : std::filesystem::temp_directory_path();
}

}  // namespace halflight
