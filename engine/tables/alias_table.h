// Choice among weighted entries in constant time (Walker 1977; built as by Vose 1991).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace halflight {

/// Pick entry i uniformly; keep it where a uniform number in [0, 1) is below `threshold`, else take `alias`.
struct AliasEntry {
    float threshold = 1;  // [0, 1], a multiple of 2^-24, which is what the shaders' uniform numbers are
    std::uint32_t alias = 0;
};

struct AliasTable {
    std::vector<AliasEntry> entries;
    /// What the entries really give, which differs from the weights by rounding: > 0 exactly where the weight is.
    std::vector<double> probabilities;
};

/// Precondition: weights are finite and >= 0, one of them is > 0, fewer than 2^32.
AliasTable build_alias_table(std::span<const double> weights);

}  // namespace halflight
