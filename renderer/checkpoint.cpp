#include "renderer/checkpoint.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "engine/core/hash.h"
#include "engine/core/key_text.h"
#include "engine/core/memory_ledger.h"
#include "engine/gpu/context.h"
#include "engine/io/files.h"
#include "engine/io/temporary_name.h"

namespace halflight {
namespace {

constexpr std::string_view kMagic = "halflight checkpoint 4\n";
constexpr std::string_view kSuffix = ".sums";
constexpr std::uint64_t kMostHeader = 65536;  // bytes

/// The head of a file: a line of JSON after kMagic. The arrays follow, each after its size, and then a hash of all
/// that.
struct Head {
    SavedBand band;
    std::string fingerprint;
};

std::string text_of(const Head& head) {
    const SavedBand& b = head.band;
    const nlohmann::json json = {{"fingerprint", head.fingerprint},
                                 {"y", b.y},
                                 {"rows", b.rows},
                                 {"samples", b.samples},
                                 {"first_half", b.first_half},
                                 {"complete", b.complete},
                                 {"seconds", b.seconds},
                                 {"bad_values", b.bad_values},
                                 {"plan", b.plan}};
    return fmt::format("{}{}\n", kMagic, json.dump());
}

class Reader {
  public:
    /// Reads the head. Throws Error if there is none.
    /// advice: what the user can do about a damaged file.
    Reader(std::filesystem::path file, const char* advice) : path_(std::move(file)), source_(path_), advice_(advice) {
        std::string buffer;
        const std::string_view text = source_.read(0, std::min(kMostHeader, source_.size()), buffer);
        const std::size_t end = text.find('\n', kMagic.size());
        if (!text.starts_with(kMagic) || end == std::string_view::npos) fail();
        try {
            const auto json = nlohmann::json::parse(text.substr(kMagic.size(), end - kMagic.size()));
            SavedBand& b = head.band;
            json.at("fingerprint").get_to(head.fingerprint);
            b.y = whole(json.at("y"), 0), b.rows = whole(json.at("rows"), 1);
            b.samples = whole(json.at("samples"), 1), b.first_half = whole(json.at("first_half"), 0);
            json.at("complete").get_to(b.complete), json.at("seconds").get_to(b.seconds);
            for (const auto& [key, numbers] : {std::pair("bad_values", &b.bad_values), {"plan", &b.plan}})
                for (const auto& count : json.at(key)) {
                    if (!count.is_number_unsigned()) fail();
                    numbers->push_back(count);
                }
            if (b.first_half > b.samples || b.y > std::numeric_limits<int>::max() - b.rows) fail();
        } catch (const nlohmann::json::exception&) {
            fail();
        }
        next(end + 1);
    }
    std::string_view array() {
        const auto size = number();
        MemoryLedger::process().check(std::min(size, source_.size()), path_.string(), "sums");
        return next(size);
    }
    /// Throws Error unless the hash follows, and then the end.
    void check_end() {
        const std::uint64_t hash = hash_.value();
        if (number() != hash || at_ != source_.size()) fail();
    }

    Head head;

  private:
    /// Returns a whole number of the head, which is at least `least`.
    int whole(const nlohmann::json& value, std::int64_t least) const {
        if (!value.is_number_integer()) fail();
        const auto number = value.get<std::int64_t>();
        if (number < least || number > std::numeric_limits<int>::max()) fail();
        return static_cast<int>(number);
    }
    std::uint64_t number() {
        std::uint64_t value = 0;
        std::memcpy(&value, next(sizeof(value)).data(), sizeof(value));
        return value;
    }
    std::string_view next(std::uint64_t size) {
        if (size > source_.size() - at_) fail();
        const std::string_view bytes = source_.read(at_, size, buffer_);
        hash_.add_bytes(bytes.data(), bytes.size());
        at_ += size;
        return bytes;
    }
    [[noreturn]] void fail() const { throw Error(path_.string(), "is no complete checkpoint; {}", advice_); }

    std::filesystem::path path_;
    ByteSource source_;
    const char* advice_;
    std::string buffer_;
    std::uint64_t at_ = 0;
    Hash hash_;
};

/// Locks an open folder. Waits for a process that was killed, whose last writes can take seconds. Returns whether the
/// folder was free in time.
bool lock(int folder, const Stopwatch& watch, double most_seconds) {
    while (flock(folder, LOCK_EX | LOCK_NB) != 0) {
        if (errno != EWOULDBLOCK) return true;  // a file system without locks
        if (watch.seconds() >= most_seconds) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return true;
}

/// Returns whether the open folder still has its name.
bool is_named(int folder, const std::filesystem::path& path) {
    struct stat opened = {}, named = {};
    return fstat(folder, &opened) == 0 && stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
           opened.st_ino == named.st_ino;
}

/// Opens and locks a folder, and makes it if `makes` is set. Returns its descriptor. The process that had the lock
/// before may have removed the folder, which is then made again.
int open_locked(const std::filesystem::path& path, bool makes, double most_seconds) {
    const Stopwatch watch;
    for (;;) {
        std::error_code error;
        if (makes) std::filesystem::create_directories(path, error);
        if (error) throw Error(path.string(), "cannot be made: {}", error.message());
        const int folder = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        if (folder < 0 && makes && errno == ENOENT) continue;
        if (folder < 0) throw Error(path.string(), "cannot be opened: {}", std::strerror(errno));
        const bool free = lock(folder, watch, most_seconds);
        if (free && is_named(folder, path)) return folder;
        close(folder);
        if (!free) throw CheckpointBusy(path.string(), "another process renders this picture");
    }
}

/// Returns the files of bands in a locked folder. Files that another process was writing when it was killed are
/// removed.
std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files, unfinished;
    try {
        for (const auto& entry : std::filesystem::directory_iterator(folder))
            if (entry.is_regular_file() && is_temporary(entry.path()))
                unfinished.push_back(entry.path());
            else if (entry.is_regular_file() && entry.path().extension() == kSuffix)
                files.push_back(entry.path());
    } catch (const std::filesystem::filesystem_error& e) {
        throw Error(folder.string(), "cannot be read: {}", e.code().message());
    }
    std::error_code read_only;
    for (const auto& file : unfinished) std::filesystem::remove(file, read_only);
    return files;
}

/// Returns the samples per pixel of bands, as a mean over `height` rows.
double mean_samples(const std::map<int, SavedBand>& bands, int height) {
    double sum = 0;
    for (const auto& [y, band] : bands) sum += double(band.samples) * std::min(band.rows, height - y);
    return sum / height;
}

}  // namespace

Checkpoint::Checkpoint(std::filesystem::path folder, std::string fingerprint, double interval, Use use, double wait)
    : folder_(std::move(folder)),
      fingerprint_(std::move(fingerprint)),
      interval_(interval),
      use_(use),
      lock_(open_locked(folder_, use != Use::merge, wait)) {
    try {
        if (use_ != Use::merge) check_writable(file_of(0));
        if (use_ == Use::anew)
            for (const auto& file : files_in(folder_)) std::filesystem::remove(file);
        earlier_ = bands();
        for (const auto& [y, band] : earlier_) earlier_seconds_ = std::max(earlier_seconds_, band.seconds);
    } catch (const std::filesystem::filesystem_error& e) {
        close(lock_);
        throw Error(e.path1().string(), "cannot be removed: {}", e.code().message());
    } catch (...) {
        close(lock_);
        throw;
    }
}

Checkpoint::~Checkpoint() {
    // rmdir() fails if the folder is not empty, or a link to one.
    if (use_ != Use::merge && is_named(lock_, folder_)) rmdir(folder_.c_str());
    close(lock_);
}

std::filesystem::path Checkpoint::file_of(int y) const {
    return folder_ / fmt::format("rows-{:05}{}", y, kSuffix);
}

std::map<int, SavedBand> Checkpoint::bands() const {
    std::map<int, SavedBand> bands;
    for (const auto& file : files_in(folder_)) {
        const Reader reader(file, advice());
        if (reader.head.fingerprint != fingerprint_)
            throw Error(folder_.string(), "is of another picture: {} ({})",
                        differences(reader.head.fingerprint, fingerprint_), advice());
        bands[reader.head.band.y] = reader.head.band;
    }
    return bands;
}

const char* Checkpoint::advice() const {
    return use_ == Use::merge ? "render --part with the settings of this merge and --overwrite makes it anew"
                              : "--overwrite begins the picture anew";
}

double Checkpoint::earlier_samples(int height) const {
    return mean_samples(earlier_, height);
}

double Checkpoint::saved_samples(int height) const {
    return mean_samples(bands(), height);
}

bool Checkpoint::complete(int height) const {
    int next = 0;
    for (const auto& [y, band] : bands()) {
        if (y != next || !band.complete) return false;
        next = y + band.rows;
    }
    return next >= height;
}

void Checkpoint::save(SavedBand band, std::size_t arrays, const std::function<Bytes(std::size_t)>& array) {
    band.seconds = earlier_seconds_ + watch_.seconds();
    const std::string text = text_of({band, fingerprint_});
    const std::filesystem::path file = file_of(band.y);
    try {
        write_unnamed(file, [&](const std::filesystem::path& temporary) {
            CheckedFile to(temporary, file.string());
            Hash hash;
            const auto write = [&](const void* bytes, std::size_t count) {
                hash.add_bytes(bytes, count);
                to.write(bytes, count);
            };
            const auto write_number = [&](std::uint64_t value) { write(&value, sizeof(value)); };
            write(text.data(), text.size());
            for (std::size_t i = 0; i < arrays; ++i) {
                const Bytes bytes = array(i);
                write_number(bytes.size());
                write(bytes.data(), bytes.size());
            }
            write_number(hash.value());
            to.close();
        });
        problems_.erase(band.y);
    } catch (const gpu::ContextLost&) {
        throw;  // the file of the last save stays
    } catch (const Error& e) {
        problems_[band.y] = e.what();
    }
    since_save_ = {};
}

std::optional<SavedBand> Checkpoint::load(int y, int rows, const std::function<std::size_t(const SavedBand&)>& arrays,
                                          const std::function<void(std::size_t, Bytes)>& take) const {
    const auto of_rows = std::ranges::find_if(
        earlier_, [&](const auto& e) { return e.first < y + rows && y < e.first + e.second.rows; });
    if (of_rows == earlier_.end()) return std::nullopt;
    if (of_rows->first != y || of_rows->second.rows != rows)
        throw Error(folder_.string(),
                    "was made with bands of {} rows, not {}, by another driver or within other memory; {}",
                    of_rows->second.rows, rows, advice());
    Reader reader(file_of(y), advice());
    const std::size_t count = arrays(reader.head.band);
    for (std::size_t i = 0; i < count; ++i) {
        const std::string_view bytes = reader.array();
        const auto* const from = reinterpret_cast<const std::byte*>(bytes.data());
        take(i, {from, from + bytes.size()});
    }
    reader.check_end();
    return reader.head.band;
}

void Checkpoint::discard(const std::filesystem::path& folder) {
    std::error_code none;
    if (!std::filesystem::is_directory(folder, none)) return;
    try {
        Checkpoint(folder, "", 1, Use::anew, 0);
    } catch (const CheckpointBusy&) {  // the other process needs the folder
    }
}

void Checkpoint::remove() {
    earlier_.clear();
    if (!is_named(lock_, folder_)) return;  // somebody has removed the folder, and another process may have a new one
    std::error_code error;
    for (const auto& file : files_in(folder_)) std::filesystem::remove(file, error);
}

}  // namespace halflight
