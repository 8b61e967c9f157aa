#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfEnvmapAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiView.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstring>
#include <iterator>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/exr.h"
#include "engine/io/exr_common.h"

namespace halflight {
namespace {

/// Check of the attributes of all headers (OpenEXR file layout: name\0 type\0 size value). It runs before OpenEXR,
/// which allocates any size that a damaged header claims.
class HeaderGuard {
  public:
    HeaderGuard(const std::string& subject, std::string_view bytes, const ExrLimits& limits)
        : subject_(subject), bytes_(bytes), limits_(limits) {}

    void check() {
        if (is_lfs_pointer(bytes_)) throw Error(subject_, "is a Git LFS pointer, not the file itself");
        if (!is_exr(bytes_)) throw Error(subject_, "is not an OpenEXR file");
        position_ = 4;
        constexpr std::uint32_t kMultiPart = 0x1000;
        const bool multi_part = read_uint32() & kMultiPart;
        do check_header();
        while (multi_part && peek() != '\0');
    }

  private:
    static constexpr std::pair<std::string_view, std::uint32_t> kFixedSizes[] = {
        {"box2i", 16},      {"box2f", 16},   {"chromaticities", 32},
        {"compression", 1}, {"double", 8},   {"envmap", 1},
        {"float", 4},       {"int", 4},      {"keycode", 28},
        {"lineOrder", 1},   {"m33d", 72},    {"m33f", 36},
        {"m44d", 128},      {"m44f", 64},    {"rational", 8},
        {"tiledesc", 9},    {"timecode", 8}, {"v2d", 16},
        {"v2f", 8},         {"v2i", 8},      {"v3d", 24},
        {"v3f", 12},        {"v3i", 12}};

    void check_header() {
        while (peek() != '\0') {
            const std::string_view name = read_name();
            const std::string_view type = read_name();
            const std::uint32_t size = read_uint32();
            if (size > bytes_.size() - position_) fail();
            const std::size_t end = position_ + size;
            // OpenEXR parses the content of these types and trusts the size of others. Both must end at `end`.
            const auto fixed = std::find_if(std::begin(kFixedSizes), std::end(kFixedSizes),
                                            [&](const auto& known) { return known.first == type; });
            if (fixed != std::end(kFixedSizes) && fixed->second != size) fail();
            if (type == "chlist") check_channels(end);
            if ((name == "dataWindow" || name == "displayWindow") && type == "box2i") check_window();
            if (type == "tiledesc") {
                check_side(read_uint32());
                check_side(read_uint32());
            }
            position_ = end;
        }
        ++position_;
    }

    void check_channels(std::size_t end) {
        constexpr std::size_t kMostChannels = 4096;
        constexpr std::size_t kChannel = 16;  // bytes that follow the name: type, linearity, sampling
        while (peek() != '\0') {
            read_name();
            position_ += kChannel;
            if (++channels_ > kMostChannels) throw Error(subject_, "has more than {} channels", kMostChannels);
        }
        if (position_ + 1 != end) fail();
    }

    void check_window() {
        std::int64_t corner[4];
        constexpr std::int64_t kFarthest = 1 << 28;  // sums of corners must not overflow
        for (std::int64_t& c : corner) {
            c = static_cast<std::int32_t>(read_uint32());
            if (std::abs(c) > kFarthest) throw Error(subject_, "is damaged: a window has a corner at {}", c);
        }
        check_side(corner[2] - corner[0] + 1);
        check_side(corner[3] - corner[1] + 1);
    }

    void check_side(std::int64_t side) const {
        if (side < 1) throw Error(subject_, "is damaged: a side of {} pixels", side);
        if (side > limits_.max_side)
            throw Error(subject_, "has a side of {} pixels, more than the limit of {}", side, limits_.max_side);
    }

    char peek() const {
        if (position_ >= bytes_.size()) fail();
        return bytes_[position_];
    }

    std::string_view read_name() {
        const std::size_t end = bytes_.find('\0', position_);
        if (end == std::string_view::npos) fail();
        const std::string_view name = bytes_.substr(position_, end - position_);
        position_ = end + 1;
        return name;
    }

    std::uint32_t read_uint32() {
        if (bytes_.size() - position_ < 4) fail();
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < 4; ++i)
            value |= std::uint32_t{static_cast<unsigned char>(bytes_[position_ + i])} << (8 * i);
        position_ += 4;
        return value;
    }

    [[noreturn]] void fail() const { throw Error(subject_, "is damaged or truncated: its header is inconsistent"); }

    const std::string& subject_;
    std::string_view bytes_;
    const ExrLimits& limits_;
    std::size_t channels_ = 0;  // number of channels of all parts so far
    std::size_t position_ = 0;
};

dmat4 from_row_vector_form(const Imath::M44f& m) {
    dmat4 result;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) result[i][j] = m[i][j];
    return result;
}

glm::dvec2 dvec2_of(const Imath::V2f& v) {
    return {v.x, v.y};
}

ExrAttributes attributes_of(const Imf::Header& header) {
    // Attributes that every file has, or that describe the part itself.
    static const std::set<std::string> kOfPart{"type",
                                               "name",
                                               "view",
                                               "version",
                                               "chunkCount",
                                               "pixelAspectRatio",
                                               "screenWindowWidth",
                                               "dwaCompressionLevel"};
    ExrAttributes attributes;
    if (Imf::hasChromaticities(header)) {
        const Imf::Chromaticities& c = Imf::chromaticities(header);
        attributes.chromaticities =
            known_chromaticities({dvec2_of(c.red), dvec2_of(c.green), dvec2_of(c.blue), dvec2_of(c.white)});
    }
    if (Imf::hasWorldToCamera(header))
        attributes.world_to_camera = exr_camera_from_camera() * from_row_vector_form(Imf::worldToCamera(header));
    if (Imf::hasWorldToNDC(header))
        attributes.world_to_clip = glm::inverse(exr_ndc_from_clip()) * from_row_vector_form(Imf::worldToNDC(header));
    if (Imf::hasFramesPerSecond(header)) {
        const Imf::Rational& rate = Imf::framesPerSecond(header);
        attributes.frame_rate = {rate.n, static_cast<std::int32_t>(rate.d)};
    }
    if (Imf::hasMultiView(header)) attributes.views = Imf::multiView(header);
    if (Imf::hasTimeCode(header)) {
        const Imf::TimeCode& t = Imf::timeCode(header);
        attributes.time_code = {t.hours(), t.minutes(), t.seconds(), t.frame(), t.fieldPhase()};
    }
    const Imath::Box2i &data = header.dataWindow(), &display = header.displayWindow();
    attributes.origin = ivec2(data.min.x - display.min.x, data.min.y - display.min.y);
    attributes.display = ivec2(display.max.x - display.min.x + 1, display.max.y - display.min.y + 1);
    for (auto i = header.begin(); i != header.end(); ++i) {
        const auto* text = dynamic_cast<const Imf::StringAttribute*>(&i.attribute());
        const std::string name = i.name();
        if (kOfPart.contains(name)) continue;
        if (const auto* number = dynamic_cast<const Imf::FloatAttribute*>(&i.attribute()))
            attributes.numbers[name] = number->value();
        if (const auto* count = dynamic_cast<const Imf::IntAttribute*>(&i.attribute()))
            attributes.counts[name] = count->value();
        if (!text) continue;
        if (name == "capDate") {
            attributes.capture_date = text->value();
        } else if (name == "software") {
            attributes.software = text->value();
        } else if (name == "comments") {
            attributes.comments = text->value();
        } else {
            attributes.extra[name] = text->value();
        }
    }
    return attributes;
}

ExrType type_of(Imf::PixelType type) {
    return type == Imf::HALF ? ExrType::half : type == Imf::UINT ? ExrType::uint32 : ExrType::float32;
}

ivec2 size_of(const Imath::Box2i& window) {
    return {window.max.x - window.min.x + 1, window.max.y - window.min.y + 1};
}

/// Returns values of all pixels, interpolated from those of every `step`-th column and row; ids are repeated.
std::vector<float> interpolated(const std::vector<float>& values, const ivec2& size, const ivec2& step, bool ids) {
    const ivec2 stored = size / step;
    const auto at = [&](int x, int y) {
        return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(stored.x) + static_cast<std::size_t>(x)];
    };
    std::vector<float> all;
    all.reserve(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
    for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
            const ivec2 first = ivec2(x, y) / step, next = glm::min(first + 1, stored - 1);
            const vec2 t = vec2(ivec2(x, y) - first * step) / vec2(step);
            const float here = at(first.x, first.y);
            all.push_back(ids ? here
                              : glm::mix(glm::mix(here, at(next.x, first.y), t.x),
                                         glm::mix(at(first.x, next.y), at(next.x, next.y), t.x), t.y));
        }
    }
    return all;
}

/// Reads the pixels of a part into its channels.
void read_pixels(Imf::MultiPartInputFile& file, int number, std::span<ExrChannel> channels) {
    Imf::InputPart part(file, number);
    const Imf::Header& header = part.header();
    const Imath::Box2i window = header.dataWindow();
    const ivec2 size = size_of(window);
    const auto step_of = [](const Imf::Channel& c) { return ivec2(c.xSampling, c.ySampling); };
    // Reads whole rows of tiles, so that no tile is decoded twice. 64 rows keep all threads busy with blocks of 16.
    int band = 64;
    if (header.hasTileDescription()) band = std::max(band, static_cast<int>(header.tileDescription().ySize));
    // OpenEXR has checked that the steps divide the size.
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
        band = std::lcm(band, c.channel().ySampling);
    for (int done = 0; done < size.y; done += band) {
        const int rows = std::min(band, size.y - done);
        Imf::FrameBuffer buffer;
        auto in_part = header.channels().begin();
        for (ExrChannel& channel : channels) {
            const ivec2 step = step_of(in_part.channel());
            const auto width = static_cast<std::size_t>(size.x / step.x);
            channel.values.resize(width * static_cast<std::size_t>((done + rows) / step.y));
            const Imath::V2i origin(window.min.x, window.min.y + done);
            buffer.insert((in_part++).name(),
                          Imf::Slice::Make(channel.type == ExrType::uint32 ? Imf::UINT : Imf::FLOAT,
                                           channel.values.data() + width * static_cast<std::size_t>(done / step.y),
                                           origin, size.x, rows, sizeof(float), sizeof(float) * width, step.x, step.y));
        }
        part.setFrameBuffer(buffer);
        part.readPixels(window.min.y + done, window.min.y + done + rows - 1);
    }
    auto in_part = header.channels().begin();
    for (ExrChannel& channel : channels)
        if (const ivec2 step = step_of((in_part++).channel()); step != ivec2(1))
            channel.values = interpolated(channel.values, size, step, channel.type == ExrType::uint32);
}

/// Converts channels Y, RY and BY of a layer to R, G and B: RY = (R - Y) / Y, BY = (B - Y) / Y (ImfRgbaYca.h).
void convert_chroma(std::span<ExrChannel> channels, const Chromaticities& primaries) {
    const auto named = [&](const std::string& name) {
        const auto found = std::ranges::find(channels, name, &ExrChannel::name);
        return found == channels.end() ? nullptr : &*found;
    };
    const dmat3 xyz = rgb_to_xyz(primaries);
    const vec3 weights(xyz[0].y, xyz[1].y, xyz[2].y);
    for (ExrChannel& red : channels) {
        if (red.name != "RY" && !red.name.ends_with(".RY")) continue;
        const std::string layer = red.name.substr(0, red.name.size() - 2);
        ExrChannel *const blue = named(layer + "BY"), *const green = named(layer + "Y");
        if (!blue || !green) continue;
        for (std::size_t i = 0; i < red.values.size(); ++i) {
            const float y = green->values[i], r = (red.values[i] + 1) * y, b = (blue->values[i] + 1) * y;
            red.values[i] = r, blue->values[i] = b;
            green->values[i] = (y - weights.x * r - weights.z * b) / weights.y;
        }
        red.name = layer + "R", green->name = layer + "G", blue->name = layer + "B";
    }
}

/// Returns the views of the parts.
std::vector<std::string> views_of(const Imf::MultiPartInputFile& file) {
    std::vector<std::string> views;
    for (int part = 0; part < file.parts(); ++part)
        if (const Imf::Header& header = file.header(part);
            header.hasView() && std::ranges::find(views, header.view()) == views.end())
            views.push_back(header.view());
    return views;
}

/// Returns the name that a channel of a part has in a file of one part.
std::string name_of(const std::string& channel, const Imf::Header& header, const std::vector<std::string>& views) {
    if (!header.hasView()) return channel;
    const auto view = std::ranges::find(views, header.view()) - views.begin();
    return Imf::insertViewName(channel, views, static_cast<int>(view));
}

bool is_deep(const Imf::Header& header) {
    return header.hasType() && Imf::isDeepData(header.type());
}

/// Returns the channels of a part, without values.
std::vector<ExrChannel> channels_of(const Imf::Header& header, const std::vector<std::string>& views) {
    std::vector<ExrChannel> channels;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
        channels.push_back({name_of(c.name(), header, views), type_of(c.channel().type), {}});
    return channels;
}

bool have(const std::vector<ExrChannel>& channels, std::string_view name) {
    return std::ranges::count(channels, name, &ExrChannel::name) > 0;
}

bool have_color(const std::vector<ExrChannel>& channels) {
    const auto has = [&](const char* name) { return have(channels, name); };
    return (has("R") && has("G") && has("B")) || (has("RY") && has("BY") && has("Y"));
}

/// Returns whether the channels have a plain Y that is no coordinate.
bool have_luminance(const std::vector<ExrChannel>& channels) {
    return have(channels, "Y") && !have(channels, "X");
}

/// A flat part of a file.
struct FlatPart {
    int number = 0;
    std::string name;
    Imath::Box2i window;
    std::vector<ExrChannel> channels;
    /// Returns picture_rank() of a part that can be the picture; 3 for other parts.
    int rank() const {
        const int named = picture_rank(name);
        return have_color(channels) || (named == 0 && have_luminance(channels)) ? named : 3;
    }
    void put_name_before_channels() {
        for (ExrChannel& channel : channels) channel.name = name + "." + channel.name;
    }
};

/// Returns the flat parts, that of the picture first. Channels have names that no other part has.
std::vector<FlatPart> flat_parts(const std::string& subject, const Imf::MultiPartInputFile& file, ExrFile& result) {
    constexpr const char* kLight[] = {"R", "G", "B", "Y"};
    const std::vector<std::string> views = views_of(file);
    std::vector<FlatPart> parts;
    for (int i = 0; i < file.parts(); ++i) {
        const Imf::Header& header = file.header(i);
        const std::string name = header.hasName() ? header.name() : std::to_string(i);
        if (is_deep(header)) {
            result.deep_parts.push_back(name);
            continue;
        }
        parts.push_back({i, name, header.dataWindow(), channels_of(header, views)});
    }
    if (parts.empty()) throw Error(subject, "deep data is not supported");
    // Colours of a part of data are renamed if another part has the picture. Without one, they are the picture.
    if (std::ranges::any_of(parts, [](const FlatPart& part) { return part.rank() < 2; })) {
        for (FlatPart& part : parts)
            if (picture_rank(part.name) == 2 &&
                std::ranges::any_of(kLight, [&](const char* name) { return have(part.channels, name); }))
                part.put_name_before_channels();
    }
    std::stable_sort(parts.begin(), parts.end(),
                     [](const FlatPart& a, const FlatPart& b) { return a.rank() < b.rank(); });
    if (parts[0].rank() == 0 && !have_color(parts[0].channels))
        for (FlatPart& part : std::span(parts).subspan(1))
            if (have_color(part.channels)) part.put_name_before_channels();
    // The part of the picture is first and keeps its names; the others follow in the order of the file.
    std::sort(parts.begin() + 1, parts.end(), [](const FlatPart& a, const FlatPart& b) { return a.number < b.number; });
    std::set<std::string> names;
    for (FlatPart& part : parts) {
        const auto taken = [&](const ExrChannel& channel) { return names.contains(channel.name); };
        while (std::ranges::any_of(part.channels, taken)) part.put_name_before_channels();
        for (const ExrChannel& channel : part.channels) names.insert(channel.name);
    }
    result.attributes = attributes_of(file.header(parts[0].number));
    for (int i = 0; i < file.parts(); ++i) {
        ExrAttributes own = attributes_of(file.header(i));
        result.attributes.extra.merge(own.extra);
        if (!result.attributes.chromaticities)
            result.attributes.chromaticities = own.chromaticities;  // all parts share them
    }
    if (!views.empty()) result.attributes.views = views;
    const Imf::Header& picture = file.header(parts[0].number);
    if (Imf::hasEnvmap(picture))
        result.envmap = Imf::envmap(picture) == Imf::ENVMAP_CUBE ? ExrEnvmap::cube : ExrEnvmap::latlong;
    return parts;
}

/// Throws Error if the pixels of all parts, or a picture of the display window, are larger than the limits.
void check_size(const std::string& subject, const std::vector<FlatPart>& parts, const ExrLimits& limits,
                const ivec2& display) {
    const auto area = [](const ivec2& size) {
        return static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
    };
    std::uint64_t channels = 0, values = 0;
    for (const FlatPart& part : parts)
        channels += part.channels.size(), values += part.channels.size() * area(size_of(part.window));
    const std::uint64_t shown = std::min<std::uint64_t>(channels, 4);  // most channels of an image
    const std::uint64_t size = sizeof(float) * std::max(values, shown * area(display));
    if (size > limits.max_bytes)
        throw Error(subject, "has {} bytes of pixels, more than the limit of {}{}", size, limits.max_bytes,
                    limits.reason);
}

}  // namespace

bool is_exr(std::string_view bytes) {
    return bytes.starts_with("\x76\x2f\x31\x01");
}

int picture_rank(std::string_view name) {
    std::string lower(name);
    std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
    const auto has = [&](std::string_view word) { return lower.find(word) != std::string::npos; };
    if (has("combined") || has("beauty") || has("rgba")) return 0;
    const std::string last = lower.substr(lower.rfind('.') + 1);
    constexpr std::string_view kParts[] = {"albedo", "crypto",   "depth",   "diffcol",  "glosscol", "matte",   "motion",
                                           "normal", "position", "tangent", "transcol", "variance", "velocity"};
    constexpr std::string_view kWords[] = {"id", "ids", "mask", "n", "p", "uv", "vector", "z"};
    return std::ranges::any_of(kParts, has) || std::ranges::count(kWords, last) > 0 ? 2 : 1;
}

ExrLimits limits_of_renders() {
    const ExrLimits usual;
    return {65536, std::max<std::uint64_t>(usual.max_bytes, MemoryLedger::process().free())};
}

namespace {

/// Reads an open file whose header was checked. pixels: reads values of channels, too.
ExrFile read(const std::string& subject, Imf::MultiPartInputFile& file, const ExrLimits& limits, bool pixels) {
    ExrFile result;
    std::vector<FlatPart> parts = flat_parts(subject, file, result);
    check_size(subject, parts, limits, result.attributes.display.value());
    const ivec2 size = size_of(parts[0].window);
    result.width = size.x, result.height = size.y;
    const ivec2 display = ivec2(parts[0].window.min.x, parts[0].window.min.y) - result.attributes.origin;
    for (FlatPart& part : parts) {
        if (pixels) {
            if (!file.partComplete(part.number)) throw Error(subject, "is truncated");
            read_pixels(file, part.number, part.channels);
            convert_chroma(part.channels, result.attributes.chromaticities.value_or(kRec709));
        }
        for (ExrChannel& channel : part.channels) {
            channel.window = {ivec2(part.window.min.x, part.window.min.y) - display, size_of(part.window)};
            if (parts.size() > 1) channel.part = part.name;
            result.channels.push_back(std::move(channel));
        }
    }
    return result;
}

/// Returns what `read` returns. Throws Error in place of OpenEXR's exceptions.
template <class Read>
ExrFile without_exceptions(const std::string& subject, const Read& read) {
    try {
        return read();
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(subject, "cannot read OpenEXR: {}", e.what());
    }
}

}  // namespace

ExrFile read_exr(const std::filesystem::path& path, const ExrLimits& limits) {
    const std::string subject = path.string();
    const std::string bytes = read_file(path, limits.max_bytes);
    HeaderGuard(subject, bytes, limits).check();
    return without_exceptions(subject, [&] {
        ExrInput stream(subject, bytes);
        Imf::MultiPartInputFile file(stream, exr_threads());
        return read(subject, file, limits, true);
    });
}

ExrFile read_exr_header(const std::filesystem::path& path, const ExrLimits& limits) {
    constexpr std::uint64_t kUsual = std::uint64_t{1} << 20;  // most bytes of the headers of usual files
    const std::string subject = path.string();
    const ByteSource source(path);
    std::string buffer;
    const auto check = [&](std::uint64_t size) { HeaderGuard(subject, source.read(0, size, buffer), limits).check(); };
    try {
        check(std::min(kUsual, source.size()));
    } catch (const Error&) {
        if (source.size() <= kUsual || source.size() > limits.max_bytes) throw;
        check(source.size());
    }
    return without_exceptions(subject, [&] {
        Imf::MultiPartInputFile file(subject.c_str(), 1, false);
        return read(subject, file, limits, false);
    });
}

bool ExrWindow::contains(const ExrWindow& other) const {
    const ivec2 end = origin + size, others = other.origin + other.size;
    return origin.x <= other.origin.x && origin.y <= other.origin.y && end.x >= others.x && end.y >= others.y;
}

const ExrChannel* ExrFile::find(const std::string& name) const {
    const auto found = std::find_if(channels.begin(), channels.end(), [&](const auto& c) { return c.name == name; });
    return found == channels.end() ? nullptr : &*found;
}

bool ExrFile::is_cryptomatte(std::string_view layer) const {
    return std::ranges::any_of(attributes.extra, [&](const auto& attribute) {
        const auto& [key, value] = attribute;
        return key.starts_with("cryptomatte/") && key.ends_with("/name") && layer.starts_with(value);
    });
}

ExrWindow ExrFile::window_of(const std::vector<std::string>& names) const {
    std::optional<ExrWindow> all;
    for (const std::string& name : names) {
        const ExrChannel* channel = find(name);
        if (!channel) throw Error("OpenEXR file", "has no channel {}", name);
        const ExrWindow& own = channel->window;
        const ivec2 end = all ? glm::max(all->origin + all->size, own.origin + own.size) : own.origin + own.size;
        const ivec2 first = all ? glm::min(all->origin, own.origin) : own.origin;
        all = ExrWindow{first, end - first};
    }
    return all.value_or(ExrWindow());
}

Image ExrFile::image(const std::vector<std::string>& names, const ExrWindow& window, bool bits) const {
    Image result(window.size.x, window.size.y, static_cast<int>(names.size()));
    for (std::size_t c = 0; c < names.size(); ++c) {
        const ExrChannel* channel = find(names[c]);
        if (!channel) throw Error("OpenEXR file", "has no channel {}", names[c]);
        const bool ids = channel->type == ExrType::uint32 && !bits;
        const ExrWindow& own = channel->window;
        const ivec2 first = glm::max(own.origin, window.origin);
        const ivec2 end = glm::min(own.origin + own.size, window.origin + window.size);
        for (int y = first.y; y < end.y; ++y) {
            const std::size_t row = static_cast<std::size_t>(y - own.origin.y) * static_cast<std::size_t>(own.size.x);
            for (int x = first.x; x < end.x; ++x) {
                const float value = channel->values[row + static_cast<std::size_t>(x - own.origin.x)];
                result.at(x - window.origin.x, y - window.origin.y)[c] =
                    ids ? static_cast<float>(std::bit_cast<std::uint32_t>(value)) : value;
            }
        }
    }
    return result;
}

Image ExrFile::image(const std::vector<std::string>& names) const {
    return image(names, window_of(names));
}

Image ExrFile::displayed(const std::vector<std::string>& names) const {
    return image(names, {ivec2(0), attributes.display.value()});
}

Image ExrFile::whole(const std::string& subject, const std::vector<std::string>& names) const {
    const ivec2 size = attributes.display.value();
    for (const std::string& name : names) {
        const ExrWindow own = window_of({name});
        const ivec2 last = own.origin + own.size;
        if (!own.contains({ivec2(0), size}))
            throw Error(subject, "is a crop: it has the pixels {},{} to {},{} of {} x {}", own.origin.x, own.origin.y,
                        last.x, last.y, size.x, size.y);
    }
    return displayed(names);
}

}  // namespace halflight
