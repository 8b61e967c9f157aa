// A desktop window with an OpenGL 4.5 core context, and its events.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"
#include "tools/view/events.h"

struct GLFWwindow;

namespace halflight::view {

/// Owns the window and its context, which is current on the main thread during its lifetime. Only one may exist.
class Window {
  public:
    /// Opens a window. Throws Error with the reason if there is no display or no such context.
    explicit Window(const std::string& title);
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;
    ~Window();

    GLFWwindow* handle() const { return window_; }
    ivec2 size() const;              ///< Returns the size in the coordinates of the window system.
    ivec2 framebuffer_size() const;  ///< Returns the size, pixels; {0, 0} while minimised.
    /// Sets the size of the framebuffer, pixels, and shows the window.
    void resize(const ivec2& size);
    ivec2 largest() const;         ///< Returns the largest size that the monitor has room for, pixels.
    double monitor_scale() const;  ///< Returns the factor of the monitor on sizes of text and controls.
    bool closing() const;          ///< Returns whether the user has asked to close the window.
    void close();                  ///< Asks to close the window, as the user can do.
    void stay_open();              ///< Cancels a request to close the window.
    void set_title(const std::string& title);

    /// Waits for an event, at most this many seconds; returns whether there was one. Input goes to events(), files to
    /// dropped().
    bool wait(double seconds);
    EventQueue& events() { return events_; }
    /// Ends a wait(). May be called from any thread while there is a window.
    static void wake();
    /// Returns the files dropped since the last call.
    std::vector<std::filesystem::path> dropped();
    void swap();
    /// Returns the framebuffer before swap(): RGB, display-encoded.
    Image read() const;

  private:
    void listen();  // Installs the callbacks of events.
    void add(InputEvent event);

    GLFWwindow* window_ = nullptr;
    std::string title_;
    EventQueue events_;
    bool repeating_ = false;  // the key that was pressed last is held and repeats
    std::vector<std::filesystem::path> dropped_;
};

}  // namespace halflight::view
