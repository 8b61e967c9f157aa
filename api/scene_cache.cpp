#include "api/scene_cache.h"

#include <chrono>

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
    trim_cache(folder, ".pages", {}, file);
    return file;
}

}  // namespace halflight
