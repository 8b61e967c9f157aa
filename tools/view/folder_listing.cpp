#include "tools/view/folder_listing.h"

#include <algorithm>
#include <cstdlib>
#include <system_error>
#include <tuple>

#include "api/halflight/picture_file.h"
#include "engine/core/error.h"

namespace halflight::view {

std::vector<FolderEntry> list_folder(const std::filesystem::path& folder,
                                     std::span<const std::string_view> extensions) {
    std::vector<FolderEntry> all;
    std::error_code problem;
    for (std::filesystem::directory_iterator entry(folder, problem), end; !problem && entry != end;
         entry.increment(problem)) {
        std::string name = entry->path().filename().string();
        std::error_code unknown;  // a broken link is neither folder nor file
        const bool is_folder = entry->is_directory(unknown);
        const bool offered = std::ranges::any_of(
            extensions, [&](std::string_view extension) { return has_extension(entry->path(), extension); });
        if (!name.starts_with('.') && (is_folder || (offered && entry->is_regular_file(unknown))))
            all.push_back({std::move(name), is_folder});
    }
    if (problem) throw Error(folder.string(), "cannot be read: {}", problem.message());
    std::ranges::sort(all, {}, [](const FolderEntry& e) { return std::tuple(!e.folder, e.name); });
    return all;
}

std::filesystem::path typed_path(const std::filesystem::path& folder, std::string_view name) {
    const char* home = std::getenv("HOME");
    if (home && (name == "~" || name.starts_with("~/")))
        return (std::filesystem::path(home) / name.substr(std::min<std::size_t>(name.size(), 2))).lexically_normal();
    return (folder / name).lexically_normal();
}

}  // namespace halflight::view
