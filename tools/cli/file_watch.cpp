#include "tools/cli/file_watch.h"

#include <algorithm>
#include <utility>

#include "engine/io/files.h"

namespace halflight {

void FileWatch::add(const std::filesystem::path& path) {
    add(versioned(path));
}

void FileWatch::add(const VersionedFile& file) {
    if (!file.path.empty()) known_.try_emplace(file.path, file.version);
}

void FileWatch::add(std::span<const VersionedFile> files) {
    for (const VersionedFile& file : files) add(file);
}

void FileWatch::replace(const VersionedFile& file) {
    if (!file.path.empty()) known_[file.path] = file.version;
    changed_ = false;  // until the next look
}

FileWatch::Versions FileWatch::present() const {
    Versions now;
    for (const auto& [path, version] : known_) now.emplace_hint(now.end(), path, versioned(path).version);
    return now;
}

bool FileWatch::changed() {
    constexpr double kInterval = 0.1;  // seconds between looks; files that have not changed for so long are complete
    constexpr double kShare = 20;      // a look takes at most one of so many parts of the time
    const double start = clock_.seconds();
    if (start < next_) return changed_;
    Versions now = present();
    changed_ = now != known_ && now == seen_;
    seen_ = now == known_ ? Versions() : std::move(now);
    const double end = clock_.seconds();
    next_ = end + std::max(kInterval, kShare * (end - start));
    return changed_;
}

}  // namespace halflight
