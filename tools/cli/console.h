// Notes and warnings on stderr, one line each. main() shows errors.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>

#include "api/halflight/log.h"
#include "engine/core/one_line.h"

namespace halflight {

/// Writes `text` to `stream` unchanged. Failures are ignored: a closed or full stderr must not lose a picture.
void put(std::FILE* stream, std::string_view text);

/// Prints "halflight: WHAT" on stderr as one line. Returns `status`, for main().
int fail(int status, std::string_view what);

/// Opens /dev/null, read-only, for closed standard streams. Otherwise the first opened file would get the stream's
/// number, and with it the stream's output. Writing to such a stream still fails.
void hold_standard_streams();

/// Prints notes and warnings on stderr, one line each; prints nothing if quiet.
class Console : public Log {
  public:
    explicit Console(bool quiet);
};

}  // namespace halflight
