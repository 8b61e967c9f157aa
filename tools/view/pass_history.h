// Times of the passes, sample by sample.
#pragma once

#include <string>
#include <vector>

#include "tools/view/request.h"

namespace halflight::view {

class PassHistory {
  public:
    static constexpr std::size_t kLength = 120;  // maximum number of points per pass

    struct Pass {
        std::string name;
        std::vector<float> milliseconds;  // times per sample since the previous picture, oldest first
    };

    /// Adds a whole picture with pass times (Request::measure); ignores other pictures.
    void add(const Picture& picture);
    const std::vector<Pass>& passes() const { return passes_; }  ///< Returns the last picture's passes, in its order.

  private:
    std::vector<Pass> passes_;
    int samples_ = 0;              // samples of the last picture
    std::vector<double> seconds_;  // times of the last picture's passes
};

}  // namespace halflight::view
