// Mouse and keys to movements of the camera.
#pragma once

#include "tools/view/session.h"

namespace halflight::view {

enum class Manner : int { orbit, fly };

/// Between Gui::begin() and draw(), for what the panels leave to it.
class Navigation {
  public:
    Manner manner = Manner::orbit;
    float speed = 1;  // of flying, scene diagonals per ten seconds

    /// Drags, wheel, clicks, W A S D Q E. `size`: of the framebuffer.
    void steer(Session& session, const ivec2& size);
    /// Whether it goes on without anything new happening: a key is held.
    bool moving() const { return moving_; }

  private:
    void fly(Session& session);
    bool moving_ = false;
};

}  // namespace halflight::view
