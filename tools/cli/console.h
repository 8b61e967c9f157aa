// Messages of the programs on stderr, one line each, and in a log file. main() shows errors.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "api/halflight/log.h"
#include "engine/core/one_line.h"

namespace halflight {

/// The least important messages that are printed. Each level prints those before it, too.
enum class LogLevel : std::uint8_t { error, warning, note, detail };
/// Returns the level of a name: "error", "warning", "note" or "detail".
std::optional<LogLevel> log_level_named(std::string_view name);

/// Writes `text` to `stream` unchanged. Failures are ignored: a closed or full stderr must not lose a picture.
void put(std::FILE* stream, std::string_view text);

/// Prints "halflight: WHAT" on stderr as one line, and writes it to the log file. Returns `status`, for main().
int fail(int status, std::string_view what);
/// Prints an error of the system as one line, and names the limits if a thread could not be started.
int fail(int status, const std::system_error& error);

/// Opens the log file of the process. Messages of all levels are appended to it, each with date and time (UTC). Throws
/// Error if it cannot be opened.
void open_log(const std::filesystem::path& file);
/// Throws Error if a message could not be written to the log file.
void check_log();

/// Opens /dev/null, read-only, for closed standard streams. Otherwise the first opened file would get the stream's
/// number, and with it the stream's output. Writing to such a stream still fails.
void hold_standard_streams();

/// Prints the messages of a level on stderr, one line each, and writes all messages to the log file.
class Console : public Log {
  public:
    explicit Console(LogLevel level);
};

}  // namespace halflight
