#include "engine/io/file_kind.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <string>

#include "engine/core/error.h"

namespace halflight {
namespace {

using namespace std::literals;

constexpr struct {
    std::string_view start, kind;
} kKinds[] = {
    {"BLENDER"sv, "a Blender file"},
    {"\x28\xb5\x2f\xfd"sv, "a Zstandard file, such as a compressed Blender file"},
    {"\x1f\x8b"sv, "a gzip file, such as a compressed Blender file"},
    {"Kaydara FBX Binary"sv, "an FBX file"},
    {"; FBX"sv, "an FBX file"},
    {"#usda"sv, "a USD file"},
    {"PXR-USDC"sv, "a USD file"},
    {"Ogawa"sv, "an Alembic file"},
    {"\x89HDF"sv, "an HDF5 file, such as Alembic"},
    {"ply\n"sv, "a PLY file"},
    {"ply\r"sv, "a PLY file"},
    {"//Maya"sv, "a Maya file"},
    {"DRACO"sv, "a Draco file"},
    {"PK\3\4"sv, "a ZIP archive, such as USDZ"},
    {"7z\xbc\xaf\x27\x1c"sv, "a 7z archive"},
    {"Rar!"sv, "a RAR archive"},
    {"\x89HLP\r\n"sv, kPageFileKind},
    {"\x89PNG"sv, "a PNG picture"},
    {"\xff\xd8\xff"sv, "a JPEG picture"},
    {"GIF8"sv, "a GIF picture"},
    {"BM"sv, "a BMP picture"},
    {"DDS "sv, "a DDS texture"},
    {"II*\0"sv, "a TIFF picture"},
    {"MM\0*"sv, "a TIFF picture"},
    {"8BPS"sv, "a Photoshop file"},
    {"\x76\x2f\x31\x01"sv, "an OpenEXR picture"},
    {"#?RADIANCE"sv, "a Radiance picture"},
    {"\xabKTX 11"sv, "a KTX file of version 1"},
    {"\xabKTX 20"sv, "a KTX2 texture"},
};

/// Returns whether the text has statements of Wavefront OBJ, perhaps after comments.
bool is_obj(std::string_view text) {
    while (!text.empty()) {
        const std::string_view line = text.substr(0, text.find_first_of("\r\n"));
        for (const std::string_view word : {"mtllib ", "v ", "vn ", "vt ", "o ", "g ", "usemtl "})
            if (line.starts_with(word)) return true;
        if (!line.empty() && !line.starts_with('#')) return false;
        text.remove_prefix(std::min(line.size() + 1, text.size()));
    }
    return false;
}

/// Returns whether the size is that of a binary STL: a header of 80 bytes, a count, and 50 bytes per triangle.
bool is_binary_stl(std::string_view start, std::uint64_t file_bytes) {
    if (start.size() < 84) return false;
    std::uint32_t triangles = 0;
    std::memcpy(&triangles, start.data() + 80, sizeof triangles);
    return file_bytes == 84 + std::uint64_t{50} * triangles;
}

}  // namespace

std::string_view kind_of_file(std::string_view start, std::uint64_t file_bytes) {
    for (const auto& [first, kind] : kKinds)
        if (start.starts_with(first)) return kind;
    if (start.starts_with("RIFF") && start.size() >= 12 && start.substr(8, 4) == "WEBP") return "a WebP picture";
    if (start.size() >= 12 && start.substr(4, 8) == "ftypavif") return "an AVIF picture";
    if (start.find("<COLLADA") != std::string_view::npos) return "a Collada file";
    if (start.starts_with("<!DOCTYPE html") || start.starts_with("<html")) return "a web page";
    if (start.starts_with("solid") || is_binary_stl(start, file_bytes)) return "an STL file";
    if (is_obj(start)) return "a Wavefront OBJ file";
    return "";
}

void check_takes_text(const std::filesystem::path& path) {
    std::error_code none;
    if (!std::filesystem::is_regular_file(path, none)) return;
    std::string start(std::size_t{64} << 10, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(start.data(), static_cast<std::streamsize>(start.size()));
    start.resize(static_cast<std::size_t>(file.gcount()));
    const bool scene = path.extension() == ".gltf" || start.starts_with("glTF");
    if (start.empty() || (!scene && start.find('\0') == std::string::npos)) return;
    const std::string_view kind = scene ? "a glTF scene" : kind_of_file(start, std::filesystem::file_size(path, none));
    throw Error(path.string(), "exists and is {}, so it is kept and not replaced by a text",
                kind.empty() ? "no text" : kind);
}

}  // namespace halflight
