#include "api/halflight/movie.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "api/halflight/picture_file.h"
#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/png.h"

namespace halflight {
namespace {

int even(int side) {
    return side + side % 2;
}

/// Returns whether the boxes of a movie fill its file and include the index (ISO/IEC 14496-12, section 4.2). A full
/// disk cuts movies short, and ffmpeg may end with status 0 then.
bool is_complete(const std::filesystem::path& file) {
    const ByteSource source(file);
    bool index = false;
    std::uint64_t at = 0;
    std::string buffer;
    const auto number = [&](std::uint64_t offset, std::uint64_t bytes) {
        std::uint64_t value = 0;
        for (const char c : source.read(offset, bytes, buffer)) value = value << 8 | static_cast<unsigned char>(c);
        return value;
    };
    while (source.size() - at >= 8) {
        const std::uint64_t rest = source.size() - at;
        std::uint64_t size = number(at, 4);
        index = index || source.read(at + 4, 4, buffer) == "moov";
        if (size == 1 && rest >= 16) size = number(at + 8, 8);
        if (size < 8 || size > rest) return false;
        at += size;
    }
    return index && at == source.size();
}

const char* name_of_primaries(const DisplayEncoding& encoding) {
    switch (encoding.primaries) {
        case 9:
            return "bt2020";
        case 11:
            return "smpte431";
        case 12:
            return "smpte432";
        default:
            return "bt709";
    }
}

const char* name_of_curve(const DisplayEncoding& encoding) {
    switch (encoding.curve) {
        case TransferCurve::bt1886:
            return "bt709";
        case TransferCurve::gamma22:
            return "gamma22";
        case TransferCurve::srgb:
            return "iec61966-2-1";
        case TransferCurve::pq:
            return "smpte2084";
        case TransferCurve::gamma26:
            return "smpte428";
        case TransferCurve::hlg:
            return "arib-std-b67";
    }
    return "unknown";
}

}  // namespace

std::vector<std::string> ffmpeg_arguments(const MovieFormat& format, const std::filesystem::path& file) {
    std::vector<std::string> all = {"ffmpeg", "-hide_banner", "-loglevel", "error", "-nostdin", "-y"};
    const auto add = [&](std::initializer_list<std::string> more) { all.insert(all.end(), more); };
    add({"-f", "rawvideo", "-pixel_format", format.bits == 16 ? "rgb48le" : "rgb24"});
    add({"-video_size", fmt::format("{}x{}", even(format.size.x), even(format.size.y))});
    add({"-framerate", fmt::format("{}/{}", format.rate.numerator, format.rate.denominator), "-i", "pipe:0"});
    const bool wide = format.encoding && format.encoding->primaries == 9;
    const std::string matrix = wide ? "bt2020" : "bt709", colours = wide ? "bt2020nc" : "bt709";
    // Some encoders read the colour space from the frames, others from the stream.
    std::string params = "colorspace=" + colours + ":range=tv";
    add({"-colorspace", colours, "-color_range", "tv"});
    if (format.encoding) {
        const std::string primaries = name_of_primaries(*format.encoding), curve = name_of_curve(*format.encoding);
        params += ":color_primaries=" + primaries + ":color_trc=" + (curve == "gamma22" ? "bt470m" : curve);
        add({"-color_primaries", primaries, "-color_trc", curve});
    }
    add({"-vf",
         "scale=out_color_matrix=" + matrix + ":out_range=tv:flags=accurate_rnd+full_chroma_int,setparams=" + params});
    const bool mov = has_extension(file, "mov");
    if (mov && format.start) {
        const TimeCode& t = *format.start;
        const bool pairs = format.rate.numerator > 30 * std::int64_t{format.rate.denominator};
        const int frame = pairs ? 2 * t.frame + (t.second_of_pair ? 1 : 0) : t.frame;
        add({"-timecode", fmt::format("{:02}:{:02}:{:02}:{:02}", t.hours, t.minutes, t.seconds, frame)});
    }
    if (mov)
        add({"-c:v", "prores_ks", "-profile:v", "3", "-vendor", "apl0", "-pix_fmt", "yuv422p10le", "-f", "mov"});
    else if (format.encoding && format.encoding->is_hdr())
        add({"-c:v", "libx265", "-crf", "16", "-pix_fmt", "yuv420p10le", "-tag:v", "hvc1", "-x265-params",
             "log-level=error", "-movflags", "+faststart", "-f", "mp4"});
    else
        add({"-c:v", "libx264", "-crf", "16", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"});
    add({"file:" + file.string()});  // "file:" keeps ffmpeg from reading a name with a colon as a protocol
    return all;
}

std::vector<std::uint8_t> movie_frame(const Image& view, int bits) {
    std::vector<std::uint8_t> bytes;
    const int width = even(view.width), height = even(view.height);
    bytes.reserve(static_cast<std::size_t>(3 * bits / 8) * static_cast<std::size_t>(width) *
                  static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const float* const pixel = view.at(std::min(x, view.width - 1), std::min(y, view.height - 1));
            for (int c = 0; c < 3; ++c) {
                if (bits == 8) {
                    bytes.push_back(quantize_8bit(pixel[c]));
                } else {
                    const std::uint16_t level = quantize_16bit(pixel[c]);
                    bytes.push_back(static_cast<std::uint8_t>(level & 0xff));
                    bytes.push_back(static_cast<std::uint8_t>(level >> 8));
                }
            }
        }
    }
    return bytes;
}

Movie::Movie(const std::filesystem::path& file, std::string subject, const MovieFormat& format,
             std::function<void()> pulse)
    : format_(format), subject_(std::move(subject)), file_(file), pulse_(std::move(pulse)) {
    // A socket is used because a write to a pipe without a reader raises a signal, which the caller may handle.
    std::array<int, 2> ends{-1, -1};
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
        throw Error(subject_, "cannot be made: {}", std::generic_category().message(errno));
    input_ = ends[0];
    try {
        ffmpeg_.emplace(ffmpeg_arguments(format, file),
                        ProcessOptions{.input = ends[1], .errors = errors_.descriptor()});
    } catch (const Error& error) {
        close(ends[1]);
        close_input();
        throw Error(subject_, "cannot be made: {}", error.what());
    }
    close(ends[1]);
}

Movie::~Movie() {
    close_input();
}

void Movie::close_input() {
    if (input_ >= 0) close(std::exchange(input_, -1));
}

void Movie::add(const Image& view) {
    if (failed_) return;
    const std::vector<std::uint8_t> bytes = movie_frame(view, format_.bits);
    for (std::size_t done = 0; done < bytes.size() && !failed_;) {
        pollfd room{input_, POLLOUT, 0};
        if (poll(&room, 1, 100) <= 0) {  // ffmpeg is busy, or there was a signal
            if (pulse_) pulse_();
            continue;
        }
        const ssize_t sent = send(input_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0) done += static_cast<std::size_t>(sent);
        failed_ = sent < 0 && errno != EINTR && errno != EAGAIN;
    }
}

void Movie::finish() {
    close_input();
    const ProcessEnd end = ffmpeg_->wait(pulse_);
    std::error_code none;
    const bool nothing = std::filesystem::file_size(file_, none) == 0;
    if (end.status == 0 && !failed_ && !nothing && is_complete(file_)) return;
    std::string why = last_line(errors_.text());
    if (why.ends_with(" --")) why.resize(why.size() - 3);  // ffmpeg goes on with a guess on the next line
    if (why.empty())
        why = end.signal        ? fmt::format("was ended by signal {}", end.signal)
              : end.status != 0 ? fmt::format("exit status {}", end.status)
              : nothing         ? "wrote nothing"
              : failed_         ? "did not take all frames"
                                : "wrote a part only; the disk may be full";
    throw Error(subject_, "not written: ffmpeg: {}", why);
}

}  // namespace halflight
