#include "api/sequence/statistics_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <string_view>

#include "engine/core/error.h"
#include "engine/io/files.h"

namespace halflight {

void append_line(const std::filesystem::path& path, const std::string& line) {
    const auto check = [&](bool good) {
        if (!good) throw_write_error(path.string(), errno);
    };
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    check(file >= 0);
    const off_t size = lseek(file, 0, SEEK_END);
    char last = '\n';
    if (size > 0 && pread(file, &last, 1, size - 1) != 1) last = '\n';
    const std::string text = fmt::format("{}{}{}", last == '\n' ? "" : "\n", line, line.empty() ? "" : "\n");
    // On a full disk or quota, nothing is written instead of a part. Some file systems cannot reserve space.
    const auto bytes = static_cast<off_t>(text.size());
    if (bytes > 0 && fallocate(file, FALLOC_FL_KEEP_SIZE, size, bytes) != 0 && (errno == ENOSPC || errno == EDQUOT)) {
        const int full = errno;
        close(file);
        errno = full;
        check(false);
    }
    std::string_view rest = text;  // a disk that fills takes a part, and the next call has the error
    ssize_t count = 0;
    while (!rest.empty() && ((count = write(file, rest.data(), rest.size())) >= 0 || errno == EINTR))
        rest.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    const int error = errno;
    const bool closed = close(file) == 0;
    if (!rest.empty()) errno = error;
    check(rest.empty() && closed);
}

std::string line_of(const nlohmann::ordered_json& json) {
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

void add_failure(const std::filesystem::path& stats, FrameNumber frame, const std::string& what, const Log& log) {
    try {
        append_line(stats, line_of({{"frame", frame}, {"error", what}}));
    } catch (const Error& error) {
        log.warn("{}", error.what());
    }
}

}  // namespace halflight
