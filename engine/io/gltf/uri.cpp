#include "engine/io/gltf/uri.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

namespace halflight {
namespace {

constexpr char lower(char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

constexpr bool is_letter(char c) {
    return lower(c) >= 'a' && lower(c) <= 'z';
}

constexpr std::string_view kSpace = " \t\r\n\f";

/// Decodes base64 (RFC 4648, section 4). Padding is optional, and white space is skipped.
std::optional<std::string> decode_base64(std::string_view text) {
    static constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    static constexpr std::int8_t kSkipped = -1, kPadding = -2, kInvalid = -3;
    static const auto kValues = [] {
        std::array<std::int8_t, 256> values{};
        values.fill(kInvalid);
        for (const char c : kSpace) values[static_cast<unsigned char>(c)] = kSkipped;
        values['='] = kPadding;
        for (std::size_t i = 0; i < kDigits.size(); ++i)
            values[static_cast<unsigned char>(kDigits[i])] = static_cast<std::int8_t>(i);
        return values;
    }();
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int count = 0, padding = 0;  // bits that are not in `bytes` yet; characters '='
    for (const char c : text) {
        const int value = kValues[static_cast<unsigned char>(c)];
        if (value == kSkipped) continue;
        if (value == kPadding) ++padding;
        if (value == kPadding && padding <= 2) continue;
        if (value < 0 || padding > 0) return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes.push_back(static_cast<char>(bits >> count & 0xff));
    }
    if (count == 6) return std::nullopt;  // a single digit is less than a byte
    return bytes;
}

/// Returns whether the header of a data URI ends with "base64", which is no parameter but an extension (RFC 2397).
bool is_base64(std::string_view header) {
    const auto last = [&] { return header.substr(0, header.find_last_not_of(kSpace) + 1); };
    constexpr std::string_view kName = "base64";
    header = last();
    if (header.size() < kName.size()) return false;
    const std::string_view name = header.substr(header.size() - kName.size());
    header.remove_suffix(kName.size());
    return std::ranges::equal(name, kName, {}, lower) && last().ends_with(';');
}

}  // namespace

std::string percent_decode(std::string_view text) {
    std::string decoded;
    for (std::size_t i = 0; i < text.size(); ++i) {
        unsigned value = 0;
        if (text[i] == '%' && i + 2 < text.size()) {
            const char* end = text.data() + i + 3;
            if (std::from_chars(text.data() + i + 1, end, value, 16).ptr == end) {
                decoded.push_back(static_cast<char>(value));
                i += 2;
                continue;
            }
        }
        decoded.push_back(text[i]);
    }
    return decoded;
}

std::string uri_scheme(std::string_view uri) {
    uri.remove_prefix(std::min(uri.find_first_not_of(kSpace), uri.size()));
    const std::size_t colon = uri.find(':');
    if (colon == std::string_view::npos || colon == 0 || !is_letter(uri[0])) return "";
    std::string scheme(uri.substr(0, colon));
    for (char& c : scheme) {
        const bool allowed = is_letter(c) || (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.';
        if (!allowed) return "";
        c = lower(c);
    }
    return scheme;
}

std::string_view without_query(std::string_view uri) {
    return uri.substr(0, uri.find_first_of("?#"));
}

std::optional<std::string> decode_data_uri(std::string_view uri) {
    uri = uri.substr(0, uri.find('#'));
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos) return std::nullopt;
    const std::string_view data = uri.substr(comma + 1);
    if (!is_base64(uri.substr(0, comma))) return percent_decode(data);
    return data.find('%') == std::string_view::npos ? decode_base64(data) : decode_base64(percent_decode(data));
}

}  // namespace halflight
