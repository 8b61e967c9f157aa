// Dear ImGui in a window: its context and its frames.
#pragma once

#include "tools/view/navigation.h"
#include "tools/view/window.h"

namespace halflight::view {

/// Owns the context of Dear ImGui. Only one may exist; the window must outlive it.
class Gui {
  public:
    explicit Gui(Window& window);
    Gui(const Gui&) = delete;
    Gui& operator=(const Gui&) = delete;
    ~Gui();

    void begin();         ///< Starts a frame; panels can be declared afterwards.
    Input input() const;  ///< Returns the input of the current frame.
    void draw();          ///< Draws the declared panels into the window's framebuffer.
};

}  // namespace halflight::view
