// Movies: an ffmpeg process encodes frames that went through the view transform.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/display_encoding.h"
#include "engine/core/frames.h"
#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/core/process.h"
#include "engine/io/exr.h"

namespace halflight {

struct MovieFormat {
    ivec2 size{0};  // size of a frame, pixels
    FrameRate rate;
    int bits = 8;                               // bits of a channel that ffmpeg gets: 8 or 16
    std::optional<DisplayEncoding> encoding{};  // tags of the movie; none: only its matrix is tagged
    std::optional<TimeCode> start{};            // time code of the first frame, for .mov
};

/// Returns the command line of ffmpeg that writes `file`: H.264 4:2:0 for .mp4, in HDR HEVC 4:2:0 of 10 bits, and
/// ProRes 422 HQ for .mov. The matrix is that of BT.709, with primaries of BT.2020 the one of BT.2020. Neither format
/// allows odd sides: odd sides become one pixel longer.
std::vector<std::string> ffmpeg_arguments(const MovieFormat& format, const std::filesystem::path& file);

/// Returns a frame as RGB of 8 or 16 bits, low byte first, top row first. The last column and row are repeated if a
/// side is odd. `view`: display-encoded, [0,1], 3 or 4 channels.
std::vector<std::uint8_t> movie_frame(const Image& view, int bits = 8);

/// A movie that is being written. Owns the ffmpeg process.
class Movie {
  public:
    /// Starts the ffmpeg in PATH, which writes `file`. Throws Error, whose text starts with `subject`, if there is
    /// none. While ffmpeg is waited for, `pulse` is called, which may throw.
    Movie(const std::filesystem::path& file, std::string subject, const MovieFormat& format,
          std::function<void()> pulse = {});
    Movie(const Movie&) = delete;
    Movie& operator=(const Movie&) = delete;
    ~Movie();  ///< Ends ffmpeg unless finish() has; the file is then incomplete.

    /// Sends the next frame. If ffmpeg has ended early, failed() returns true and finish() throws.
    void add(const Image& view);
    bool failed() const { return failed_; }
    /// Waits until the file is complete. Throws Error with the last line of ffmpeg if it fails.
    void finish();

  private:
    void close_input();

    MovieFormat format_;
    std::string subject_;
    std::filesystem::path file_;
    std::function<void()> pulse_;
    Spool errors_;                   // ffmpeg's stderr
    int input_ = -1;                 // write end of the pipe to ffmpeg's stdin; -1: closed
    std::optional<Process> ffmpeg_;  // ffmpeg itself, which the destructor terminates
    bool failed_ = false;
};

}  // namespace halflight
