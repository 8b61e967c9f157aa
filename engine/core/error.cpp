#include "engine/core/error.h"

namespace halflight {
namespace {

bool is_control(char c) {
    return static_cast<unsigned char>(c) < ' ' || c == 0x7f;
}

/// Returns "subject: what" without line breaks and control characters. Messages of libraries may span lines, and may
/// repeat bytes of a file that a terminal would obey.
std::string one_line(std::string_view subject, std::string_view what) {
    std::string line(subject);
    if (!line.empty()) line += ": ";
    line += what;
    while (!line.empty() && (line.back() == '\n' || line.back() == ' ')) line.pop_back();
    for (char& c : line) {
        if (c == '\n' || c == '\r' || c == '\t') c = ' ';
        if (is_control(c)) c = '?';
    }
    return line;
}

}  // namespace

Error::Error(std::string_view subject, std::string_view what) : std::runtime_error(one_line(subject, what)) {}

}  // namespace halflight
