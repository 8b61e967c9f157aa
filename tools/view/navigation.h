// Camera movement by mouse and keys. Needs no window.
#pragma once

#include <optional>

#include "tools/view/session.h"

namespace halflight::view {

enum class NavigationMode : int { orbit, fly, walk };  // walk: horizontal, whatever the line of sight

/// Input since the last frame, without the events that panels used.
struct Input {
    dvec2 drag{0};  // movement of the mouse to the right and down, relative to the window's height
    bool left = false, middle = false, right = false, shift = false;  // whether button or key is held
    bool fast = false;                                                // whether Shift is held, also over panels
    double wheel = 0;                                                 // wheel movement away from the user, notches
    std::optional<dvec2> double_click{};                              // position, pixels of the framebuffer
    dvec3 movement{0};                                                // -1, 0 or 1 by the keys held: right, up, ahead
    double seconds = 0;                                               // time since the last frame, seconds
};

inline constexpr float kLeastSpeed = 0.001f, kMostSpeed = 10000;  ///< limits of Navigation::speed
inline constexpr float kFast = 4;                                 ///< factor on the speed while Shift is held

class Navigation {
  public:
    NavigationMode mode = NavigationMode::orbit;
    float speed = 1;  // speed of flying and walking, metres per second

    /// Sets a speed in proportion to the distances that the camera sees.
    void suit(const Session& session);

    /// Moves the session's camera. `size` is the framebuffer's, pixels. Throws what Session::move() throws.
    void steer(Session& session, const Input& input, const ivec2& size);
    /// Returns whether the camera keeps moving without further events because a key is held.
    bool moving() const { return moving_; }

  private:
    bool moving_ = false;
};

}  // namespace halflight::view
