#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/rays/native_trace.cpp"
#include <hwy/foreach_target.h>
// Highway compiles the code below once per instruction set.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cfenv>
#include <cmath>
#include <concepts>
#include <cstring>
#include <memory>

#include "engine/rays/native_trace.h"
#if HWY_MAX_BYTES >= 32
#include "engine/rays/native_tile-inl.h"
#endif

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

#if HWY_MAX_BYTES >= 32

constexpr bool kAvailable = true;

template <class Bound, bool kAny>
void trace_entries(const NativeJob& job, std::size_t begin, std::size_t end, std::vector<std::uint32_t>& delegated) {
    const NativeTree& tree = *job.tree;
    static_assert(kLanes >= 8, "blockers_of() counts vectors of 8 rays");
    assert(begin % kBundle == 0 && (!kAny || !job.together || job.blockers));
    std::vector<StackEntry> stacks((kAny ? 1 : 2) * tree.stack_entries);
    const auto open = std::make_unique<OpenSearches<Bound, kAny>>(job, delegated);
    std::vector<TileEntry> tile_stack(kAny ? tree.stack_entries : 0);
    StackEntry* const stack = stacks.data();
    for (std::size_t from = begin; from < end; from += kBundle) {
        std::array<std::uint32_t, kBundle> paths;
        const std::size_t count = std::min(kBundle, end - from);
        for (std::size_t i = 0; i < count; ++i)
            paths[i] = job.list ? job.list[from + i] : static_cast<std::uint32_t>(from + i);
        if (!job.together || job.slivers) {
            open_rays<Bound, kAny>(job, paths.data(), count, *open, delegated);
        } else if constexpr (kAny) {
            trace_tile<Bound>(job, paths.data(), count, job.blockers + from / kLanes, tile_stack.data(), stack, *open,
                              delegated);
        } else {
            trace_bundle<Bound>(job, paths.data(), count, stack, stack + tree.stack_entries, delegated);
        }
    }
    open->run(open->kOpen);
}

void trace(const NativeJob& job, std::size_t begin, std::size_t end, std::vector<std::uint32_t>& delegated) {
    const bool grid = job.tree->format == NodeFormat::grid;
    const auto run = grid ? (job.any_hit ? trace_entries<std::uint16_t, true> : trace_entries<std::uint16_t, false>)
                          : (job.any_hit ? trace_entries<float, true> : trace_entries<float, false>);
    run(job, begin, end, delegated);
}

#else

constexpr bool kAvailable = false;
void trace(const NativeJob&, std::size_t, std::size_t, std::vector<std::uint32_t>&) {}

#endif

bool available() {
    return kAvailable;
}

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace halflight::rays {
namespace {
HWY_EXPORT(trace);
HWY_EXPORT(available);
}  // namespace

bool can_trace_natively() {
    return HWY_DYNAMIC_DISPATCH(available)();
}

void trace_native(const NativeJob& job, std::size_t begin, std::size_t end, std::vector<std::uint32_t>& delegated) {
    // Small numbers must not be flushed to zero, as they are not in the driver's kernels.
    std::fenv_t environment;
    std::fegetenv(&environment);
    std::fesetenv(FE_DFL_ENV);
    HWY_DYNAMIC_DISPATCH(trace)(job, begin, end, delegated);
    std::fesetenv(&environment);
}

}  // namespace halflight::rays

#endif
