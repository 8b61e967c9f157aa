#include "tools/halflight/movie.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "engine/core/error.h"
#include "engine/io/png.h"
#include "tools/halflight/arguments.h"

namespace halflight {
namespace {

int even(int side) {
    return side + side % 2;
}

/// The last line that is not empty.
std::string last_line(std::FILE* file) {
    std::string text;
    std::array<char, 4096> buffer;
    std::rewind(file);
    while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), file))
        text.append(buffer.data(), count);
    text.erase(text.find_last_not_of(" \r\n") + 1);
    return text.substr(text.find_last_of('\n') + 1);
}

/// Starts arguments[0] out of PATH with these as stdin and stderr; errno where it cannot.
int spawn(const std::vector<std::string>& arguments, int input, int said, pid_t& process) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&files, said, STDERR_FILENO);
    // In a group of its own: what a terminal's Ctrl-C means for the movie is decided here.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    const int error = posix_spawnp(&process, argv[0], &files, &attributes, argv.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    return error;
}

}  // namespace

std::vector<std::string> ffmpeg_arguments(const MovieFormat& format, const std::filesystem::path& file) {
    std::vector<std::string> all = {"ffmpeg", "-hide_banner", "-loglevel", "error", "-nostdin", "-y"};
    const auto add = [&](std::initializer_list<std::string> more) { all.insert(all.end(), more); };
    add({"-f", "rawvideo", "-pixel_format", "rgb24"});
    add({"-video_size", fmt::format("{}x{}", even(format.size.x), even(format.size.y))});
    add({"-framerate", fmt::format("{}/{}", format.rate.numerator, format.rate.denominator), "-i", "pipe:0"});
    // Some encoders ask the frames what they are of, some the stream.
    std::string params = "colorspace=bt709:range=tv";
    if (format.srgb) params += ":color_primaries=bt709:color_trc=iec61966-2-1";
    add({"-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,setparams=" + params});
    add({"-colorspace", "bt709", "-color_range", "tv"});
    if (format.srgb) add({"-color_primaries", "bt709", "-color_trc", "iec61966-2-1"});
    if (has_extension(file, "mov"))
        add({"-c:v", "prores_ks", "-profile:v", "3", "-vendor", "apl0", "-pix_fmt", "yuv422p10le", "-f", "mov"});
    else
        add({"-c:v", "libx264", "-crf", "16", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"});
    add({"file:" + file.string()});  // names with a colon are no protocols
    return all;
}

std::vector<std::uint8_t> movie_frame(const Image& view) {
    std::vector<std::uint8_t> bytes;
    const int width = even(view.width), height = even(view.height);
    bytes.reserve(std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const float* const pixel = view.at(std::min(x, view.width - 1), std::min(y, view.height - 1));
            for (int c = 0; c < 3; ++c) bytes.push_back(quantize_8bit(pixel[c]));
        }
    }
    return bytes;
}

Movie::Movie(const std::filesystem::path& file, std::string subject, const MovieFormat& format)
    : subject_(std::move(subject)), file_(file), said_(std::tmpfile()) {
    if (!said_) throw Error(subject_, "no temporary file: {}", std::generic_category().message(errno));
    // A socket, since writing to a pipe whose reader has gone is a signal, which others may have a use for.
    std::array<int, 2> ends{-1, -1};
    int error = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0 ? 0 : errno;
    if (error == 0) {
        error = spawn(ffmpeg_arguments(format, file), ends[1], fileno(said_), process_);
        close(ends[1]);
        input_ = ends[0];
    }
    if (error == 0) return;
    close_input();
    std::fclose(said_);
    if (error == ENOENT) throw Error(subject_, "cannot be made: there is no ffmpeg in PATH");
    throw Error(subject_, "cannot start ffmpeg: {}", std::generic_category().message(error));
}

Movie::~Movie() {
    close_input();
    if (process_ > 0) {
        kill(process_, SIGKILL);
        while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
        }
    }
    std::fclose(said_);
}

void Movie::close_input() {
    if (input_ >= 0) close(std::exchange(input_, -1));
}

void Movie::add(const Image& view) {
    if (failed_) return;
    const std::vector<std::uint8_t> bytes = movie_frame(view);
    for (std::size_t done = 0; done < bytes.size() && !failed_;) {
        const ssize_t sent = send(input_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
        if (sent > 0) done += static_cast<std::size_t>(sent);
        failed_ = sent < 0 && errno != EINTR;
    }
}

void Movie::finish() {
    close_input();
    int status = 0;
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    std::error_code none;
    const bool nothing = std::filesystem::file_size(file_, none) == 0;
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && !failed_ && !nothing) return;
    std::string why = last_line(said_);
    if (why.empty())
        why = WIFSIGNALED(status)        ? fmt::format("was ended by signal {}", WTERMSIG(status))
              : WEXITSTATUS(status) != 0 ? fmt::format("exit status {}", WEXITSTATUS(status))
              : nothing                  ? "wrote nothing"
                                         : "did not take all frames";
    throw Error(subject_, "not written: ffmpeg: {}", why);
}

}  // namespace halflight
