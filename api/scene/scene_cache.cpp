#include "api/scene/scene_cache.h"

#include <chrono>
#include <utility>

#include "engine/core/cache_folder.h"
#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/gltf/parts.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

/// Opens a page file. Returns null if it is missing, damaged, or was not made of these files.
std::shared_ptr<paging::PageFile> open_if_made_of(std::span<const GltfScene> parts, const fs::path& file) {
    if (!fs::exists(file)) return nullptr;
    try {
        auto pages = std::make_shared<paging::PageFile>(file, paging::WhenDamaged::remove);
        return have_contents(parts, pages->index().files) ? pages : nullptr;
    } catch (const paging::DamagedPages&) {
        return nullptr;
    }
}

}  // namespace

std::shared_ptr<paging::PageFile> cached_pages(const fs::path& scene, std::span<const GltfScene> parts,
                                               const PackOptions& options, const Log& log) {
    const fs::path folder = cache_folder("scenes");
    if (folder.empty())
        throw Error(scene.string(),
                    "needs a page file (--pages): neither XDG_CACHE_HOME nor HOME names a cache for it");
    std::error_code error;
    fs::create_directories(folder, error);
    const fs::path file = folder / fmt::format("{:016x}-{}{}.pages", identity_of(parts), paging::kPageFileVersion,
                                               options.straight_glass ? "-straight" : "");
    remove_abandoned({&file, 1});
    std::shared_ptr<paging::PageFile> pages = open_if_made_of(parts, file);
    if (!pages) {
        PackOptions told = options;
        told.progress = [&, noted = false](double share) mutable {
            if (!std::exchange(noted, true))
                log.note(
                    "{}: {}; it is converted to {}, once", scene.string(),
                    is_part_list(scene) ? "lists of files are not loaded whole" : "the scene does not fit into memory",
                    file.string());
            if (options.progress) options.progress(share);
        };
        pack_scene(scene, file, told, log);
        pages = std::make_shared<paging::PageFile>(file, paging::WhenDamaged::remove);
    }
    fs::last_write_time(file, fs::file_time_type::clock::now(), error);  // the time of the last use
    trim_cache(folder, ".pages", {}, file);
    return pages;
}

}  // namespace halflight
