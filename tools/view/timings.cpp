#include "tools/view/timings.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

namespace halflight::view {
namespace {

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    std::ranges::sort(values);
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace

void Timings::record_request(std::uint64_t number, double seconds) {
    open_[number] = seconds;
}

void Timings::record_shown(const Picture& picture, double seconds) {
    if (picture.divisor == 1) {
        samples_ = picture.samples();
        age_ = picture.seconds;
        relmse_ = picture.relmse;
    }
    const auto request = open_.find(picture.request);
    if (request == open_.end()) return;
    if (latencies_.empty()) first_ = seconds;
    last_ = seconds;
    latencies_.push_back(seconds - request->second);
    divisors_.push_back(picture.divisor);
    open_.erase(open_.begin(), std::next(request));  // earlier requests will not get a picture any more
}

nlohmann::ordered_json Timings::json() const {
    std::map<std::string, int> coarseness;
    for (const int divisor : divisors_) ++coarseness["1/" + std::to_string(divisor)];
    const double span = last_ - first_;
    nlohmann::ordered_json last{{"samples", samples_}, {"seconds", age_}};
    if (relmse_) last["estimated_relmse"] = *relmse_;
    if (true_relmse_) last["relmse"] = *true_relmse_;
    return {{"views", latencies_.size()},
            {"seconds_to_first_picture",
             {{"median", quantile(latencies_, 0.5)},
              {"p95", quantile(latencies_, 0.95)},
              {"most", quantile(latencies_, 1)}}},
            {"first_pictures_per_second", span > 0 ? static_cast<double>(latencies_.size() - 1) / span : 0.0},
            {"resolutions", coarseness},
            {"last_picture", last}};
}

}  // namespace halflight::view
