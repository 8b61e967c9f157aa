#include "engine/core/suggestion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>

namespace halflight {
namespace {

bool same(char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
}

/// Returns the optimal string alignment distance: the number of mistakes that turn one word into the other one.
std::size_t mistakes(std::string_view a, std::string_view b) {
    // Rows of the table for the prefix of `a` with two letters less, with one letter less, and with all its letters.
    std::array<std::vector<std::size_t>, 3> rows;
    rows.fill(std::vector<std::size_t>(b.size() + 1));
    std::iota(rows[2].begin(), rows[2].end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::rotate(rows.begin(), rows.begin() + 1, rows.end());  // clang 14 cannot compile std::ranges::rotate
        auto& [before, above, row] = rows;
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t wrong = same(a[i - 1], b[j - 1]) ? 0 : 1;
            row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + wrong});
            const bool swapped = i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]);
            if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
        }
    }
    return rows[2][b.size()];
}

}  // namespace

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
    constexpr std::size_t kLongest = 64;  // longer words are no misspelt names
    std::size_t fewest = std::min(word.size(), kLongest) / 3 + 1;
    const std::string* best = nullptr;
    for (const std::string& candidate : candidates) {
        if (word.size() > kLongest || candidate.size() > kLongest) continue;
        const std::size_t number = mistakes(word, candidate);
        if (number < fewest) fewest = number, best = &candidate;
    }
    return best ? fmt::format("; did you mean '{}'?", *best) : "";
}

}  // namespace halflight
