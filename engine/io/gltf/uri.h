// URIs of glTF: relative paths and data (RFC 3986, RFC 2397).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace halflight {

/// %41 becomes A; a % that no two hexadecimal digits follow stays.
std::string percent_decode(std::string_view text);

/// The scheme in lower case ("https", "data"); empty for a relative reference or a path.
std::string uri_scheme(std::string_view uri);

/// The bytes of "data:[type][;base64],..."; nothing where it is malformed.
std::optional<std::string> decode_data_uri(std::string_view uri);

}  // namespace halflight
