// Mouse and keys to movements of the camera. No window.
#pragma once

#include <optional>

#include "tools/view/session.h"

namespace halflight::view {

enum class Manner : int { orbit, fly, walk };  // walk: as a person does, wherever it looks

/// Since the last frame, without what the panels took for themselves.
struct Input {
    dvec2 drag{0};  // way of the mouse, right and down, in heights of the window
    bool left = false, middle = false, right = false, shift = false;  // held
    double wheel = 0;                                                 // notches, away from the user
    std::optional<dvec2> double_click{};                              // where, pixels of the framebuffer
    dvec3 way{0};                                                     // -1, 0 or 1 by the keys held: right, up, ahead
    double seconds = 0;                                               // since the last frame
};

class Navigation {
  public:
    Manner manner = Manner::orbit;
    float speed = 1;  // of flying and walking, scene diagonals per ten seconds

    /// `size`: of the framebuffer, pixels. Throws what Session::move() throws.
    void steer(Session& session, const Input& input, const ivec2& size);
    /// Whether it goes on without anything new happening: a key is held.
    bool moving() const { return moving_; }

  private:
    bool moving_ = false;
};

}  // namespace halflight::view
