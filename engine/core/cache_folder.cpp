#include "engine/core/cache_folder.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

namespace halflight {

namespace fs = std::filesystem;

namespace {

/// Returns whether a file has the name of a cache's file: its hash, then text that contains `kind`.
bool is_of_cache(std::string_view name, std::string_view kind) {
    constexpr std::size_t kDigits = 16;
    return name.substr(0, kDigits).find_first_not_of("0123456789abcdef") == std::string_view::npos &&
           name.find(kind, kDigits) != std::string_view::npos;
}

}  // namespace

fs::path cache_folder(std::string_view name) {
    const auto absolute = [](const char* variable) {
        const char* value = std::getenv(variable);
        const std::filesystem::path path = value == nullptr ? "" : value;
        return path.is_absolute() ? path : std::filesystem::path();
    };
    std::filesystem::path cache = absolute("XDG_CACHE_HOME");
    if (const auto home = absolute("HOME"); cache.empty() && !home.empty()) cache = home / ".cache";
    return cache.empty() ? cache : cache / "halflight" / name;
}

void trim_cache(const fs::path& folder, std::string_view kind, std::optional<std::uintmax_t> most,
                const fs::path& kept) {
    struct Entry {
        fs::file_time_type used;
        fs::path path;
        std::uintmax_t bytes;
    };
    std::vector<Entry> entries;
    std::uintmax_t total = 0;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
        if (!is_of_cache(at->path().filename().string(), kind)) continue;
        std::error_code gone;  // another process may have removed the file
        const bool regular = at->symlink_status(gone).type() == fs::file_type::regular;
        const std::uintmax_t bytes = at->file_size(gone);
        const fs::file_time_type used = at->last_write_time(gone);
        if (gone || !regular) continue;
        entries.push_back({used, at->path(), bytes});
        total += bytes;
    }
    if (!most) {
        const fs::space_info space = fs::space(folder, error);
        if (error) return;
        most = (total + space.available) / 2;
    }
    std::ranges::sort(entries, {}, &Entry::used);
    for (const Entry& entry : entries)
        if (total > *most && entry.path != kept && fs::remove(entry.path, error)) total -= entry.bytes;
}

fs::path scratch_folder() {
    std::error_code none;
    if (const char* wanted = std::getenv("TMPDIR"); wanted && std::filesystem::is_directory(wanted, none))
        return wanted;
    const std::filesystem::path cache = cache_folder("temporary");
    if (!cache.empty()) std::filesystem::create_directories(cache, none);
    if (!cache.empty() && std::filesystem::is_directory(cache, none)) return cache;
    const std::filesystem::path system = std::filesystem::temp_directory_path(none);
    return none ? "/tmp" : system;  // TMPDIR may name a folder that is missing
}

}  // namespace halflight
