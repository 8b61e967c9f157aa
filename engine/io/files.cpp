#include "engine/io/files.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cerrno>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/core/suggestion.h"
#include "engine/io/temporary_name.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) {
    return std::generic_category().message(error);
}

/// Throws DiskError or Error for errno.
[[noreturn]] void fail_to_write(const std::string& subject) {
    throw_write_error(subject, errno);
}

class Descriptor {
  public:
    Descriptor(const fs::path& path, int flags, mode_t mode = 0) : fd_(open(path.c_str(), flags | O_CLOEXEC, mode)) {}
    Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    Descriptor& operator=(Descriptor&&) = delete;
    ~Descriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    operator int() const { return fd_; }

  private:
    int fd_;
};

/// A temporary file that is removed unless kept. Its lock shows other processes that it is being written.
struct Temporary {
    Temporary(fs::path p, Descriptor d) : path(std::move(p)), lock(std::move(d)) {}
    Temporary(Temporary&& other) noexcept : path(std::exchange(other.path, {})), lock(std::move(other.lock)) {}
    Temporary& operator=(Temporary&&) = delete;
    ~Temporary() {
        if (!path.empty()) unlink(path.c_str());
    }
    void keep() { path.clear(); }
    fs::path path;
    Descriptor lock;
};

constexpr std::string_view kTemporary = ".halflight-";  // begin of the names of temporaries

/// Reads bytes [offset, offset + to.size()) of a file.
void read_at(int file, std::uint64_t offset, std::span<char> to, const std::string& subject) {
    for (std::size_t done = 0; done < to.size();) {
        const ssize_t got = pread(file, to.data() + done, to.size() - done, static_cast<off_t>(offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw Error(subject, "cannot read: {}", reason(errno));
        if (got == 0) throw Error(subject, "cannot read: became shorter while it was read");
        done += static_cast<std::size_t>(got);
    }
}

/// Suggests a file of the same folder for a file that does not exist.
std::string similar_name(const fs::path& path) {
    std::vector<std::string> names;
    std::error_code error;
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
        names.push_back(at->path().filename().string());
    return did_you_mean(path.filename().string(), names);
}

using Version = decltype(VersionedFile::version);

Version version_of(const struct stat& info) {
    return {info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size),
            static_cast<std::uint64_t>(info.st_mtim.tv_sec), static_cast<std::uint64_t>(info.st_mtim.tv_nsec)};
}

/// A regular file, opened for reading.
struct ReadableFile {
    // Opens with O_NONBLOCK, which keeps a pipe without a writer from blocking forever. Regular files ignore it.
    explicit ReadableFile(const fs::path& path) : descriptor(path, O_RDONLY | O_NONBLOCK) {
        const std::string subject = path.string();
        if (descriptor < 0) {
            const int why = errno;
            throw Error(subject, "cannot read: {}{}", reason(why), why == ENOENT ? similar_name(path) : "");
        }
        struct stat info {};
        if (fstat(descriptor, &info) != 0) throw Error(subject, "cannot read: {}", reason(errno));
        if (S_ISDIR(info.st_mode)) throw Error(subject, "cannot read: {}", reason(EISDIR));
        if (!S_ISREG(info.st_mode)) throw Error(subject, "cannot read: not a regular file");
        bytes = static_cast<std::uint64_t>(info.st_size);
        version = version_of(info);
    }

    Version version_now() const {
        struct stat info {};
        return fstat(descriptor, &info) == 0 ? version_of(info) : Version{};
    }

    /// Returns the path of the file that is open, whatever its name leads to now; the path of its `name` without /proc.
    fs::path location(const fs::path& name) const {
        std::error_code no_proc;
        const fs::path found = fs::read_symlink(fmt::format("/proc/self/fd/{}", int{descriptor}), no_proc);
        return no_proc ? fs::absolute(name, no_proc) : found;
    }

    /// Returns the time of the last change, in nanoseconds since 1970.
    std::int64_t modified() const { return static_cast<std::int64_t>(version[3] * 1'000'000'000 + version[4]); }

    void read(std::uint64_t offset, std::span<char> to, const std::string& subject) const {
        read_at(descriptor, offset, to, subject);
    }

    Descriptor descriptor;
    std::uint64_t bytes = 0;
    Version version{};  // version_now() when it was opened
};

/// Locks a file that is open for writing, against other processes that lock it. Returns whether the lock was taken. The
/// lock is a byte beyond all data: servers that enforce locks (SMB) let the data be written through other descriptors.
bool take_lock(const Descriptor& file) {
    struct flock range {};
    range.l_type = F_WRLCK;
    range.l_whence = SEEK_SET;
    range.l_start = off_t{1} << 62;
    range.l_len = 1;
    return fcntl(file, F_OFD_SETLK, &range) == 0;
}

/// Creates an empty file of an unused name beside `target`. It keeps the extension, which some writers depend on.
Temporary create_beside(const fs::path& target, const std::string& subject) {
    static std::atomic<unsigned> counter{0};
    std::random_device random;
    for (;;) {
        const fs::path path = target.parent_path() / fmt::format("{}{}-{}-{:08x}{}", temporary_prefix(target), getpid(),
                                                                 counter++, random(), target.extension().string());
        Descriptor file(path, O_CREAT | O_EXCL | O_WRONLY, 0666);
        if (file < 0 && errno != EEXIST) fail_to_write(subject);
        if (file < 0) continue;
        // Before the file is locked, other processes may take it for abandoned and remove it.
        const bool locked =
            take_lock(file) || (errno != EAGAIN && errno != EACCES);  // the file system may have no locks
        struct stat info {};
        if (locked && fstat(file, &info) == 0 && info.st_nlink > 0) return {path, std::move(file)};
    }
}

/// Removes a temporary that no process has locked. Does nothing on file systems without locks.
void remove_unlocked(const fs::path& path) {
    const Descriptor file(path, O_RDWR | O_NONBLOCK | O_NOFOLLOW);
    if (file >= 0 && take_lock(file)) unlink(path.c_str());
}

void sync(const fs::path& path, const std::string& subject) {
    const Descriptor file(path, O_RDONLY);
    if (file < 0 || fsync(file) != 0) fail_to_write(subject);
}

/// Syncs the folder, so that the rename survives a power cut. Errors are ignored, because the file is complete anyway.
void sync_folder(const fs::path& folder) {
    const Descriptor file(folder.empty() ? fs::path(".") : folder, O_RDONLY | O_DIRECTORY);
    if (file >= 0) fsync(file);
}

}  // namespace

fs::path follow_links(const fs::path& path) {
    constexpr int kMaxLinks = 40;  // limit of Linux, path_resolution(7)
    fs::path target = path;
    std::error_code none;
    for (int i = 0; i < kMaxLinks; ++i) {
        if (!fs::is_symlink(target, none)) return target;
        struct statfs system {};
        if (statfs((target.has_parent_path() ? target.parent_path() : ".").c_str(), &system) == 0 &&
            system.f_type == PROC_SUPER_MAGIC)  // a rename would replace the name, not the stream
            throw Error(path.string(), "cannot write: is a stream of a process, and files are replaced as a whole");
        target = target.parent_path() / fs::read_symlink(target, none);
    }
    throw Error(path.string(), "cannot write: {}", reason(ELOOP));
}

void throw_write_error(const std::string& subject, int error, const char* what) {
    const std::string text = fmt::format("cannot write{}: {}", what, reason(error));
    constexpr int kOfDisk[] = {ENOSPC, EDQUOT, EFBIG, EROFS, EIO};
    if (std::ranges::find(kOfDisk, error) != std::end(kOfDisk)) throw DiskError(subject, text);
    throw Error(subject, text);
}

std::string temporary_prefix(const fs::path& target) {
    return fmt::format("{}{:016x}-", kTemporary, hash_of(target.filename().string()));
}

bool is_temporary(const fs::path& file) {
    return file.filename().string().starts_with(kTemporary);
}

void write_atomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
    const std::string subject = path.string();
    if (!path.has_filename()) throw Error(subject.empty() ? "output" : subject, "does not name a file to write");
    const fs::path target = follow_links(path);

    struct stat old {};
    const bool exists = stat(target.c_str(), &old) == 0;
    if (exists && S_ISDIR(old.st_mode)) throw Error(subject, "cannot write: {}", reason(EISDIR));
    if (exists && !S_ISREG(old.st_mode)) throw Error(subject, "cannot write: not a regular file");
    // rename() checks only the folder's permissions, so a read-only file is refused here.
    if (exists && faccessat(AT_FDCWD, target.c_str(), W_OK, AT_EACCESS) != 0) fail_to_write(subject);

    Temporary temporary = create_beside(target, subject);
    write(temporary.path);
    sync(temporary.path, subject);
    if (exists && chmod(temporary.path.c_str(), old.st_mode & 07777) != 0)
        throw Error(subject, "cannot keep permissions: {}", reason(errno));
    if (rename(temporary.path.c_str(), target.c_str()) != 0) fail_to_write(subject);
    temporary.keep();
    sync_folder(target.parent_path());
}

void write_unnamed(const fs::path& path, const std::function<void(const fs::path&)>& write) {
    check_writable(path);
    const fs::path folder = follow_links(path).parent_path();
    const Descriptor file(folder.empty() ? fs::path(".") : folder, O_TMPFILE | O_RDWR, 0666);
    if (file < 0) return write_atomically(path, write);
    take_lock(file);  // once it has a name, other processes must not take it for abandoned
    const fs::path unnamed = fmt::format("/proc/self/fd/{}", int{file});
    write(unnamed);
    // Data are on the disk before the file gets a name, so that `kill -9` has hardly any time to leave a named one.
    if (fsync(file) != 0) fail_to_write(path.string());
    write_atomically(path, [&](const fs::path& temporary) {
        const fs::path linked = temporary.string() + "-linked";  // a link cannot replace a file
        if (linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, linked.c_str(), AT_SYMLINK_FOLLOW) != 0 ||
            rename(linked.c_str(), temporary.c_str()) != 0)
            fail_to_write(path.string());
    });
}

void remove_abandoned(std::span<const fs::path> paths) {
    std::map<fs::path, std::set<std::string>> prefixes;  // prefixes of temporaries by folder
    for (const fs::path& path : paths) {
        try {
            const fs::path target = follow_links(path);
            const fs::path folder = target.parent_path().empty() ? fs::path(".") : target.parent_path();
            prefixes[folder].insert(temporary_prefix(target));
        } catch (const std::exception&) {  // write_atomically() reports a loop of links
        }
    }
    for (const auto& [folder, wanted] : prefixes) {
        const std::size_t length = wanted.begin()->size();
        std::error_code none;
        for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none))
            if (wanted.contains(entry->path().filename().string().substr(0, length))) remove_unlocked(entry->path());
    }
}

void make_folder_of(const fs::path& path) {
    std::error_code error;
    if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
    if (error) throw Error(path.string(), "cannot write: {}", error.message());
    struct stat info {};
    if (lstat(path.c_str(), &info) != 0 && errno == ENAMETOOLONG) fail_to_write(path.string());
}

void check_writable(const fs::path& path) {
    struct WouldWork {};
    try {
        write_atomically(path, [](const auto&) { throw WouldWork{}; });
    } catch (const WouldWork&) {
    }
}

void check_readable(const fs::path& path) {
    const ReadableFile file(path);
}

void write_file(const fs::path& path, std::string_view bytes) {
    write_atomically(path, [&](const fs::path& temporary) {
        CheckedFile file(temporary, path.string());
        file.write(bytes.data(), bytes.size());
        file.close();
    });
}

std::string read_file(const fs::path& path, std::uint64_t max_bytes) {
    const std::string subject = path.string();
    const ReadableFile file(path);
    const std::uint64_t size = file.bytes;
    if (size > max_bytes) throw Error(subject, "has {} bytes, more than the limit of {}", size, max_bytes);
    std::string bytes(size, '\0');
    file.read(0, bytes, subject);
    return bytes;
}

VersionedFile versioned(const fs::path& path) {
    struct stat info {};
    return {path, stat(path.c_str(), &info) == 0 ? version_of(info) : Version{}};
}

static FileContent content_of(const ReadableFile& file, const std::string& subject) {
    constexpr std::uint64_t kPiece = std::uint64_t{4} << 20;  // bytes that a thread reads at once
    std::vector<std::uint64_t> hashes((file.bytes + kPiece - 1) / kPiece);
    tbb::parallel_for(std::size_t{0}, hashes.size(), [&](std::size_t i) {
        thread_local std::string bytes;
        bytes.resize(std::min(kPiece, file.bytes - i * kPiece));
        file.read(i * kPiece, bytes, subject);
        hashes[i] = hash_of(bytes);
    });
    if (file.version_now() != file.version) throw Error(subject, "cannot read: was changed while it was read");
    Hash all;
    for (const std::uint64_t hash : hashes) all.add(hash);
    return {file.bytes, file.modified(), all.value()};
}

FileContent content_of(const fs::path& path) {
    return content_of(ReadableFile(path), path.string());
}

bool has_content(const fs::path& path, const FileContent& content) {
    const ReadableFile file(path);
    if (file.bytes != content.bytes || file.modified() == content.modified) return file.bytes == content.bytes;
    return content_of(file, path.string()).hash == content.hash;
}

/// A file that is opened once, so that it may be replaced by another one of its name; those beyond kKeptOpen are opened
/// for each read.
struct ByteSource::File {
    static constexpr int kKeptOpen = 256;
    static inline std::atomic<int> kept{0};

    explicit File(const fs::path& p)
        : path(p), open(std::in_place, p), location(open->location(p)), version(open->version), size(open->bytes) {
        if (++kept > kKeptOpen) close();
    }
    File(const File&) = delete;
    ~File() { close(); }
    void close() {
        if (open) --kept;
        open.reset();
    }

    fs::path path;
    std::optional<ReadableFile> open;
    fs::path location;
    Version version;
    std::uint64_t size;
};

ByteSource::ByteSource(std::string text)
    : text_(std::make_shared<const std::string>(std::move(text))), size_(text_->size()) {}

ByteSource::ByteSource(const fs::path& path) : file_(std::make_shared<const File>(path)), size_(file_->size) {}

fs::path ByteSource::location() const {
    return file_ ? file_->location : fs::path();
}

VersionedFile ByteSource::versioned() const {
    return {file_->path, file_->version};
}

ByteSource ByteSource::part(std::uint64_t offset, std::uint64_t size) const {
    assert(offset <= size_ && size <= size_ - offset);
    ByteSource part = *this;
    part.offset_ += offset;
    part.size_ = size;
    return part;
}

std::string_view ByteSource::read(std::uint64_t offset, std::uint64_t count, std::string& buffer) const {
    assert(offset <= size_ && count <= size_ - offset);
    if (!file_) return text_ ? std::string_view(*text_).substr(offset_ + offset, count) : std::string_view();
    const std::string subject = file_->path.string();
    std::optional<ReadableFile> again;
    if (!file_->open) again.emplace(file_->path);
    const ReadableFile& file = again ? *again : *file_->open;
    buffer.resize(count);
    file.read(offset_ + offset, buffer, subject);
    if (file.version_now() != file_->version) throw Error(subject, "cannot read: was changed while it was read");
    return buffer;
}

ScratchFile::ScratchFile(const fs::path& folder, std::string subject)
    : subject_(std::move(subject)),
      file_(open(folder.empty() ? "." : folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)) {
    if (file_ >= 0) return;
    std::string name = (folder / ".halflight-scratch-XXXXXX").string();
    file_ = mkostemp(name.data(), O_CLOEXEC);
    if (file_ >= 0 && unlink(name.c_str()) == 0) return;
    const int why = errno;
    if (file_ >= 0) ::close(file_);
    throw_write_error(subject_, why);
}

ScratchFile::~ScratchFile() {
    if (file_ >= 0) ::close(file_);
}

void ScratchFile::append(std::span<const char> bytes) {
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t put = pwrite(file_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(size_));
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) throw_write_error(subject_, errno, " temporary data");
        done += static_cast<std::size_t>(put);
        size_ += static_cast<std::uint64_t>(put);
    }
}

void ScratchFile::read(std::uint64_t offset, std::span<char> to) const {
    read_at(file_, offset, to, subject_);
}

struct OpenFile::File {
    explicit File(const fs::path& p) : subject(p.string()), file(p) {}
    std::string subject;
    ReadableFile file;
};

OpenFile::OpenFile(const fs::path& path) : file_(std::make_unique<const File>(path)) {}
OpenFile::~OpenFile() = default;

std::uint64_t OpenFile::size() const {
    return file_->file.bytes;
}

void OpenFile::read(std::uint64_t offset, std::span<char> to) const {
    read_at(file_->file.descriptor, offset, to, file_->subject);
}

bool is_lfs_pointer(std::string_view bytes) {
    return bytes.starts_with("version https://git-lfs.github.com/spec/");
}

CheckedFile::CheckedFile(const fs::path& existing, std::string subject)
    : subject_(std::move(subject)), file_(std::fopen(existing.c_str(), "r+be")) {
    check(file_ != nullptr);
}

CheckedFile::~CheckedFile() {
    if (file_) std::fclose(file_);
}

void CheckedFile::check(bool succeeded) {
    if (succeeded) return;
    if (error_ == 0) error_ = errno;
    throw_write_error(subject_, error_);
}

void CheckedFile::write(const void* bytes, std::size_t count) {
    // fwrite() takes no null pointer, which empty vectors have.
    check(count == 0 || std::fwrite(bytes, 1, count, file_) == count);
}

std::uint64_t CheckedFile::tell() const {
    return static_cast<std::uint64_t>(ftello(file_));
}

void CheckedFile::seek(std::uint64_t position) {
    check(fseeko(file_, static_cast<off_t>(position), SEEK_SET) == 0);
}

void CheckedFile::close() {
    const int closed = std::fclose(std::exchange(file_, nullptr));
    check(closed == 0 && error_ == 0);
}

}  // namespace halflight
