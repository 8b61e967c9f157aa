#include "tools/view/pass_history.h"

#include <algorithm>
#include <utility>

namespace halflight::view {

void PassHistory::add(const Picture& picture) {
    const RenderStats& stats = picture.result.stats;
    if (picture.divisor != 1 || stats.passes.empty() || (stats.samples == samples_ && samples_ > 1)) return;
    const auto same = [](const Pass& a, const PassTime& b) { return a.name == b.name; };
    // Pass times are summed from a view's first sample on, which is always published as a picture.
    const bool goes_on = stats.samples > samples_ && std::ranges::equal(passes_, stats.passes, same);
    const int samples = stats.samples - (goes_on ? samples_ : 0);
    std::vector<Pass> passes;
    std::vector<double> seconds;
    for (std::size_t i = 0; i < stats.passes.size(); ++i) {
        const PassTime& time = stats.passes[i];
        const auto known = std::ranges::find(passes_, time.name, &Pass::name);
        Pass pass = known == passes_.end() ? Pass{time.name, {}} : std::move(*known);
        const double before = goes_on ? seconds_[i] : 0;
        if (pass.milliseconds.size() == kLength) pass.milliseconds.erase(pass.milliseconds.begin());
        pass.milliseconds.push_back(static_cast<float>(1e3 * (time.seconds - before) / samples));
        passes.push_back(std::move(pass));
        seconds.push_back(time.seconds);
    }
    passes_ = std::move(passes), seconds_ = std::move(seconds), samples_ = stats.samples;
}

}  // namespace halflight::view
