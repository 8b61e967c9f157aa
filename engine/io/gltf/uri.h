// URIs in glTF: relative paths and data (RFC 3986, RFC 2397).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace halflight {

/// Decodes %41 to A and so on; a % without two hexadecimal digits stays.
std::string percent_decode(std::string_view text);

/// Returns the scheme in lower case ("https", "data"); empty for a relative reference or a path.
std::string uri_scheme(std::string_view uri);

/// Decodes "data:[type][;base64],..."; returns nothing where it is malformed.
std::optional<std::string> decode_data_uri(std::string_view uri);

}  // namespace halflight
