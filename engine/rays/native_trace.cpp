#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/rays/native_trace.cpp"
#include <hwy/foreach_target.h>
// The targets follow.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cfenv>
#include <cmath>
#include <concepts>
#include <cstring>

#include "engine/rays/native_trace.h"
#if HWY_MAX_BYTES >= 32
#include "engine/rays/native_bundle-inl.h"
#endif

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

#if HWY_MAX_BYTES >= 32

constexpr bool kAvailable = true;

HWY_INLINE void write(const NativeJob& job, std::uint32_t path, const Search& search) {
    if (job.any_hit) {
        static_cast<std::uint32_t*>(job.results)[path] = search.found ? shared::kOccluded : shared::kFree;
    } else {
        static_cast<Hit*>(job.results)[path] =
            search.found ? search.nearest : Hit{kInfinity, 0, 0, shared::kMiss, shared::kMiss};
    }
}

constexpr int kMostSteps = 200;  // nodes and leaves after which the rays of a bundle are traced singly

template <class Bound, bool kAny>
void trace_entries(const NativeJob& job, std::size_t begin, std::size_t end, std::vector<std::uint32_t>& delegated) {
    const NativeTree& tree = *job.tree;
    const NativeSpace& space = tree.spaces.front();
    std::vector<StackEntry> stacks(2 * tree.stack_entries);
    StackEntry *const stack = stacks.data(), *const other_stack = stack + tree.stack_entries;
    Bundle b;
    for (std::size_t from = begin; from < end; from += kBundle) {
        std::array<std::uint32_t, kBundle> paths;
        const std::size_t count = std::min(kBundle, end - from);
        for (std::size_t i = 0; i < count; ++i)
            paths[i] = job.list ? job.list[from + i] : static_cast<std::uint32_t>(from + i);
        set_rays(b, job, space, paths.data(), count);
        ShaftTest shaft;
        const bool on_grid = tree.format == NodeFormat::grid;
        const bool whole = job.bundles && !job.slivers && b.live != 0 && make_shaft(b, space, on_grid, shaft) &&
                           search_bundle<Bound, kAny>(job, b, shaft, stack, other_stack, kMostSteps);
        if (!whole) {
            for (std::uint64_t left = b.live; left != 0; left &= left - 1) {
                const auto i = static_cast<std::size_t>(std::countr_zero(left));
                if (b.exit[i] >= 0)
                    search_one<Bound, kAny>(job, b, i, space.root, std::bit_cast<std::int32_t>(b.t_min[i]), stack);
            }
        }
        for (std::size_t i = 0; i < count; ++i) {
            Search search;
            search.nearest = {b.t[i], b.u[i], b.v[i], static_cast<std::uint32_t>(b.triangle[i]),
                              static_cast<std::uint32_t>(b.instance[i])};
            search.found = ((b.found >> i) & 1) != 0;
            search.out_of_range = ((b.out_of_range >> i) & 1) != 0;
            search.asked = b.asked[i];
            if (search.delegated(kAny))
                delegated.push_back(b.path[i]);
            else
                write(job, b.path[i], search);
        }
    }
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
