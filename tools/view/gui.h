// Dear ImGui in a window: its context, its font and its frames. Dear ImGui samples the state of buttons, and up to 1.88
// of keys, once a frame. This class feeds it from the window's queue of events, so that no press is lost.
#pragma once

#include <bitset>
#include <optional>
#include <string>
#include <vector>

#include "tools/view/actions.h"
#include "tools/view/navigation.h"
#include "tools/view/window.h"
#include "tools/view/window_layout.h"

struct GLFWcursor;

namespace halflight::view {

inline constexpr float kLeastUiScale = 0.5f, kMostUiScale = 4;

/// Owns the context of Dear ImGui. Only one may exist; the window must outlive it.
class Gui {
  public:
    /// scale: factor on the sizes of text and controls; none: that of the monitor.
    Gui(Window& window, std::optional<double> scale);
    Gui(const Gui&) = delete;
    Gui& operator=(const Gui&) = delete;
    ~Gui();

    float scale() const { return scale_; }
    void set_scale(float scale);  ///< Sets the scale from the next frame on, within its limits.
    /// Returns whether a scalable font was found.
    bool has_font() const { return has_font_; }

    /// Starts a frame with the next events of the window; panels can be declared afterwards.
    void begin();
    /// Returns whether further events wait, so that another frame is needed at once.
    bool pending() const { return !window_.events().empty(); }
    void skip();  ///< Ends a frame without drawing it.
    void draw();  ///< Draws the declared panels into the window's framebuffer.

    /// Returns the input of the current frame for the camera. Drags begin and end in the picture.
    Input input(const WindowLayout& layout, const ivec2& picture) const;
    /// Returns the keys pressed since the last frame, unless a text field takes them.
    std::vector<KeyPress> pressed() const;
    /// Returns the number of presses of mouse buttons that frames have seen so far.
    std::size_t clicks() const { return clicks_; }
    dvec2 mouse() const;  ///< Returns the position of the mouse, pixels of the framebuffer.
    /// Returns the time of the oldest event of the current frame, seconds; none without events.
    std::optional<double> event_time() const;
    float text_height() const;  ///< Returns the height of a line of text, pixels of the framebuffer.
    Parts parts() const;        ///< Returns the sizes of menu, status line and side bar.

  private:
    void take(const InputEvent& event);
    void load_font();
    void show_cursor();

    Window& window_;
    float scale_ = 1;
    bool scale_changed_ = true;
    bool has_font_ = false;
    std::size_t clicks_ = 0;
    std::bitset<512> held_;             // keys that are down, by their numbers in GLFW
    std::bitset<512> with_ctrl_;        // keys whose last press was one with Ctrl: they move no camera
    double clock_;                      // time of the last frame, seconds
    std::vector<InputEvent> events_;    // events of the current frame
    std::vector<GLFWcursor*> cursors_;  // by ImGuiMouseCursor; null: the default
};

}  // namespace halflight::view
