#include "engine/io/radiance.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "engine/core/error.h"

namespace halflight {
namespace {

using Rgbe = std::array<std::uint8_t, 4>;

class Reader {
  public:
    Reader(const std::string& subject, std::string_view bytes) : subject_(subject), bytes_(bytes) {}

    std::uint8_t byte() {
        if (position_ >= bytes_.size()) throw Error(subject_, "is truncated");
        return static_cast<std::uint8_t>(bytes_[position_++]);
    }

    std::string_view line() {
        const std::size_t end = bytes_.find('\n', position_);
        if (end == std::string_view::npos) throw Error(subject_, "is truncated: its header does not end");
        std::string_view text = bytes_.substr(position_, end - position_);
        position_ = end + 1;
        if (text.ends_with('\r')) text.remove_suffix(1);
        return text;
    }

    std::size_t left() const { return bytes_.size() - position_; }

    Rgbe pixel() { return {byte(), byte(), byte(), byte()}; }

    [[noreturn]] void damaged(std::string_view what) const { throw Error(subject_, "is damaged: {}", what); }

  private:
    const std::string& subject_;
    std::string_view bytes_;
    std::size_t position_ = 0;
};

struct Resolution {
    int width = 0, height = 0;
    bool bottom_up = false, right_to_left = false;
};

/// Parses a line like "-Y 512 +X 1024": rows from the top, columns from the left.
Resolution parse_resolution(const std::string& subject, std::string_view text, int max_side) {
    Resolution result;
    const auto take = [&](char axis, bool& positive) {
        int value = 0;
        const bool fits = text.size() > 3 && (text[0] == '+' || text[0] == '-') && text[1] == axis && text[2] == ' ';
        if (!fits) throw Error(subject, "has an unsupported order of pixels");
        positive = text[0] == '+';
        const auto [end, error] = std::from_chars(text.data() + 3, text.data() + text.size(), value);
        if (error != std::errc() || value < 1) throw Error(subject, "is damaged: bad resolution");
        if (value > max_side)
            throw Error(subject, "has a side of {} pixels, more than the limit of {}", value, max_side);
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
        if (text.starts_with(' ')) text.remove_prefix(1);
        return value;
    };
    bool left_to_right = true;
    result.height = take('Y', result.bottom_up);
    result.width = take('X', left_to_right);
    result.right_to_left = !left_to_right;
    return result;
}

/// Reads new run lengths: the four components one after another. A count above 128 repeats a value, others are literal.
void read_components(Reader& reader, std::vector<Rgbe>& row) {
    for (std::size_t component = 0; component < 4; ++component) {
        for (std::size_t x = 0; x < row.size();) {
            std::size_t count = reader.byte();
            const bool run = count > 128;
            if (run) count -= 128;
            if (count == 0 || count > row.size() - x) reader.damaged("bad run length");
            const std::uint8_t value = run ? reader.byte() : std::uint8_t{0};
            for (; count > 0; --count) row[x++][component] = run ? value : reader.byte();
        }
    }
}

/// Reads flat pixels. A pixel (1, 1, 1, n) repeats the last one n times; further ones are higher digits of n.
void read_pixels(Reader& reader, const Rgbe& first, std::vector<Rgbe>& row) {
    Rgbe pixel = first;
    int shift = 0;
    for (std::size_t x = 0; x < row.size();) {
        if (pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1) {
            if (x == 0 || shift > 16) reader.damaged("bad run length");
            const std::size_t count = std::size_t{pixel[3]} << shift;
            if (count > row.size() - x) reader.damaged("bad run length");
            for (std::size_t i = 0; i < count; ++i, ++x) row[x] = row[x - 1];
            shift += 8;
        } else {
            row[x++] = pixel;
            shift = 0;
        }
        if (x < row.size()) pixel = reader.pixel();
    }
}

void read_row(Reader& reader, std::vector<Rgbe>& row) {
    constexpr std::size_t kShortest = 8, kLongest = 0x7fff;  // texels of rows with new run lengths
    const Rgbe start = reader.pixel();
    if (row.size() < kShortest || row.size() > kLongest || start[0] != 2 || start[1] != 2 || start[2] > 127)
        return read_pixels(reader, start, row);
    if ((std::size_t{start[2]} << 8 | start[3]) != row.size()) reader.damaged("bad row length");
    read_components(reader, row);
}

}  // namespace

bool is_radiance(std::string_view bytes) {
    return bytes.starts_with("#?");
}

RadiancePicture read_radiance(const std::string& subject, std::string_view bytes, const ExrLimits& limits) {
    Reader reader(subject, bytes);
    if (!is_radiance(reader.line())) throw Error(subject, "is not a Radiance picture");
    RadiancePicture picture;
    for (std::string_view line = reader.line(); !line.empty(); line = reader.line()) {
        if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe")
            throw Error(subject, "{} is not supported", line);
        if (line.starts_with("EXPOSURE="))
            picture.exposure *= std::strtod(std::string(line.substr(9)).c_str(), nullptr);
    }
    const Resolution resolution = parse_resolution(subject, reader.line(), limits.max_side);
    const auto width = static_cast<std::size_t>(resolution.width);
    const auto height = static_cast<std::size_t>(resolution.height);
    if (reader.left() < sizeof(Rgbe) * height) throw Error(subject, "is truncated");  // a row has one pixel at least
    const std::uint64_t size = 3 * sizeof(float) * width * height;
    if (size > limits.max_bytes)
        throw Error(subject, "has {} bytes of pixels, more than the limit of {}{}", size, limits.max_bytes,
                    limits.reason);

    std::vector<Rgbe> rows;  // grows with the rows read, not with the header's size
    std::vector<Rgbe> row(width);
    for (std::size_t y = 0; y < height; ++y) {
        read_row(reader, row);
        rows.insert(rows.end(), row.begin(), row.end());
    }

    std::array<float, 256> scale{};  // value of a mantissa step, by exponent; exponent 0 is black
    for (int e = 1; e < 256; ++e) scale[static_cast<std::size_t>(e)] = std::ldexp(1.0f, e - 128 - 8);
    picture.image = Image(resolution.width, resolution.height, 3);
    for (std::size_t y = 0; y < height; ++y) {
        const std::size_t source = resolution.bottom_up ? height - 1 - y : y;
        for (std::size_t x = 0; x < width; ++x) {
            const Rgbe& p = rows[source * width + (resolution.right_to_left ? width - 1 - x : x)];
            for (std::size_t c = 0; c < 3; ++c)
                picture.image.pixels[(y * width + x) * 3 + c] = static_cast<float>(p[c]) * scale[p[3]];
        }
    }
    return picture;
}

}  // namespace halflight
