// Changes of files on disk, for --watch.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>

#include "engine/core/stopwatch.h"
#include "engine/core/versioned_file.h"

namespace halflight {

/// A set of files, and whether they have changed since they were read. It compares versions (versioned()), which works
/// on network file systems, for files that are replaced by others of their name, and for files that are missing.
class FileWatch {
  public:
    /// Watches a file from its present version on. Call this before the file is read, so that no change is lost. A
    /// file that is watched already keeps its version. An empty path is no file.
    void add(const std::filesystem::path& path);
    /// Watches a file from the version on with which it was read.
    void add(const VersionedFile& file);
    void add(std::span<const VersionedFile> files);
    /// Adds the files of another object.
    void add(const FileWatch& files) { known_.insert(files.known_.begin(), files.known_.end()); }
    /// Watches a file from another version on.
    void replace(const VersionedFile& file);
    void renew() { known_ = present(), changed_ = false; }  ///< Watches all files from their present versions on.

    std::size_t size() const { return known_.size(); }  ///< Returns the number of files.
    /// Returns whether a file differs from its version now.
    bool differs() const { return present() != known_; }
    /// Returns whether files differ, and have stayed as they are for a moment, so that they are probably complete.
    /// Looks at most ten times in a second, and for at most a twentieth of the time.
    bool changed();

  private:
    using Versions = std::map<std::filesystem::path, decltype(VersionedFile::version)>;
    Versions present() const;

    Versions known_;  // versions that were read
    Versions seen_;   // versions at the last look that differed; empty: none did
    Stopwatch clock_;
    double next_ = 0;       // time of the next look, seconds of `clock_`
    bool changed_ = false;  // result of the last look
};

}  // namespace halflight
