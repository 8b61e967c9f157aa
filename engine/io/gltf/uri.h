// URIs in glTF: relative paths and data (RFC 3986, RFC 2397).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace halflight {

/// Decodes %41 to A and so on; a % without two hexadecimal digits stays.
std::string percent_decode(std::string_view text);

/// Returns the scheme in lower case ("https", "data"); empty for a relative reference or a path. Skips leading spaces.
std::string uri_scheme(std::string_view uri);

/// Returns the URI up to its query (?) and fragment (#).
std::string_view without_query(std::string_view uri);

/// Decodes "data:[type][;name=value]...[;base64],..."; returns nothing if it is malformed. The data may have percent
/// escapes, also in base64. The word base64 has any case, and a fragment (#) is no data.
std::optional<std::string> decode_data_uri(std::string_view uri);

}  // namespace halflight
