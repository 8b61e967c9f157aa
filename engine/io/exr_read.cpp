#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
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
#include <cstring>
#include <iterator>
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
            if (name == "dataWindow" && type == "box2i") check_window();
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
        for (std::int64_t& c : corner) c = static_cast<std::int32_t>(read_uint32());
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
        attributes.chromaticities = {dvec2_of(c.red), dvec2_of(c.green), dvec2_of(c.blue), dvec2_of(c.white)};
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

/// Reads the pixels of channels [first, end of channels) from a part.
void read_pixels(Imf::MultiPartInputFile& file, int number, std::size_t first, ExrFile& result) {
    Imf::InputPart part(file, number);
    const Imf::Header& header = part.header();
    const Imath::Box2i window = header.dataWindow();
    const auto width = static_cast<std::size_t>(result.width);
    // Reads whole rows of tiles, so that no tile is decoded twice. 64 rows keep all threads busy with blocks of 16.
    int band = 64;
    if (header.hasTileDescription()) band = std::max(band, static_cast<int>(header.tileDescription().ySize));
    for (int done = 0; done < result.height; done += band) {
        const int rows = std::min(band, result.height - done);
        Imf::FrameBuffer buffer;
        auto in_part = header.channels().begin();
        for (ExrChannel& channel : std::span(result.channels).subspan(first)) {
            channel.values.resize(width * static_cast<std::size_t>(done + rows));
            const Imath::V2i origin(window.min.x, window.min.y + done);
            buffer.insert((in_part++).name(),
                          Imf::Slice::Make(channel.type == ExrType::uint32 ? Imf::UINT : Imf::FLOAT,
                                           channel.values.data() + width * static_cast<std::size_t>(done), origin,
                                           result.width, rows, sizeof(float), sizeof(float) * width));
        }
        part.setFrameBuffer(buffer);
        part.readPixels(window.min.y + done, window.min.y + done + rows - 1);
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

/// Returns the channels of a part. Throws Error for channels that cannot be read.
std::vector<ExrChannel> channels_of(const std::string& subject, const Imf::Header& header,
                                    const std::vector<std::string>& views) {
    if (header.hasType() && Imf::isDeepData(header.type())) throw Error(subject, "deep data is not supported");
    std::vector<ExrChannel> channels;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
        if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
            throw Error(subject, "channel {} is subsampled, which is not supported", c.name());
        channels.push_back({name_of(c.name(), header, views), type_of(c.channel().type), {}});
    }
    return channels;
}

/// Returns whether a further part adds to the pixels of the first: same data window, flat, channels of other names.
bool adds_to(const ExrFile& first, const Imf::Header& window, const Imf::Header& header,
             const std::vector<std::string>& views) {
    if (header.hasType() && Imf::isDeepData(header.type())) return false;
    if (header.dataWindow() != window.dataWindow()) return false;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
        if (first.find(name_of(c.name(), header, views)) || c.channel().xSampling != 1 || c.channel().ySampling != 1)
            return false;
    return true;
}

}  // namespace

bool is_exr(std::string_view bytes) {
    return bytes.starts_with("\x76\x2f\x31\x01");
}

ExrLimits limits_of_renders() {
    const ExrLimits usual;
    return {65536, std::max<std::uint64_t>(usual.max_bytes, MemoryLedger::process().free())};
}

ExrFile read_exr(const std::filesystem::path& path, const ExrLimits& limits) {
    const std::string subject = path.string();
    const std::string bytes = read_file(path, limits.max_bytes);
    HeaderGuard(subject, bytes, limits).check();
    try {
        ExrInput stream(subject, bytes);
        Imf::MultiPartInputFile file(stream, exr_threads());
        const Imf::Header& header = file.header(0);
        ExrFile result;
        result.width = header.dataWindow().max.x - header.dataWindow().min.x + 1;
        result.height = header.dataWindow().max.y - header.dataWindow().min.y + 1;
        result.attributes = attributes_of(header);
        const std::vector<std::string> views = views_of(file);
        if (!views.empty()) result.attributes.views = views;
        for (int part = 0; part < file.parts(); ++part) {
            if (part > 0 && !adds_to(result, header, file.header(part), views)) continue;
            const std::size_t first = result.channels.size();
            std::ranges::move(channels_of(subject, file.header(part), views), std::back_inserter(result.channels));
            const std::uint64_t size = sizeof(float) * result.channels.size() *
                                       static_cast<std::uint64_t>(result.width) *
                                       static_cast<std::uint64_t>(result.height);
            if (size > limits.max_bytes)
                throw Error(subject, "has {} bytes of pixels, more than the limit of {}{}", size, limits.max_bytes,
                            limits.reason);
            if (!file.partComplete(part)) throw Error(subject, "is truncated");
            read_pixels(file, part, first, result);
        }
        return result;
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(subject, "cannot read OpenEXR: {}", e.what());
    }
}

const ExrChannel* ExrFile::find(const std::string& name) const {
    const auto found = std::find_if(channels.begin(), channels.end(), [&](const auto& c) { return c.name == name; });
    return found == channels.end() ? nullptr : &*found;
}

Image ExrFile::image(const std::vector<std::string>& names) const {
    Image result(width, height, static_cast<int>(names.size()));
    for (std::size_t c = 0; c < names.size(); ++c) {
        const ExrChannel* channel = find(names[c]);
        if (!channel) throw Error("OpenEXR file", "has no channel {}", names[c]);
        for (std::size_t i = 0; i < channel->values.size(); ++i) {
            const float value = channel->values[i];
            result.pixels[i * names.size() + c] =
                channel->type == ExrType::uint32 ? static_cast<float>(std::bit_cast<std::uint32_t>(value)) : value;
        }
    }
    return result;
}

}  // namespace halflight
