#include "engine/io/tiff.h"

#include <tiffio.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/memory_ledger.h"
#include "engine/core/one_line.h"

namespace halflight {
namespace {

struct Close {
    void operator()(TIFF* file) const { TIFFClose(file); }
};
using File = std::unique_ptr<TIFF, Close>;

/// A file in memory that libtiff reads or writes, and the last error.
struct Stream {
    std::string bytes;        // written bytes
    std::string_view source;  // bytes to read
    std::size_t at = 0;
    std::string error = "is damaged";
};

tmsize_t read_bytes(thandle_t handle, void* to, tmsize_t count) {
    auto& s = *static_cast<Stream*>(handle);
    const std::string_view from = s.source.empty() ? std::string_view(s.bytes) : s.source;
    const std::size_t left = s.at < from.size() ? from.size() - s.at : 0;
    const std::size_t n = std::min(static_cast<std::size_t>(count), left);
    if (n > 0) std::memcpy(to, from.data() + s.at, n);
    s.at += n;
    return static_cast<tmsize_t>(n);
}

/// Writes bytes. No exception may pass through libtiff.
tmsize_t write_bytes(thandle_t handle, void* from, tmsize_t count) try {
    auto& s = *static_cast<Stream*>(handle);
    const auto n = static_cast<std::size_t>(count);
    if (s.bytes.size() < s.at + n) s.bytes.resize(s.at + n);
    std::memcpy(s.bytes.data() + s.at, from, n);
    s.at += n;
    return count;
} catch (const std::exception&) {
    return -1;
}

toff_t seek(thandle_t handle, toff_t to, int from) {
    auto& s = *static_cast<Stream*>(handle);
    const std::size_t size = s.source.empty() ? s.bytes.size() : s.source.size();
    const std::size_t start = from == SEEK_CUR ? s.at : from == SEEK_END ? size : 0;
    s.at = start + static_cast<std::size_t>(to);
    return s.at;
}

int close_stream(thandle_t) {
    return 0;
}

toff_t size_of(thandle_t handle) {
    const auto& s = *static_cast<Stream*>(handle);
    return s.source.empty() ? s.bytes.size() : s.source.size();
}

int keep_error(TIFF*, void* stream, const char*, const char* format, va_list values) {
    char text[512];
    std::vsnprintf(text, sizeof text, format, values);
    static_cast<Stream*>(stream)->error = one_line(text);
    return 1;
}

int ignore_warning(TIFF*, void*, const char*, const char*, va_list) {
    return 1;
}

File open(Stream& stream, const char* mode) {
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                   TIFFOpenOptionsFree);
    if (!options) throw std::bad_alloc();
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_error, &stream);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_warning, nullptr);
    return File(TIFFClientOpenExt("", mode, &stream, read_bytes, write_bytes, seek, close_stream, size_of, nullptr,
                                  nullptr, options.get()));
}

int bits_of(TiffType type) {
    return type == TiffType::uint8 ? 8 : type == TiffType::uint16 ? 16 : 32;
}

float unit(float value) {
    return std::isnan(value) ? 0.0f : std::clamp(value, 0.0f, 1.0f);
}

/// Converts a row of values to those of the file.
void put_row(const float* values, std::size_t count, TiffType type, std::vector<std::uint8_t>& row) {
    row.resize(count * static_cast<std::size_t>(bits_of(type)) / 8);
    for (std::size_t i = 0; i < count; ++i) {
        if (type == TiffType::uint8) row[i] = static_cast<std::uint8_t>(std::lround(unit(values[i]) * 255.0f));
        if (type == TiffType::uint16) {
            const auto value = static_cast<std::uint16_t>(std::lround(unit(values[i]) * 65535.0f));
            std::memcpy(row.data() + 2 * i, &value, sizeof value);
        }
    }
    if (type == TiffType::float32) std::memcpy(row.data(), values, count * sizeof(float));
}

void get_row(const std::vector<std::uint8_t>& row, std::size_t count, TiffType type, float* values) {
    for (std::size_t i = 0; i < count; ++i) {
        std::uint16_t value = 0;
        if (type == TiffType::uint16) std::memcpy(&value, row.data() + 2 * i, sizeof value);
        if (type == TiffType::uint16) values[i] = static_cast<float>(value) / 65535.0f;
        if (type == TiffType::uint8) values[i] = static_cast<float>(row[i]) / 255.0f;
    }
    if (type == TiffType::float32) std::memcpy(values, row.data(), count * sizeof(float));
}

/// Writes the tags of a colour space unless they cannot hold it. Returns false if the file takes no tags.
bool put_primaries(TIFF* file, const Chromaticities& c) {
    const std::array<float, 2> white{float(c.white.x), float(c.white.y)};
    const std::array<float, 6> colors{float(c.red.x),   float(c.red.y),  float(c.green.x),
                                      float(c.green.y), float(c.blue.x), float(c.blue.y)};
    if (std::ranges::any_of(colors, [](float v) { return v < 0; })) return true;
    return TIFFSetField(file, TIFFTAG_WHITEPOINT, white.data()) == 1 &&
           TIFFSetField(file, TIFFTAG_PRIMARYCHROMATICITIES, colors.data()) == 1;
}

std::optional<Chromaticities> get_primaries(TIFF* file) {
    const float *white = nullptr, *colors = nullptr;
    if (TIFFGetField(file, TIFFTAG_WHITEPOINT, &white) != 1 || !white) return std::nullopt;
    if (TIFFGetField(file, TIFFTAG_PRIMARYCHROMATICITIES, &colors) != 1 || !colors) return std::nullopt;
    return known_chromaticities(
        {{colors[0], colors[1]}, {colors[2], colors[3]}, {colors[4], colors[5]}, {white[0], white[1]}});
}

}  // namespace

std::string encode_tiff(const std::string& subject, const Image& image, TiffType type, const std::string& description,
                        const std::optional<Chromaticities>& primaries, const std::string& profile) {
    if (image.width < 1 || image.height < 1) throw Error(subject, "no pixels to write");
    if (image.channels < 1 || image.channels > 4) throw Error(subject, "cannot have {} channels", image.channels);
    Stream stream;
    const bool alpha = image.channels % 2 == 0, color = image.channels > 2, floats = type == TiffType::float32;
    bool done = false;
    if (const File file = open(stream, "w"); file) {
        TIFF* const f = file.get();
        const auto set = [&](std::uint32_t tag, auto value) { return TIFFSetField(f, tag, value) == 1; };
        done = set(TIFFTAG_IMAGEWIDTH, image.width) && set(TIFFTAG_IMAGELENGTH, image.height) &&
               set(TIFFTAG_SAMPLESPERPIXEL, image.channels) && set(TIFFTAG_BITSPERSAMPLE, bits_of(type)) &&
               set(TIFFTAG_SAMPLEFORMAT, floats ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT) &&
               set(TIFFTAG_PHOTOMETRIC, color ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK) &&
               set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) && set(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) &&
               set(TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE) &&
               set(TIFFTAG_PREDICTOR, floats ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL) &&
               set(TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(f, 0)) && set(TIFFTAG_SOFTWARE, "halflight");
        const std::uint16_t kind = floats ? EXTRASAMPLE_ASSOCALPHA : EXTRASAMPLE_UNASSALPHA;
        if (alpha) done = done && TIFFSetField(f, TIFFTAG_EXTRASAMPLES, 1, &kind) == 1;
        if (!description.empty()) done = done && set(TIFFTAG_IMAGEDESCRIPTION, description.c_str());
        if (primaries) done = done && put_primaries(f, *primaries);
        if (!profile.empty())
            done = done &&
                   TIFFSetField(f, TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(profile.size()), profile.data()) == 1;
        std::vector<std::uint8_t> row;
        const std::size_t count = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels);
        for (int y = 0; done && y < image.height; ++y) {
            put_row(image.at(0, y), count, type, row);
            done = TIFFWriteScanline(f, row.data(), static_cast<std::uint32_t>(y), 0) == 1;
        }
        done = done && TIFFFlush(f) == 1;
    }
    if (!done)
        throw Error(subject, "cannot be written as TIFF of {} x {} pixels: {}", image.width, image.height,
                    stream.error);
    return std::move(stream.bytes);
}

bool is_tiff(std::string_view bytes) {
    using namespace std::literals;
    return bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv);
}

TiffFile read_tiff(const std::string& subject, std::string_view bytes, int max_side) {
    Stream stream;
    stream.source = bytes;
    const File file = open(stream, "rm");
    if (!file) throw Error(subject, "cannot be decoded: {}", stream.error);
    TIFF* const f = file.get();
    std::uint32_t width = 0, height = 0;
    std::uint16_t channels = 1, bits = 1, format = SAMPLEFORMAT_UINT, planes = PLANARCONFIG_CONTIG;
    TIFFGetField(f, TIFFTAG_IMAGEWIDTH, &width), TIFFGetField(f, TIFFTAG_IMAGELENGTH, &height);
    TIFFGetFieldDefaulted(f, TIFFTAG_SAMPLESPERPIXEL, &channels);
    TIFFGetFieldDefaulted(f, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetFieldDefaulted(f, TIFFTAG_SAMPLEFORMAT, &format);
    TIFFGetFieldDefaulted(f, TIFFTAG_PLANARCONFIG, &planes);
    const auto limit = static_cast<std::uint32_t>(max_side);
    if (width < 1 || height < 1) throw Error(subject, "has no pixels");
    if (width > limit || height > limit)
        throw Error(subject, "{} x {} pixels are more than {} a side", width, height, limit);
    TiffFile result;
    const bool floats = format == SAMPLEFORMAT_IEEEFP && bits == 32;
    if (!floats && !(format == SAMPLEFORMAT_UINT && (bits == 8 || bits == 16)))
        throw Error(subject, "has values of {} bits that are neither integers of 8 or 16 bits nor floats", bits);
    if (channels < 1 || channels > 4 || planes != PLANARCONFIG_CONTIG || TIFFIsTiled(f))
        throw Error(subject, "has tiles, planes or {} channels, which are not read", channels);
    const std::uint16_t usual = channels < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB;
    std::uint16_t meaning = usual, orientation = ORIENTATION_TOPLEFT;
    TIFFGetField(f, TIFFTAG_PHOTOMETRIC, &meaning), TIFFGetFieldDefaulted(f, TIFFTAG_ORIENTATION, &orientation);
    if (meaning != usual)
        throw Error(subject, "has {} channels with the photometric interpretation {}, which are not read", channels,
                    meaning);
    if (orientation != ORIENTATION_TOPLEFT)
        throw Error(subject, "has the orientation {}, which is not read", orientation);
    result.type = floats ? TiffType::float32 : bits == 16 ? TiffType::uint16 : TiffType::uint8;
    const std::size_t count = std::size_t{width} * channels;
    if (static_cast<std::size_t>(TIFFScanlineSize(f)) != count * bits / 8)
        throw Error(subject, "has rows of {} bytes instead of {}", TIFFScanlineSize(f), count * bits / 8);
    if (const char* text = nullptr; TIFFGetField(f, TIFFTAG_IMAGEDESCRIPTION, &text) == 1 && text)
        result.description = text;
    result.primaries = get_primaries(f);
    // A Deflate stream is at most 1032 times smaller than its data.
    if (count * height / 1032 > bytes.size())
        throw Error(subject, "is truncated: {} bytes cannot hold {} x {} pixels", bytes.size(), width, height);
    MemoryLedger::process().check(sizeof(float) * count * height, subject, "pixels");
    result.image = Image(static_cast<int>(width), static_cast<int>(height), channels);
    std::vector<std::uint8_t> row(count * bits / 8);
    for (std::uint32_t y = 0; y < height; ++y) {
        if (TIFFReadScanline(f, row.data(), y, 0) != 1) throw Error(subject, "cannot be decoded: {}", stream.error);
        get_row(row, count, result.type, result.image.at(0, static_cast<int>(y)));
    }
    return result;
}

}  // namespace halflight
