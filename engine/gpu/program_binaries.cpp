#include "engine/gpu/program_binaries.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include "engine/core/cache_folder.h"
#include "engine/core/hash.h"

namespace halflight::gpu {
namespace {

namespace fs = std::filesystem;

/// Start of each file, before the key and the bytes.
struct Header {
    char magic[8];
    std::uint64_t key_bytes;
    std::uint64_t binary_bytes;
    std::uint64_t format;
    std::uint64_t checksum;  // checksum of bytes and format
};
constexpr std::string_view kExtension = ".program";
constexpr char kMagic[8] = {'h', 'l', 'p', 'r', 'o', 'g', '0', '1'};

/// Returns the content of a file; nothing if it is not regular or is longer than `max_bytes`.
std::optional<std::string> content_of(const fs::path& file, std::uint64_t max_bytes) {
    std::error_code error;
    if (!fs::is_regular_file(file, error) || fs::file_size(file, error) > max_bytes || error) return std::nullopt;
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return std::nullopt;
    std::string content(std::istreambuf_iterator<char>(stream), {});
    return stream.bad() ? std::nullopt : std::optional(std::move(content));
}

/// Returns a name that no other process or thread uses.
fs::path temporary_name(const fs::path& file) {
    static std::atomic<unsigned> count{0};
    return fs::path(file) += fmt::format(".{}.{}.tmp", ::getpid(), ++count);
}

}  // namespace

ProgramBinaries::ProgramBinaries(fs::path folder, std::string driver, std::uint64_t max_bytes)
    : folder_(std::move(folder)), driver_(std::move(driver)), max_bytes_(max_bytes) {}

std::string ProgramBinaries::full_key(std::string_view key) const {
    return fmt::format("{}\n{}", driver_, key);
}

fs::path ProgramBinaries::file(std::string_view key) const {
    return folder_ / fmt::format("{:016x}{}", hash_of(full_key(key)), kExtension);
}

std::optional<ProgramBinary> ProgramBinaries::load(std::string_view key) const {
    const fs::path path = file(key);
    const std::optional<std::string> content = content_of(path, max_bytes_);
    Header header;
    if (!content || content->size() < sizeof header) return std::nullopt;
    std::memcpy(&header, content->data(), sizeof header);
    const std::string wanted = full_key(key);
    if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0 || header.key_bytes != wanted.size()) return std::nullopt;
    if (content->size() - sizeof header < wanted.size()) return std::nullopt;
    const std::string_view rest = std::string_view(*content).substr(sizeof header);
    const std::string_view bytes = rest.substr(wanted.size());
    if (rest.substr(0, wanted.size()) != wanted || bytes.size() != header.binary_bytes ||
        (hash_of(bytes) ^ header.format) != header.checksum) {
        return std::nullopt;
    }
    std::error_code ignored;  // the folder may be read-only
    fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);
    return ProgramBinary{static_cast<std::uint32_t>(header.format), {bytes.begin(), bytes.end()}};
}

void ProgramBinaries::store(std::string_view key, const ProgramBinary& binary) const {
    const std::string full = full_key(key);
    Header header{};
    std::memcpy(header.magic, kMagic, sizeof kMagic);
    header.key_bytes = full.size();
    header.binary_bytes = binary.bytes.size();
    header.format = binary.format;
    header.checksum = hash_of({binary.bytes.data(), binary.bytes.size()}) ^ header.format;
    if (sizeof header + full.size() + binary.bytes.size() > max_bytes_) return;

    std::error_code error;
    fs::create_directories(folder_, error);
    const fs::path path = file(key);
    const fs::path temporary = temporary_name(path);
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(reinterpret_cast<const char*>(&header), sizeof header);
    stream.write(full.data(), static_cast<std::streamsize>(full.size()));
    stream.write(binary.bytes.data(), static_cast<std::streamsize>(binary.bytes.size()));
    stream.close();
    if (stream) fs::rename(temporary, path, error);
    if (!stream || error) fs::remove(temporary, error);
    trim_cache(folder_, kExtension, max_bytes_);
}

fs::path default_binaries_folder() {
    return cache_folder("programs");
}

}  // namespace halflight::gpu
