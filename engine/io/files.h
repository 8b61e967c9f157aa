// Reading and writing of files. A file appears complete or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/versioned_file.h"

namespace halflight {

/// A file cannot be written for a reason that concerns other files, too: a full disk, quota or limit of the process, a
/// disk that is read-only or damaged.
class DiskError : public Error {
  public:
    using Error::Error;
};
/// Throws "SUBJECT: cannot write WHAT: reason" for an errno; DiskError for one that concerns other files, too.
[[noreturn]] void throw_write_error(const std::string& subject, int error, const char* what = "");

/// Calls `write` with the name of a new, empty file in the folder of `path`. Then syncs that file to disk and renames
/// it to `path`. Follows a symbolic link; keeps the permissions of a replaced file; other permissions follow the umask.
/// On failure removes the temporary, leaves `path` unchanged, and throws Error with `path` and the system's reason.
/// Exceptions of `write` propagate.
void write_atomically(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& temporary)>& write);

/// Writes a file as write_atomically() does. The temporary has no name until it is complete, so a killed process leaves
/// nothing. File systems without such files get an ordinary temporary.
void write_unnamed(const std::filesystem::path& path,
                   const std::function<void(const std::filesystem::path& temporary)>& write);

/// Removes temporaries of write_atomically() for these files that killed processes have left. Temporaries of live
/// processes and on file systems without locks are kept, and so are those that cannot be removed.
void remove_abandoned(std::span<const std::filesystem::path> paths);

/// Makes the folder of a file, and the folders that it is in, if they are missing. Throws Error with `path` and the
/// system's reason, also for names that are too long.
void make_folder_of(const std::filesystem::path& path);

/// Throws Error if a file of this name cannot be written, as far as can be tested without writing it.
void check_writable(const std::filesystem::path& path);

/// Writes bytes in memory by write_atomically().
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Reads a whole regular file. Throws Error if it is missing, unreadable, a folder, a device or pipe, or longer than
/// `max_bytes`.
std::string read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

/// Throws the Error of read_file() for a file that is missing, unreadable or not regular.
void check_readable(const std::filesystem::path& path);

/// Returns a file with its present version: zeros for a file that is missing or in a folder that cannot be read.
VersionedFile versioned(const std::filesystem::path& path);

/// Description of a file that tells its content apart from others.
struct FileContent {
    std::uint64_t bytes = 0;
    std::int64_t modified = 0;  // time of the last change, nanoseconds since 1970
    std::uint64_t hash = 0;     // hash of all bytes
};
/// Reads a whole file. Throws the Error of read_file(), and for a file that is changed meanwhile.
FileContent content_of(const std::filesystem::path& path);
/// Returns whether a file still has that content. It is read only if its size is the same, but its time is not.
/// Throws the Error of content_of().
bool has_content(const std::filesystem::path& path, const FileContent& content);

/// Bytes that are read in ranges: those of a regular file, which may be larger than memory, or of a text. Copies share
/// them. A scene may have any number of files.
class ByteSource {
  public:
    ByteSource() = default;  ///< Makes an empty source.
    explicit ByteSource(std::string text);
    /// Throws the Error of check_readable().
    explicit ByteSource(const std::filesystem::path& file);

    std::uint64_t size() const { return size_; }       ///< Returns the number of bytes.
    bool is_file() const { return file_ != nullptr; }  ///< Returns whether the bytes are in a file, not in memory.
    /// Returns the absolute path, without links, that the file had when it was opened. The name may lead to another
    /// file since. Returns "" for a text.
    std::filesystem::path location() const;
    /// Returns the file with its version when this source was made. Precondition: is_file().
    VersionedFile versioned() const;
    /// Returns a part of the source, which must lie within it.
    ByteSource part(std::uint64_t offset, std::uint64_t size) const;
    /// Returns a range of the source, which must lie within it, as a view of the text or of `buffer`. Throws Error that
    /// names the file if it cannot be read or has been written to since this source was made.
    std::string_view read(std::uint64_t offset, std::uint64_t count, std::string& buffer) const;

  private:
    struct File;
    std::shared_ptr<const File> file_;  // null: a text
    std::shared_ptr<const std::string> text_;
    std::uint64_t offset_ = 0;
    std::uint64_t size_ = 0;
};

/// A file for temporary data. It has no name, so nothing is left of it when the process ends.
class ScratchFile {
  public:
    /// Creates the file in a folder. Errors name `subject`, the file that the user requested.
    ScratchFile(const std::filesystem::path& folder, std::string subject);
    ScratchFile(const ScratchFile&) = delete;
    ScratchFile& operator=(const ScratchFile&) = delete;
    ~ScratchFile();

    std::uint64_t size() const { return size_; }  ///< Returns the number of bytes.
    /// Writes bytes to the end. Throws Error if that fails, for example on a full disk.
    void append(std::span<const char> bytes);
    /// Reads bytes [offset, offset + to.size()), which must lie within the file. Thread-safe.
    void read(std::uint64_t offset, std::span<char> to) const;

  private:
    std::string subject_;
    int file_ = -1;
    std::uint64_t size_ = 0;
};

/// A regular file that stays open for reading, also while its name is removed or goes to another file.
class OpenFile {
  public:
    /// Throws the Error of check_readable().
    explicit OpenFile(const std::filesystem::path& path);
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;
    ~OpenFile();

    std::uint64_t size() const;  ///< Returns the number of bytes that the file had when it was opened.
    /// Reads bytes [offset, offset + to.size()), which must lie within the file. Thread-safe.
    void read(std::uint64_t offset, std::span<char> to) const;

  private:
    struct File;
    std::unique_ptr<const File> file_;
};

/// Returns whether these are the first bytes of a Git LFS pointer, which replaces the file in a checkout without LFS.
bool is_lfs_pointer(std::string_view bytes);

/// A buffered file that reports failed writes, including late ones: a full disk often fails only at flush or close.
class CheckedFile {
  public:
    /// Opens an existing file for writing, from its start. Errors name `subject`, the file that the user requested.
    CheckedFile(const std::filesystem::path& existing, std::string subject);
    CheckedFile(const CheckedFile&) = delete;
    CheckedFile& operator=(const CheckedFile&) = delete;
    ~CheckedFile();

    void write(const void* bytes, std::size_t count);
    std::uint64_t tell() const;         ///< Returns the position, bytes from the start.
    void seek(std::uint64_t position);  ///< Sets the position, bytes from the start.
    /// Flushes and closes; throws the error of an earlier write() again, in case its caller has swallowed it.
    void close();

  private:
    void check(bool succeeded);

    std::string subject_;
    std::FILE* file_ = nullptr;
    int error_ = 0;  // errno of the first failure
};

}  // namespace halflight
