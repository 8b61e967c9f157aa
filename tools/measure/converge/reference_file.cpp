#include "tools/measure/converge/reference_file.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <limits>

#include "engine/core/cache_folder.h"
#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/io/files.h"

namespace halflight::converge {
namespace {

/// Header of a file; the sums of both halves by component and a hash of everything follow.
struct Header {
    char magic[8];
    std::uint64_t fingerprint;
    std::int64_t samples[2];
    std::int32_t width;
    std::int32_t height;
};
static_assert(sizeof(Header) == 40 && std::endian::native == std::endian::little);

constexpr char kMagic[] = {'H', 'L', 'R', 'E', 'F', '0', '0', '1'};

void make_folders(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw Error(folder.string(), "cannot be made: {}", error.message());
}

}  // namespace

std::filesystem::path default_reference_folder() {
    std::filesystem::path folder = cache_folder("references");
    if (folder.empty())
        throw Error("reference", "no place to keep it: neither XDG_CACHE_HOME nor HOME is set to an absolute path");
    return folder;
}

std::filesystem::path reference_path(const std::filesystem::path& folder, std::uint64_t fingerprint) {
    return folder / fmt::format("{:016x}.reference", fingerprint);
}

void prepare_to_save(const std::filesystem::path& path) {
    make_folders(path.parent_path());
    check_writable(path);
}

void save_halves(const std::filesystem::path& path, std::uint64_t fingerprint, const Halves& halves) {
    make_folders(path.parent_path());
    Header header{{}, fingerprint, {halves[0].samples, halves[1].samples}, halves[0].width, halves[0].height};
    std::memcpy(header.magic, kMagic, sizeof(kMagic));
    std::string bytes(reinterpret_cast<const char*>(&header), sizeof(header));
    for (const PictureSums& half : halves)
        for (const std::vector<double>& plane : half.sums)
            bytes.append(reinterpret_cast<const char*>(plane.data()), plane.size() * sizeof(double));
    const std::uint64_t hash = hash_of(bytes);
    bytes.append(reinterpret_cast<const char*>(&hash), sizeof(hash));
    write_file(path, bytes);
}

std::optional<Halves> load_halves(const std::filesystem::path& path, std::uint64_t fingerprint, int width, int height) {
    std::error_code not_seen;
    if (!std::filesystem::exists(path, not_seen)) return std::nullopt;
    const std::string bytes = read_file(path, std::numeric_limits<std::uint64_t>::max());
    const auto damaged = [&] { return Error(path.string(), "the reference is damaged"); };
    Header header;
    std::uint64_t hash = 0;
    if (bytes.size() < sizeof(header) + sizeof(hash)) throw damaged();
    std::memcpy(&header, bytes.data(), sizeof(header));
    const std::string_view content(bytes.data(), bytes.size() - sizeof(hash));
    std::memcpy(&hash, content.data() + content.size(), sizeof(hash));
    if (hash != hash_of(content) || std::memcmp(header.magic, kMagic, sizeof(kMagic)) != 0 ||
        header.fingerprint != fingerprint || header.width != width || header.height != height)
        throw damaged();
    const std::size_t values = std::size_t{3} * kComponents.size() * static_cast<std::size_t>(width) *
                               static_cast<std::size_t>(height);  // values of one half
    if (content.size() != sizeof(header) + 2 * values * sizeof(double)) throw damaged();
    constexpr std::int64_t kMost =
        std::numeric_limits<std::int64_t>::max() / 2;  // the sum of both halves does not overflow
    for (const std::int64_t samples : header.samples)
        if (samples < 0 || samples > kMost) throw damaged();
    Halves halves{PictureSums(width, height), PictureSums(width, height)};
    const char* at = bytes.data() + sizeof(header);
    for (std::size_t h = 0; h < halves.size(); ++h) {
        halves[h].samples = header.samples[h];
        for (std::vector<double>& plane : halves[h].sums) {
            std::memcpy(plane.data(), at, plane.size() * sizeof(double));
            at += plane.size() * sizeof(double);
        }
    }
    return halves;
}

}  // namespace halflight::converge
