// Frames as a movie: what they look like through the view goes to an ffmpeg process, which encodes it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/frames.h"
#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/core/process.h"

namespace halflight {

struct MovieFormat {
    ivec2 size{0};  // of the frames, pixels
    FrameRate rate;
    bool srgb = true;  // the display is one of sRGB, and players are told so
};

/// What ffmpeg is told to write `file`: H.264 of 4:2:0 for .mp4, ProRes 422 HQ for .mov, both by the matrix of BT.709.
/// Sides that are odd, which neither can have, are one pixel longer.
std::vector<std::string> ffmpeg_arguments(const MovieFormat& format, const std::filesystem::path& file);

/// RGB of 8 bits, top row first, even sides: the last column and row come twice where there would be an odd number.
/// `view`: display-encoded, [0,1], 3 or 4 channels.
std::vector<std::uint8_t> movie_frame(const Image& view);

/// A movie that is being made.
class Movie {
  public:
    /// Starts the ffmpeg that PATH has; it writes `file`. Errors are about `subject`. Throws Error where there is none.
    Movie(const std::filesystem::path& file, std::string subject, const MovieFormat& format);
    Movie(const Movie&) = delete;
    Movie& operator=(const Movie&) = delete;
    ~Movie();  ///< ends ffmpeg where finish() has not; then the file is not whole

    /// The next frame. That ffmpeg takes no more is told by failed() and finish().
    void add(const Image& view);
    bool failed() const { return failed_; }
    /// Waits until the file is whole. Throws Error with ffmpeg's last line where it is not.
    void finish();

  private:
    void close_input();

    std::string subject_;
    std::filesystem::path file_;
    Spool errors_;                   // ffmpeg's stderr
    int input_ = -1;                 // our end of its stdin
    std::optional<Process> ffmpeg_;  // ended with the object
    bool failed_ = false;
};

}  // namespace halflight
