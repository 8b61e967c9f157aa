#include "engine/io/radiance.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/math.h"

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
    int lines = 0, length = 0;  // number of scan lines, and of the pixels of each
    bool columns = false;       // scan lines are columns
    bool bottom_up = false, right_to_left = false;
};

/// Parses a line like "-Y 512 +X 1024": scan lines are rows from the top, their pixels go from left to right.
Resolution parse_resolution(const std::string& subject, std::string_view text, int max_side) {
    Resolution result;
    const auto take = [&](char axis) {
        int value = 0;
        const bool fits = text.size() > 3 && (text[0] == '+' || text[0] == '-') && text[1] == axis && text[2] == ' ';
        if (!fits) throw Error(subject, "has an unsupported order of pixels");
        (axis == 'Y' ? result.bottom_up : result.right_to_left) = (text[0] == '+') == (axis == 'Y');
        const auto [end, error] = std::from_chars(text.data() + 3, text.data() + text.size(), value);
        if (error != std::errc() || value < 1) throw Error(subject, "is damaged: bad resolution");
        if (value > max_side)
            throw Error(subject, "has a side of {} pixels, more than the limit of {}", value, max_side);
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
        if (text.starts_with(' ')) text.remove_prefix(1);
        return value;
    };
    result.columns = text.size() > 1 && text[1] == 'X';
    result.lines = take(result.columns ? 'X' : 'Y');
    result.length = take(result.columns ? 'Y' : 'X');
    return result;
}

/// Returns the `count` numbers of a text, in the format of C in every locale; nothing if there are more or fewer.
std::optional<std::vector<double>> numbers_of(std::string_view text, std::size_t count) {
    std::vector<double> numbers;
    constexpr std::string_view kBlanks = " \t";
    for (std::size_t start = 0; (start = text.find_first_not_of(kBlanks, start)) != std::string_view::npos;) {
        const std::size_t end = std::min(text.find_first_of(kBlanks, start), text.size());
        if (text[start] == '+') ++start;  // which std::from_chars() does not read
        double number = 0;
        const auto [stop, error] = std::from_chars(text.data() + start, text.data() + end, number);
        if (error != std::errc() || stop != text.data() + end || !std::isfinite(number)) return {};
        numbers.push_back(number);
        start = end;
    }
    return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

/// Reads the lines of the header. Throws Error for formats of pixels that are not known.
void read_header(const std::string& subject, Reader& reader, RadiancePicture& picture) {
    constexpr Chromaticities kXyz{{1, 0}, {0, 1}, {0, 0}, {1.0 / 3, 1.0 / 3}};
    bool xyz = false;
    double exposure = 1, aspect = 1;  // products of their lines
    dvec3 correction(1);
    for (std::string_view line = reader.line(); !line.empty(); line = reader.line()) {
        const std::string_view text = line.substr(std::min(line.find('='), line.size() - 1) + 1);
        const auto numbers = [&](std::size_t count) {
            const auto found = numbers_of(text, count);
            if (!found)
                picture.notes.push_back(fmt::format("{} is ignored: it is not {}", line,
                                                    count == 1 ? "a number" : fmt::format("{} numbers", count)));
            return found;
        };
        if (line.starts_with("FORMAT=")) {
            const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size());
            const std::string_view format = text.substr(first, text.find_first_of(" \t", first) - first);
            xyz = format == "32-bit_rle_xyze";
            if (!xyz && format != "32-bit_rle_rgbe") throw Error(subject, "{} is not supported", line);
        } else if (line.starts_with("EXPOSURE=")) {
            if (const auto factor = numbers(1)) exposure *= (*factor)[0];
        } else if (line.starts_with("PIXASPECT=")) {
            if (const auto factor = numbers(1)) aspect *= (*factor)[0];
        } else if (line.starts_with("COLORCORR=")) {
            if (const auto factor = numbers(3)) correction *= dvec3((*factor)[0], (*factor)[1], (*factor)[2]);
        } else if (line.starts_with("PRIMARIES=")) {
            const auto found = numbers(8);
            if (!found) continue;
            Chromaticities c{};
            auto next = found->begin();
            for (dvec2* xy : {&c.red, &c.green, &c.blue, &c.white}) {
                // Rounds to the precision of other formats, so that equal pictures stay equal.
                xy->x = static_cast<float>(*next++), xy->y = static_cast<float>(*next++);
            }
            picture.primaries = known_chromaticities(c);
        } else if (line.starts_with("GAMMA=")) {
            if (const auto gamma = numbers(1); gamma && (*gamma)[0] != 1)
                picture.notes.push_back(fmt::format("{} is ignored: values are linear", line));
        } else if (line.starts_with("VIEW=")) {
            picture.notes.push_back(fmt::format("{} is ignored: maps show all directions", line));
        }
    }
    if (xyz) picture.primaries = kXyz;
    if (exposure != 1) picture.notes.push_back(fmt::format("EXPOSURE {} is not divided out", exposure));
    if (correction != dvec3(1))
        picture.notes.push_back(
            fmt::format("COLORCORR {} {} {} is not divided out", correction.x, correction.y, correction.z));
    if (aspect != 1) picture.notes.push_back(fmt::format("PIXASPECT {} is ignored: maps show all directions", aspect));
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

void read_line(Reader& reader, std::vector<Rgbe>& row) {
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
    read_header(subject, reader, picture);
    const Resolution resolution = parse_resolution(subject, reader.line(), limits.max_side);
    const auto lines = static_cast<std::size_t>(resolution.lines), length = static_cast<std::size_t>(resolution.length);
    if (reader.left() < sizeof(Rgbe) * lines) throw Error(subject, "is truncated");  // a line has one pixel at least
    const std::uint64_t size = 3 * sizeof(float) * lines * length;
    if (size > limits.max_bytes)
        throw Error(subject, "has {} bytes of pixels, more than the limit of {}{}", size, limits.max_bytes,
                    limits.reason);

    std::vector<Rgbe> pixels;  // grows with the lines that are read, since the header may claim any size
    std::vector<Rgbe> line(length);
    for (std::size_t i = 0; i < lines; ++i) {
        read_line(reader, line);
        pixels.insert(pixels.end(), line.begin(), line.end());
    }

    std::array<float, 256> scale{};  // value of a mantissa step, by exponent; exponent 0 is black
    for (int e = 1; e < 256; ++e) scale[static_cast<std::size_t>(e)] = std::ldexp(1.0f, e - 128 - 8);
    const int width = resolution.columns ? resolution.lines : resolution.length;
    const int height = resolution.columns ? resolution.length : resolution.lines;
    picture.image = Image(width, height, 3);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto row = static_cast<std::size_t>(resolution.bottom_up ? height - 1 - y : y);
            const auto column = static_cast<std::size_t>(resolution.right_to_left ? width - 1 - x : x);
            const Rgbe& p = pixels[resolution.columns ? column * length + row : row * length + column];
            for (std::size_t c = 0; c < 3; ++c) picture.image.at(x, y)[c] = static_cast<float>(p[c]) * scale[p[3]];
        }
    }
    return picture;
}

}  // namespace halflight
