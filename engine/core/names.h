// Names: lists of them as text, and those of enumerators.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

/// Returns the parts of a list, "a,b" by default; one empty part for an empty list.
inline std::vector<std::string> split_names(std::string_view list, std::string_view separators = ",") {
    std::vector<std::string> names;
    for (std::size_t from = 0, to = 0; from <= list.size(); from = to + 1) {
        to = std::min(list.find_first_of(separators, from), list.size());
        names.emplace_back(list.substr(from, to - from));
    }
    return names;
}

/// Returns the name of a value: names[i] of values[i]. Returns "unknown" if it is none of the values.
template <class Enum, std::size_t N>
const char* name_among(const Enum (&values)[N], const char* const (&names)[N], Enum value) {
    const auto found = std::ranges::find(values, value);
    return found == std::ranges::end(values) ? "unknown" : names[found - values];
}

/// Returns the first N enumerators, for tables with rows in their order.
template <class Enum, std::size_t N>
constexpr std::array<Enum, N> first_enumerators() {
    std::array<Enum, N> all{};
    for (std::size_t i = 0; i < N; ++i) all[i] = static_cast<Enum>(i);
    return all;
}

}  // namespace halflight
