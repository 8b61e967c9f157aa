// Suggestions for misspelt names in messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace halflight {

/// Returns "; did you mean 'NAME'?" with the candidate that is most like `word`, or nothing if none is alike.
/// Candidates are alike up to one mistake for every three characters: a letter too many, missing, wrong, or swapped
/// with the next one (optimal string alignment distance). Upper and lower case are the same.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace halflight
