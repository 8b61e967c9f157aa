// Alias tables choose among weighted entries in constant time (Walker 1977; built after Vose 1991).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace halflight {

/// An entry, chosen uniformly, stands for itself if a uniform number in [0, 1) is below `threshold`, else for
/// `alias`.
struct AliasEntry {
    float threshold = 1;  // share of the entry itself, [0, 1], a multiple of 2^-24 like the shaders' numbers
    std::uint32_t alias = 0;
};

struct AliasTable {
    std::vector<AliasEntry> entries;
    /// Probabilities that the entries realise. They differ from the weights by rounding and are > 0 if the weight is.
    std::vector<double> probabilities;
};

/// Returns the table of the weights. Precondition: fewer than 2^32 weights, finite and >= 0, one of them > 0.
AliasTable build_alias_table(std::span<const double> weights);

}  // namespace halflight
