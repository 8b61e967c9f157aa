// Bytes to disk and back. Invariant: a file appears complete or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace halflight {

/// Calls `write` with the name of a new, empty file in the folder of `path`, then syncs that file to disk and renames
/// it to `path`. A symbolic link is followed, the permissions of a file that is replaced are kept, others follow the
/// umask. On any failure the temporary is removed, `path` stays as it was, and Error names `path` and the system's
/// reason. What `write` throws is passed on.
void write_atomically(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& temporary)>& write);

/// Removes what write_atomically() of processes that were killed has left of these files. Temporaries of those that
/// live, and of file systems without locks, stay; so does what cannot be removed.
void remove_abandoned(std::span<const std::filesystem::path> paths);

/// Throws Error if a file of this name cannot be written here, as far as that can be told without writing it.
void check_writable(const std::filesystem::path& path);

/// write_atomically() of bytes that are in memory.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// The whole of a regular file. Error: missing, unreadable, a folder, a device or pipe, or longer than `max_bytes`.
std::string read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

/// Throws what read_file() would of a file that is missing, unreadable or not a regular one.
void check_readable(const std::filesystem::path& path);

/// Whether these are the first bytes of a Git LFS pointer, which a checkout without LFS has in place of the file.
bool is_lfs_pointer(std::string_view bytes);

/// A buffered file that tells when a write fails, also a late one (a full disk is often seen only by flush or close).
class CheckedFile {
  public:
    /// Opens an existing file for writing, from its start. Errors name `subject`, the file that the user asked for.
    CheckedFile(const std::filesystem::path& existing, std::string subject);
    CheckedFile(const CheckedFile&) = delete;
    CheckedFile& operator=(const CheckedFile&) = delete;
    ~CheckedFile();

    void write(const void* bytes, std::size_t count);
    std::uint64_t tell() const;         ///< bytes from the start
    void seek(std::uint64_t position);  ///< bytes from the start
    /// Flushes and closes; throws what an earlier write() has thrown, should its caller have swallowed that.
    void close();

  private:
    void check(bool succeeded);

    std::string subject_;
    std::FILE* file_ = nullptr;
    int error_ = 0;  // errno of the first failure
};

}  // namespace halflight
