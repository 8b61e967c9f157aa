// Dear ImGui in a window: its context, and its frames.
#pragma once

#include "tools/view/navigation.h"
#include "tools/view/window.h"

namespace halflight::view {

/// One at a time; the window must outlive it.
class Gui {
  public:
    explicit Gui(Window& window);
    Gui(const Gui&) = delete;
    Gui& operator=(const Gui&) = delete;
    ~Gui();

    void begin();         ///< from here on panels can be declared
    Input input() const;  ///< of the frame that has begun
    void draw();          ///< what was declared, onto the window's framebuffer
};

}  // namespace halflight::view
