// A picture whose pixels have different numbers of samples, because regions of it took more than the rest.
#pragma once

#include <string>
#include <vector>

#include "engine/settings/data_window.h"
#include "renderer/render_result.h"

namespace halflight::view {

/// Owns the pixels that stand while a region takes samples, with all layers that may be shown.
class StandingPicture {
  public:
    /// Returns the number of samples of the last whole picture that was taken; 0: none.
    int whole_samples() const { return static_cast<int>(whole_); }
    const RenderResult& picture() const { return picture_; }
    bool has(const std::vector<std::string>& aovs) const;  ///< Returns whether it has these layers.
    /// Returns the least and the largest number of samples of the pixels of a window.
    int least(const PixelWindow& window) const;
    int most(const PixelWindow& window) const;

    /// Copies the pixels that have more samples here into a whole picture, layer by layer.
    void lay_over(RenderResult& whole) const;
    /// Takes the pixels of a whole picture, except for those that have more samples here.
    void take(RenderResult whole);
    /// Returns the picture with further samples of a window, as far as `part` has its layers. The picture of the window
    /// is the mean, weighted by numbers of samples. Layers without a mean, and mattes, stay.
    RenderResult with(const RenderResult& part, const PixelWindow& window) const;
    /// Keeps the samples of with().
    void add(const RenderResult& part, const PixelWindow& window);

  private:
    RenderResult picture_;
    std::vector<std::uint32_t> samples_;  // number of samples by pixel
    std::uint32_t whole_ = 0, most_ = 0;
};

}  // namespace halflight::view
