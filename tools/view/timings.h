// How soon pictures are seen.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/view/render_thread.h"

namespace halflight::view {

class Timings {
  public:
    /// A picture is on the window; `seconds` of any clock.
    void shown(const Picture& picture, double seconds);
    /// `seconds` at which a request was made.
    void requested(std::uint64_t number, double seconds);
    void forget() { *this = {}; }

    /// Seconds from the input to the first picture of it on the window (median, 95 %, most), pictures per second over
    /// first pictures, how coarse they were, and the last whole picture's samples, age and, where there is one, its
    /// estimated relMSE.
    nlohmann::ordered_json json() const;

  private:
    std::map<std::uint64_t, double> open_;  // requests without a picture, when they were made
    std::vector<double> latencies_;         // seconds, of first pictures
    std::vector<int> divisors_;             // of the same
    double first_ = 0, last_ = 0;           // when the first and the last first picture were shown
    int samples_ = 0;                       // of the last whole picture
    double age_ = 0;                        // its Picture::seconds
    std::optional<double> relmse_;          // and Picture::relmse
};

}  // namespace halflight::view
