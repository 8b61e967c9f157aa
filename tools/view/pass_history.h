// How long each pass takes, sample after sample.
#pragma once

#include <string>
#include <vector>

#include "tools/view/render_thread.h"

namespace halflight::view {

class PassHistory {
  public:
    static constexpr std::size_t kLength = 120;  // points that are kept of each pass

    struct Pass {
        std::string name;
        std::vector<float> milliseconds;  // per sample, since the picture before; oldest first
    };

    /// A whole picture with times of passes (Request::measure); of others nothing is taken.
    void add(const Picture& picture);
    const std::vector<Pass>& passes() const { return passes_; }  ///< of the picture that was added last, in its order

  private:
    std::vector<Pass> passes_;
    int samples_ = 0;              // of the last picture
    std::vector<double> seconds_;  // of its passes
};

}  // namespace halflight::view
