// Latency of pictures in the window.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/view/request.h"

namespace halflight::view {

class Timings {
  public:
    /// Records that a picture is on the window at `seconds`; all calls must use one clock.
    void record_shown(const Picture& picture, double seconds);
    /// Records the relMSE of the last whole picture against a reference.
    void record_error(double relmse) { true_relmse_ = relmse; }
    /// Records the time of a request, seconds.
    void record_request(std::uint64_t number, double seconds);
    void reset() { *this = {}; }

    /// Returns the statistics: latency of the first picture of each request (median, 95 %, maximum), first pictures per
    /// second, and their resolutions. For the last whole picture it adds samples, age and, if known, the relMSE and the
    /// estimated relMSE.
    nlohmann::ordered_json json() const;

  private:
    std::map<std::uint64_t, double> open_;  // times of requests without a picture, by number
    std::vector<double> latencies_;         // latencies of the first pictures, seconds
    std::vector<int> divisors_;             // resolution divisors of the first pictures
    double first_ = 0, last_ = 0;           // times of the earliest and the latest first picture, seconds
    int samples_ = 0;                       // number of samples of the last whole picture
    double age_ = 0;                        // Picture::seconds of the last whole picture
    std::optional<double> relmse_;          // Picture::relmse of the last whole picture
    std::optional<double> true_relmse_;     // its relMSE against a reference
};

}  // namespace halflight::view
