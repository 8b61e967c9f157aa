#include "api/scene_cache.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "engine/core/cache_folder.h"
#include "engine/core/error.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

bool is_intact(const fs::path& file) {
    try {
        paging::PageFile{file};
        return true;
    } catch (const Error&) {
        return false;
    }
}

/// Deletes the files used least recently until the others take at most half of what they and the free space take.
/// Files that cannot be deleted stay.
void trim(const fs::path& folder, const fs::path& kept) {
    struct Entry {
        fs::path path;
        fs::file_time_type used;
        std::uintmax_t bytes;
    };
    std::vector<Entry> entries;
    std::uintmax_t total = 0;
    std::error_code error;
    for (const fs::directory_entry& file : fs::directory_iterator(folder, error)) {
        if (file.path().extension() != ".pages" || !file.is_regular_file(error)) continue;
        entries.push_back({file.path(), file.last_write_time(error), file.file_size(error)});
        total += entries.back().bytes;
    }
    const fs::space_info space = fs::space(folder, error);
    if (error) return;
    std::ranges::sort(entries, {}, &Entry::used);
    const std::uintmax_t most = (total + space.available) / 2;
    for (const Entry& entry : entries)
        if (total > most && entry.path != kept && fs::remove(entry.path, error)) total -= entry.bytes;
}

}  // namespace

fs::path cached_pages(const fs::path& scene, std::uint64_t identity, const PackOptions& options, const Log& log) {
    const fs::path folder = cache_folder("scenes");
    if (folder.empty())
        throw Error(scene.string(),
                    "needs a page file (--pages): neither XDG_CACHE_HOME nor HOME names a cache for it");
    std::error_code error;
    fs::create_directories(folder, error);
    const fs::path file = folder / fmt::format("{:016x}-{}.pages", identity, paging::kPageFileVersion);
    if (!is_intact(file)) {
        log.note("{}: the scene does not fit into memory; it is converted to {}, once", scene.string(), file.string());
        pack_scene(scene, file, options, log);
    }
    fs::last_write_time(file, fs::file_time_type::clock::now(), error);  // the time of the last use
    trim(folder, file);
    return file;
}

}  // namespace halflight
