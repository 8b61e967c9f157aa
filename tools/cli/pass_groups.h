// The render graph in a short form: a row for each group of passes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/render_result.h"

namespace halflight {

/// Passes whose names have the same beginning: "shadow rays" holds "shadow rays: any hit" and others.
struct PassGroup {
    std::string name;
    std::size_t passes = 0;  // number of passes with different names
    std::uint64_t runs = 0;  // number of runs of all of them
    double seconds = 0;      // time of all runs, seconds
    double share = 0;        // share of the time of all groups
};

/// Returns the name of a pass's group.
std::string_view group_of(std::string_view pass);
/// Returns the groups in the order of their first passes.
std::vector<PassGroup> pass_groups(std::span<const PassTime> passes);
/// Returns the groups as a table of text, with a last row for the sum.
std::string pass_table(std::span<const PassTime> passes);

}  // namespace halflight
