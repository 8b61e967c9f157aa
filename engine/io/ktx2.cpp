#include "engine/io/ktx2.h"

#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/io/etc1s.h"
#include "engine/io/uastc.h"

namespace halflight {
namespace {

constexpr std::string_view kIdentifier("\xabKTX 20\xbb\r\n\x1a\n", 12);
constexpr std::size_t kHeaderBytes = 80, kLevelBytes = 24;  // bytes of the header and of an entry of the level index

enum class Supercompression : std::uint32_t { none, basis_lz, zstandard };

/// Texel formats, and colour models of the Khronos Data Format Specification 1.4.
enum class Model : std::uint8_t { uncompressed = 1, etc1s = 163, uastc = 166 };

/// Formats that are refused, by colour model.
constexpr std::pair<unsigned, const char*> kOtherModels[] = {
    {128, "BC1"},  {129, "BC2"},  {130, "BC3"},  {131, "BC4"},   {132, "BC5"},   {133, "BC6H"},     {134, "BC7"},
    {160, "ETC1"}, {161, "ETC2"}, {162, "ASTC"}, {164, "PVRTC"}, {165, "PVRTC"}, {167, "UASTC HDR"}};

/// Names of colour primaries and transfer functions, by their numbers in the Khronos Data Format Specification 1.4. The
/// names are empty if glTF allows them.
constexpr const char* kPrimaries[] = {"",          "",        "BT.601 (EBU)", "BT.601 (SMPTE)",
                                      "BT.2020",   "CIE XYZ", "ACES AP0",     "ACES AP1",
                                      "NTSC 1953", "PAL 525", "Display P3",   "Adobe RGB"};
constexpr const char* kTransfers[] = {"",         "",         "",         "ITU",     "NTSC",      "S-Log",   "S-Log2",
                                      "BT.1886",  "HLG OETF", "HLG EOTF", "PQ EOTF", "PQ OETF",   "DCI-P3",  "PAL OETF",
                                      "PAL EOTF", "ST 240",   "ACEScc",   "ACEScct", "Adobe RGB", "HLG OETF"};

template <std::size_t N>
const char* name_of(const char* const (&names)[N], unsigned number) {
    return number < N ? names[number] : "of an unknown kind";
}

/// Place of the file's channels in RGBA.
enum class Layout : std::uint8_t { rgb, rgba, grey, red_green, red_green_in_alpha };

struct Range {
    std::uint64_t offset = 0, size = 0;  // bytes
};

template <class T>
T number_at(std::string_view bytes, std::size_t offset) {
    T value = 0;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

unsigned byte_at(std::string_view bytes, std::size_t offset) {
    return static_cast<unsigned char>(bytes[offset]);
}

/// The header of a KTX2 file, checked.
class Header {
  public:
    /// bytes: the file or its start
    Header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes, int max_side)
        : subject_(subject), bytes_(bytes), file_bytes_(file_bytes) {
        if (!is_ktx2(bytes) || bytes.size() < kHeaderBytes) fail("is truncated: it has no KTX2 header");
        read_shape();
        read_descriptor(part({word(48), word(52)}, "data format descriptor"));
        read_values(part({word(56), word(60)}, "key/value data"));
        read_level();
        size_.width = word(20), size_.height = word(24);
        check_image_size(subject, size_, file_bytes, max_side);
        if (pixels_.size == 0) fail("is damaged: its first level is empty");
        check(pixels_, "first level");
        if (supercompression_ == Supercompression::none) {
            if (pixels_.size != texel_bytes()) fail("is damaged: its first level has a wrong size");
        } else if (supercompression_ == Supercompression::zstandard) {
            if (inflated_bytes_ != texel_bytes()) fail("is damaged: its first level has a wrong uncompressed size");
            size_.decoding_bytes = texel_bytes();
        } else {
            check(global_, "codebooks");
            size_.decoding_bytes = kCodebooks;
        }
    }

    template <class... Args>
    [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
        throw Error(subject_, "{}", fmt::format(format, std::forward<Args>(args)...));
    }
    const std::string& subject() const { return subject_; }
    const ImageHeader& size() const { return size_; }
    Model model() const { return model_; }
    Layout layout() const { return layout_; }
    bool srgb() const { return size_.srgb.value_or(false); }
    bool inflates() const { return supercompression_ == Supercompression::zstandard; }
    std::size_t levels() const { return std::max(1u, word(40)); }
    /// Returns the bytes of the largest level without supercompression; not for BasisLZ.
    std::size_t texel_bytes() const {
        if (model_ == Model::uncompressed) return size_.width * size_.height * channels_;
        return (size_.width + 3) / 4 * ((size_.height + 3) / 4) * kUastcBlockBytes;
    }
    std::string_view pixels() const { return part(pixels_, "first level"); }
    std::string_view codebooks() const { return part(global_, "codebooks"); }

  private:
    // Upper estimate of the bytes that the codebooks and tables of BasisLZ and two rows of blocks take.
    static constexpr std::size_t kCodebooks = std::size_t{4} << 20;

    std::uint32_t word(std::size_t offset) const { return number_at<std::uint32_t>(bytes_, offset); }

    void check(const Range& range, const char* what) const {
        if (range.offset > file_bytes_ || range.size > file_bytes_ - range.offset)
            fail("is truncated: {} bytes do not hold its {}", file_bytes_, what);
    }
    std::string_view part(const Range& range, const char* what) const {
        check(range, what);
        if (range.offset + range.size > bytes_.size()) fail("has its {} far from its start", what);
        return bytes_.substr(range.offset, range.size);
    }

    void read_shape() {
        if (word(24) == 0) fail("is a one-dimensional texture; glTF needs a 2D texture");
        if (word(28) != 0) fail("is a volume texture; glTF needs a 2D texture");
        if (word(32) != 0) fail("is an array texture; glTF needs a 2D texture");
        if (word(36) != 1) fail("is a cube map; glTF needs a 2D texture");
        if (word(40) > 32) fail("is damaged: it has {} mip levels", word(40));
        if (bytes_.size() < kHeaderBytes + kLevelBytes * levels()) fail("is truncated: its level index is missing");
        if (word(44) > 2) fail("has the supercompression {}; known are none, BasisLZ and Zstandard", word(44));
        supercompression_ = Supercompression{word(44)};
    }

    /// Reads the basic block of the data format descriptor (Khronos Data Format Specification 1.4, chapter 5).
    void read_descriptor(std::string_view descriptor) {
        constexpr std::size_t kTotal = 4, kBlock = 24, kSample = 16;  // bytes
        if (descriptor.size() < kTotal + kBlock) fail("is damaged: it has no data format descriptor");
        const std::string_view block = descriptor.substr(kTotal);
        const std::size_t size = number_at<std::uint16_t>(block, 6);
        if (size < kBlock || size > block.size()) fail("is damaged: its data format descriptor has a wrong size");
        constexpr unsigned kLinear = 1, kSrgb = 2, kPremultiplied = 1;
        const unsigned model = byte_at(block, 8), transfer = byte_at(block, 10);
        if (transfer == kLinear || transfer == kSrgb) size_.srgb = transfer == kSrgb;
        size_.primaries = name_of(kPrimaries, byte_at(block, 9));
        size_.transfer = name_of(kTransfers, transfer);
        if (byte_at(block, 11) & kPremultiplied) fail("has premultiplied alpha, which glTF does not allow");
        const auto* other = std::ranges::find(kOtherModels, model, &std::pair<unsigned, const char*>::first);
        if (other != std::end(kOtherModels)) fail("has texels in {}; glTF allows ETC1S and UASTC", other->second);
        std::vector<unsigned> channels, bits;
        for (std::size_t at = kBlock; at + kSample <= size; at += kSample) {
            channels.push_back(byte_at(block, at + 3) & 15);
            bits.push_back(byte_at(block, at + 2) + 1);
        }
        model_ = Model(model);
        if (model_ == Model::uncompressed)
            read_format(word(12), bits);
        else
            read_channels(channels);
        const bool basis_lz = supercompression_ == Supercompression::basis_lz;
        if ((model_ == Model::etc1s) != basis_lz) fail("has a supercompression that does not fit its texels");
    }

    /// bits: those of each channel, for messages
    void read_format(std::uint32_t format, const std::vector<unsigned>& bits) {
        // VkFormat of R, RG, RGB and RGBA in 8 bits each, linear and sRGB.
        static constexpr std::uint32_t kFormats[][2] = {{9, 15}, {16, 22}, {23, 29}, {37, 43}};
        static constexpr Layout kLayouts[] = {Layout::grey, Layout::red_green, Layout::rgb, Layout::rgba};
        for (std::size_t i = 0; i < 4; ++i) {
            if (kFormats[i][0] != format && kFormats[i][1] != format) continue;
            channels_ = i + 1;
            layout_ = kLayouts[i];
            return;
        }
        fail("has texels of {} bits (VkFormat {}); glTF allows ETC1S and UASTC", fmt::join(bits, " + "), format);
    }

    void read_channels(const std::vector<unsigned>& channels) {
        static const struct {
            Model model;
            std::vector<unsigned> channels;  // channel ids of the samples
            Layout layout;
        } kKinds[] = {{Model::etc1s, {0}, Layout::rgb},      {Model::etc1s, {0, 15}, Layout::rgba},
                      {Model::etc1s, {3}, Layout::grey},     {Model::etc1s, {3, 4}, Layout::red_green},
                      {Model::uastc, {0}, Layout::rgb},      {Model::uastc, {3}, Layout::rgba},
                      {Model::uastc, {4}, Layout::grey},     {Model::uastc, {5}, Layout::red_green_in_alpha},
                      {Model::uastc, {6}, Layout::red_green}};
        for (const auto& kind : kKinds) {
            if (kind.model != model_ || kind.channels != channels) continue;
            layout_ = kind.layout;
            return;
        }
        fail("has an unknown format or combination of channels");
    }

    /// Checks the keys that turn or swizzle the texels.
    void read_values(std::string_view data) const {
        while (data.size() >= 4) {
            const std::size_t size = number_at<std::uint32_t>(data, 0);
            if (size > data.size() - 4) fail("is damaged: its key/value data has a wrong size");
            const std::string_view pair = data.substr(4, size), key = pair.substr(0, pair.find('\0'));
            const std::string_view value = pair.substr(std::min(key.size() + 1, pair.size()));
            const auto expect = [&](std::string_view name, std::string_view wanted) {
                if (key == name && value.substr(0, value.find('\0')) != wanted)
                    fail("has another {} than '{}', which glTF does not allow", name, wanted);
            };
            expect("KTXorientation", "rd");
            expect("KTXswizzle", "rgba");
            data.remove_prefix(std::min(data.size(), 4 + (size + 3) / 4 * 4));
        }
    }

    void read_level() {
        const auto offset_at = [&](std::size_t at) { return number_at<std::uint64_t>(bytes_, at); };
        pixels_ = {offset_at(kHeaderBytes), offset_at(kHeaderBytes + 8)};
        inflated_bytes_ = offset_at(kHeaderBytes + 16);
        global_ = {offset_at(64), offset_at(72)};
    }

    const std::string& subject_;
    std::string_view bytes_;
    std::uint64_t file_bytes_;
    ImageHeader size_;
    Model model_ = Model::uncompressed;
    Supercompression supercompression_ = Supercompression::none;
    Layout layout_ = Layout::rgb;
    std::size_t channels_ = 0;  // bytes of an uncompressed texel
    Range pixels_;              // the largest level
    std::uint64_t inflated_bytes_ = 0;
    Range global_;  // codebooks of BasisLZ
};

/// Moves the channels of a texel to their places in RGBA.
void arrange(std::uint8_t* rgba, Layout layout) {
    if (layout == Layout::red_green_in_alpha) rgba[1] = rgba[3];
    if (layout == Layout::grey) rgba[1] = rgba[2] = rgba[0];
    if (layout == Layout::red_green || layout == Layout::red_green_in_alpha) rgba[2] = 0;
    if (layout != Layout::rgba) rgba[3] = 255;
}

/// "BasisLZ Global Data" of the KTX specification.
void decode_basis_lz(const Header& header, std::uint8_t* rgba) {
    constexpr std::size_t kStart = 20, kImage = 20;  // bytes before the image descriptions, and of one
    const std::string_view global = header.codebooks(), level = header.pixels();
    std::size_t at = kStart + kImage * header.levels();
    if (global.size() < at) header.fail("is damaged: its codebooks are too short");
    const auto take = [&](std::size_t size) {
        if (size > global.size() - at) header.fail("is damaged: its codebooks are too short");
        return global.substr(std::exchange(at, at + size), size);
    };
    const auto word = [&](std::size_t offset) { return number_at<std::uint32_t>(global, offset); };
    Etc1sSource source;
    source.endpoint_count = number_at<std::uint16_t>(global, 0);
    source.selector_count = number_at<std::uint16_t>(global, 2);
    source.endpoints = take(word(4));
    source.selectors = take(word(8));
    source.tables = take(word(12));
    constexpr std::uint32_t kPredicted = 2;
    if (word(kStart) & kPredicted) header.fail("is a frame of a video; glTF needs a 2D texture");
    const auto slice = [&](std::size_t offset) {
        const std::size_t begin = word(kStart + offset), size = word(kStart + offset + 4);
        if (size == 0 || begin > level.size() || size > level.size() - begin)
            header.fail("is damaged: a slice is not within its level");
        return level.substr(begin, size);
    };
    const Etc1sDecoder decoder(source, header.subject());
    const auto [width, height] = std::pair(header.size().width, header.size().height);
    decoder.decode_color(slice(4), width, height, rgba);
    if (header.layout() == Layout::rgba) decoder.decode_channel(slice(12), width, height, 3, rgba);
    if (header.layout() == Layout::red_green) decoder.decode_channel(slice(12), width, height, 1, rgba);
}

void decode_blocks(const Header& header, std::string_view blocks, std::uint8_t* rgba) {
    const auto [width, height] = std::pair(header.size().width, header.size().height);
    const auto* block = reinterpret_cast<const std::uint8_t*>(blocks.data());
    TexelBlock texels;
    for (std::size_t by = 0; by < height; by += 4) {
        for (std::size_t bx = 0; bx < width; bx += 4, block += kUastcBlockBytes) {
            if (!decode_uastc(block, header.srgb(), texels))
                header.fail("cannot be decoded: the block at texel ({}, {}) is invalid", bx, by);
            const std::size_t columns = std::min<std::size_t>(4, width - bx);
            for (std::size_t y = 0; y < 4 && by + y < height; ++y)
                std::copy_n(texels.data() + 16 * y, 4 * columns, rgba + 4 * ((by + y) * width + bx));
        }
    }
}

void expand(std::string_view texels, std::size_t channels, std::uint8_t* rgba) {
    for (std::size_t i = 0; i < texels.size(); ++i)
        rgba[4 * (i / channels) + i % channels] = static_cast<std::uint8_t>(texels[i]);
}

/// Returns the bytes of the largest level, in `buffer` if they are compressed.
std::string_view inflate(const Header& header, std::string& buffer) {
    const std::string_view packed = header.pixels();
    if (!header.inflates()) return packed;
    buffer.resize(header.texel_bytes());
    const std::size_t size = ZSTD_decompress(buffer.data(), buffer.size(), packed.data(), packed.size());
    if (ZSTD_isError(size)) header.fail("cannot be decoded: Zstandard: {}", ZSTD_getErrorName(size));
    if (size != buffer.size()) header.fail("cannot be decoded: its first level is too short");
    return buffer;
}

}  // namespace

bool is_ktx2(std::string_view bytes) {
    return bytes.starts_with(kIdentifier);
}

ImageHeader read_ktx2_header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes,
                             int max_side) {
    return Header(subject, bytes, file_bytes, max_side).size();
}

void read_ktx2(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image) {
    const Header header(subject, bytes, bytes.size(), max_side);
    image.width = static_cast<int>(header.size().width);
    image.height = static_cast<int>(header.size().height);
    std::vector<std::uint8_t> rgba(4 * header.size().width * header.size().height);
    std::string buffer;
    if (header.model() == Model::etc1s)
        decode_basis_lz(header, rgba.data());
    else if (header.model() == Model::uastc)
        decode_blocks(header, inflate(header, buffer), rgba.data());
    else
        expand(inflate(header, buffer), header.texel_bytes() / (rgba.size() / 4), rgba.data());
    for (std::size_t i = 0; i < rgba.size(); i += 4) arrange(rgba.data() + i, header.layout());
    image.rgba = std::move(rgba);
}

}  // namespace halflight
