#include "engine/gpu/dispatch_pieces.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/context.h"

namespace halflight::gpu {
namespace {

// The lines come before all others but #version. gl_WorkGroupSize is known where the macros are used.
constexpr std::string_view kDeclarations[] = {
    "uniform uvec3 halflight_first_group;",
    "uniform uvec3 halflight_groups;",
    "#define halflight_WorkGroupID (gl_WorkGroupID + halflight_first_group)",
    "#define halflight_GlobalInvocationID (gl_GlobalInvocationID + halflight_first_group * gl_WorkGroupSize)",
    "#define halflight_NumWorkGroups (halflight_groups.x == 0u ? gl_NumWorkGroups : halflight_groups)",
};
constexpr std::string_view kReplaced[] = {"WorkGroupID", "GlobalInvocationID", "NumWorkGroups"};

/// Replaces the prefix of the built-in inputs, gl_, by halflight_.
std::string renamed(std::string_view text) {
    constexpr std::string_view kPrefix = "gl_";
    std::string result;
    result.reserve(text.size() + 64);
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t found = std::min(text.find(kPrefix, at), text.size());
        result += text.substr(at, found - at);
        if (found == text.size()) break;
        const std::string_view rest = text.substr(found + kPrefix.size());
        const bool begins = found == 0 || !in_identifier(text[found - 1]);
        const bool replaces =
            begins && std::ranges::any_of(kReplaced, [&](std::string_view name) {
                return rest.starts_with(name) && (rest.size() == name.size() || !in_identifier(rest[name.size()]));
            });
        result += replaces ? "halflight_" : kPrefix;
        at = found + kPrefix.size();
    }
    return result;
}

}  // namespace

ExpandedSource with_pieces(ExpandedSource source) {
    const std::size_t version = source.text.find('\n') + 1;
    std::string text = source.text.substr(0, version);
    for (const std::string_view line : kDeclarations) (text += line) += '\n';
    text += renamed(std::string_view(source.text).substr(version));
    source.text = std::move(text);
    source.lines.insert(source.lines.begin(), std::size(kDeclarations), {0, 1});
    return source;
}

double dispatch_limit(std::string_view renderer) {
    constexpr double kHardware = 0.05;
    const char* const asked = std::getenv("HALFLIGHT_DISPATCH_MS");
    if (asked == nullptr) return is_software_renderer(renderer) ? 0 : kHardware;
    const std::string_view text(asked);
    double milliseconds = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), milliseconds);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(milliseconds) || milliseconds < 0)
        throw Error("HALFLIGHT_DISPATCH_MS", "'{}' is not a number of milliseconds, 0 or more", text);
    return milliseconds / 1000;
}

void PieceSize::add(std::uint64_t groups, double seconds) {
    untimed_ = 0;
    // A piece aims at half of the limit, since the cost of workgroups differs. Small pieces tell little, so the size
    // grows in steps.
    const double each = std::max(seconds, 1e-9) / static_cast<double>(groups);
    const double fitting = std::clamp(0.5 * limit_ / each, 1.0, static_cast<double>(kMost));
    const auto wanted = static_cast<std::uint64_t>(fitting);
    // The time of a small dispatch is mostly that of its start, which says nothing about a large one.
    if (wanted < groups_ && groups < groups_ / 8 && seconds < limit_ / 8) {
        ++settled_;
    } else if (wanted < groups_) {
        settled_ = seconds > limit_ ? 0 : settled_ + 1;
        groups_ = wanted;
    } else {
        ++settled_;
        groups_ = std::max(groups_, std::min(wanted, kGrowth * groups));
    }
}

void for_each_piece(const GroupCounts& counts, const std::function<std::uint64_t()>& most,
                    const std::function<void(const GroupCounts& first, const GroupCounts& counts)>& start) {
    const auto [x, y, z] = counts;
    if (x == 0 || y == 0 || z == 0) return;
    const std::uint64_t row = x, slice = row * y;
    GroupCounts at{};
    while (at[2] < z) {
        const std::uint64_t allowed = std::max<std::uint64_t>(most(), 1);
        const auto fit = [&](std::uint64_t size, std::uint32_t left) {
            return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(allowed / size, 1, left));
        };
        GroupCounts piece;
        if (at[0] == 0 && at[1] == 0 && allowed >= slice) {
            piece = {x, y, fit(slice, z - at[2])};
            start(at, piece);
            at[2] += piece[2];
        } else if (at[0] == 0 && allowed >= row) {
            piece = {x, fit(row, y - at[1]), 1};
            start(at, piece);
            at[1] += piece[1];
        } else {
            piece = {fit(1, x - at[0]), 1, 1};
            start(at, piece);
            at[0] += piece[0];
            if (at[0] == x) at[0] = 0, ++at[1];
        }
        if (at[1] == y) at[1] = 0, ++at[2];
    }
}

}  // namespace halflight::gpu
