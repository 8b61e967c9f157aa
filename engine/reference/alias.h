// Discrete choice in constant time.
#pragma once

#include <cstddef>
#include <vector>

namespace halflight::reference {

/// Vose's alias method (1991): entry i is chosen with probability weight[i] / sum.
class AliasTable {
  public:
    AliasTable() = default;
    /// Builds the table. Weights are finite and >= 0. If all are zero, the table is empty().
    explicit AliasTable(const std::vector<double>& weights);

    bool empty() const { return entries_.empty(); }
    double probability(std::size_t i) const { return empty() ? 0 : entries_[i].probability; }
    /// Selects an entry by `u`, uniform in [0, 1); replaces `u` by a new uniform number.
    std::size_t choose(double& u) const;

  private:
    struct Entry {
        double keep = 1;  // share of this slot that selects its own index
        std::size_t alias = 0;
        double probability = 0;
    };
    std::vector<Entry> entries_;
};

}  // namespace halflight::reference
