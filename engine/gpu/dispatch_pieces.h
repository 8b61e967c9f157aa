// Splitting of dispatches, since display watchdogs reset devices whose work takes too long.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

#include "engine/gpu/shader_source.h"

namespace halflight::gpu {

using GroupCounts = std::array<std::uint32_t, 3>;  // workgroups along x, y and z

/// Returns the text of a compute shader whose workgroups can be started in pieces. The uniform `halflight_first_group`
/// is added to gl_WorkGroupID, and `halflight_groups` replaces gl_NumWorkGroups unless it is 0.
ExpandedSource with_pieces(ExpandedSource source);

/// Returns the longest time of a dispatch in seconds, 0: any. It is 50 ms on hardware. Software drivers have no
/// watchdog. The environment variable HALFLIGHT_DISPATCH_MS sets it, in milliseconds. Throws Error if that is not a
/// number.
double dispatch_limit(std::string_view renderer);

/// Workgroups that the next dispatch of a program may have, which follow from the times of earlier ones. Dispatches are
/// timed until their pieces stay as they are, and then from time to time.
class PieceSize {
  public:
    /// `seconds` is the longest time of a dispatch, > 0.
    explicit PieceSize(double seconds) : limit_(seconds) {}

    /// Returns the most workgroups of the next piece, > 0.
    std::uint64_t groups() const { return groups_; }
    /// Returns whether the next piece is to be timed.
    bool timed() const { return settled_ < kSettled || untimed_ >= kEvery; }
    void add_untimed() { ++untimed_; }
    /// Takes the time of a piece that was started as one dispatch.
    void add(std::uint64_t groups, double seconds);
    /// Returns whether at most `groups` workgroups may be started without their number being known.
    bool takes_all_of(std::uint64_t groups) const { return !timed() && groups <= groups_; }

  private:
    static constexpr std::uint64_t kFirst = 256, kGrowth = 4, kMost = std::uint64_t{1} << 40;
    static constexpr int kSettled = 4, kEvery = 16;

    double limit_;
    std::uint64_t groups_ = kFirst;
    int settled_ = 0;  // timed pieces since the size was last reduced, or grew as far as allowed
    int untimed_ = 0;  // pieces since the last timed one
};

/// Calls `start` for pieces of a dispatch, each with its first workgroup and its counts. Together they are all
/// workgroups, each once. A piece has whole slices or rows if that is possible.
void for_each_piece(const GroupCounts& counts, const std::function<std::uint64_t()>& most,
                    const std::function<void(const GroupCounts& first, const GroupCounts& counts)>& start);

}  // namespace halflight::gpu
