#include <cstring>
#include <string>

#include "engine/io/image_header.h"
#include "engine/io/ktx2.h"
#include "engine/io/webp.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

using ReadHeader = ImageHeader(const std::string&, std::string_view, std::uint64_t, int);
using Read = void(const std::string&, std::string_view, int, TextureImage&);

/// Decodes an image. The texels must have the size of the header, which must be read from what decodes.
void decode(std::string_view input, ReadHeader& read_header, Read& read) {
    constexpr int kMaxSide = 1024;  // small files can hold large pictures
    TextureImage image;
    try {
        read("input", input, kMaxSide, image);
    } catch (const Error& error) {
        check_message(error, "input: ");
        return;
    }
    const ImageHeader header = read_header("input", input, input.size(), kMaxSide);
    if (header.width != static_cast<std::size_t>(image.width) ||
        header.height != static_cast<std::size_t>(image.height))
        throw Broken("the header has another size than the image");
    if (image.rgba.size() != 4 * header.width * header.height) throw Broken("texels are missing");
}

/// Returns a KTX2 file with another colour model and supercompression, if its header and descriptor are complete.
template <class F>
std::string with_texels(std::string_view input, int model, F supercompression_from) {
    constexpr std::size_t kSupercompression = 44, kDescriptor = 48, kModel = 12;  // offset of the bytes
    std::string file(input);
    std::uint32_t descriptor = 0;
    if (file.size() < kDescriptor + sizeof descriptor) return file;
    std::memcpy(&descriptor, file.data() + kDescriptor, sizeof descriptor);
    if (descriptor + kModel >= file.size()) return file;
    file[kSupercompression] = static_cast<char>(supercompression_from(file[kSupercompression]));
    file[descriptor + kModel] = static_cast<char>(model);
    return file;
}

}  // namespace

void webp(std::string_view input) {
    decode(input, read_webp_header, read_webp);
}

void ktx2(std::string_view input) {
    decode(input, read_ktx2_header, read_ktx2);
}

void etc1s(std::string_view input) {
    ktx2(with_texels(input, 163, [](char) { return 1; }));
}

void uastc(std::string_view input) {
    ktx2(with_texels(input, 166, [](char supercompression) { return supercompression & 2; }));
}

}  // namespace halflight::fuzz
