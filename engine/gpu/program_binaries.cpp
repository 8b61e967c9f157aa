#include "engine/gpu/program_binaries.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <utility>

#include "engine/core/cache_folder.h"
#include "engine/core/hash.h"

namespace halflight::gpu {
namespace {

namespace fs = std::filesystem;

/// Start of each file, before the driver, the key and the bytes.
struct Header {
    char magic[8];
    std::uint64_t binary_bytes;
    std::uint64_t format;
    std::uint64_t checksum;  // checksum of bytes and format
};
constexpr std::string_view kExtension = ".program";
constexpr char kMagic[8] = {'h', 'l', 'p', 'r', 'o', 'g', '0', '2'};

/// A file of the folder. Symbolic links are not followed, as they would lead to files of others.
class CacheFile {
  public:
    CacheFile(const fs::path& path, int flags) : file_(open(path.c_str(), flags | O_NOFOLLOW | O_CLOEXEC, 0666)) {}
    CacheFile(const CacheFile&) = delete;
    CacheFile& operator=(const CacheFile&) = delete;
    ~CacheFile() { close(); }

    /// Returns the content; nothing if the file is not regular or is longer than `max_bytes`.
    std::optional<std::string> read(std::uint64_t max_bytes) const {
        struct stat info {};
        if (file_ < 0 || fstat(file_, &info) != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
        const auto size = static_cast<std::uint64_t>(info.st_size);
        if (size > max_bytes) return std::nullopt;
        std::string content(size, '\0');
        for (std::size_t done = 0; done < size;) {
            const ssize_t got = ::read(file_, content.data() + done, size - done);
            if (got < 0 && errno == EINTR) continue;
            if (got <= 0) return std::nullopt;
            done += static_cast<std::size_t>(got);
        }
        return content;
    }

    /// Appends bytes; returns whether they were written.
    bool write(std::string_view bytes) const {
        while (file_ >= 0 && !bytes.empty()) {
            const ssize_t put = ::write(file_, bytes.data(), bytes.size());
            if (put < 0 && errno == EINTR) continue;
            if (put < 0) return false;
            bytes.remove_prefix(static_cast<std::size_t>(put));
        }
        return file_ >= 0;
    }

    /// Gives a file without a name a name, in place of an older file. Returns whether it has the name.
    bool name(const fs::path& path) const {
        const std::string unnamed = fmt::format("/proc/self/fd/{}", file_);
        const auto link = [&] { return linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW); };
        return link() == 0 || (errno == EEXIST && unlink(path.c_str()) == 0 && link() == 0);
    }

    /// Sets the time of the last use to now. A failure has no effect; the folder may be read-only.
    void touch() const { static_cast<void>(futimens(file_, nullptr)); }

    bool is_open() const { return file_ >= 0; }
    bool close() { return file_ >= 0 && ::close(std::exchange(file_, -1)) == 0; }

  private:
    int file_;
};

/// Returns a name that no other process or thread uses.
fs::path temporary_name(const fs::path& file) {
    static std::atomic<unsigned> count{0};
    return fs::path(file) += fmt::format(".{}.{}.tmp", ::getpid(), ++count);
}

}  // namespace

ProgramBinaries::ProgramBinaries(fs::path folder, std::string driver, std::uint64_t max_bytes)
    : folder_(std::move(folder)), driver_(std::move(driver) + '\n'), max_bytes_(max_bytes) {}

fs::path ProgramBinaries::file(std::string_view key) const {
    Hash hash;
    for (const std::string_view part : {std::string_view(driver_), key}) hash.add_bytes(part.data(), part.size());
    return folder_ / fmt::format("{:016x}{}", hash.value(), kExtension);
}

bool ProgramBinaries::has(std::string_view key) const {
    std::error_code none;
    return fs::exists(file(key), none);
}

std::optional<ProgramBinary> ProgramBinaries::load(std::string_view key) const {
    std::optional<ProgramBinary> found = read(key);
    if (!found) ++misses_;
    return found;
}

std::optional<ProgramBinary> ProgramBinaries::read(std::string_view key) const {
    const CacheFile file_of_key(file(key), O_RDONLY | O_NONBLOCK);  // a pipe without a writer would block
    const std::optional<std::string> content = file_of_key.read(max_bytes_);
    Header header;
    if (!content || content->size() < sizeof header) return std::nullopt;
    std::memcpy(&header, content->data(), sizeof header);
    if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0) return std::nullopt;
    std::string_view bytes = std::string_view(*content).substr(sizeof header);
    for (const std::string_view part : {std::string_view(driver_), key}) {
        if (!bytes.starts_with(part)) return std::nullopt;
        bytes.remove_prefix(part.size());
    }
    if (bytes.size() != header.binary_bytes || (hash_of(bytes) ^ header.format) != header.checksum) return std::nullopt;
    file_of_key.touch();
    return ProgramBinary{static_cast<std::uint32_t>(header.format), {bytes.begin(), bytes.end()}};
}

void ProgramBinaries::store(std::string_view key, const ProgramBinary& binary) const {
    Header header{};
    std::memcpy(header.magic, kMagic, sizeof kMagic);
    header.binary_bytes = binary.bytes.size();
    header.format = binary.format;
    header.checksum = hash_of({binary.bytes.data(), binary.bytes.size()}) ^ header.format;
    if (sizeof header + driver_.size() + key.size() + binary.bytes.size() > max_bytes_) return;

    std::error_code error;
    fs::create_directories(folder_, error);
    const fs::path path = file(key);
    const auto write_to = [&](const CacheFile& to) {
        return to.write({reinterpret_cast<const char*>(&header), sizeof header}) && to.write(driver_) &&
               to.write(key) && to.write({binary.bytes.data(), binary.bytes.size()});
    };
    // A killed process leaves nothing of a file without a name. Some file systems have no such files.
    if (const CacheFile unnamed(folder_ / ".", O_TMPFILE | O_WRONLY); unnamed.is_open()) {
        if (write_to(unnamed)) static_cast<void>(unnamed.name(path));
    } else {
        const fs::path temporary = temporary_name(path);
        CacheFile named(temporary, O_WRONLY | O_CREAT | O_EXCL);
        const bool written = write_to(named);
        if (named.close() && written) fs::rename(temporary, path, error);
        if (!written || error) fs::remove(temporary, error);
    }
    trim_cache(folder_, kExtension, max_bytes_);
}

fs::path default_binaries_folder() {
    return cache_folder("programs");
}

}  // namespace halflight::gpu
