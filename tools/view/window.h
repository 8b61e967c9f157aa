// A desktop window with an OpenGL 4.5 core context, and its events.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"

struct GLFWwindow;

namespace halflight::view {

/// Owns the window and its context, which is current on the main thread during its lifetime. Only one may exist.
class Window {
  public:
    /// size: pixels of the framebuffer. Throws Error with the reason where there is no display or no such context.
    Window(const ivec2& size, const std::string& title);
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;
    ~Window();

    GLFWwindow* handle() const { return window_; }
    ivec2 framebuffer_size() const;  ///< Returns the size, pixels; {0, 0} while minimised.
    bool closing() const;            ///< Returns whether the user has asked to close the window.
    void set_title(const std::string& title);

    /// Waits for an event, at most this many seconds; returns whether there was one. Events go to Dear ImGui or to
    /// dropped().
    bool wait(double seconds);
    /// Ends a wait(). May be called from any thread while there is a window.
    static void wake();
    /// Returns the files dropped since the last call.
    std::vector<std::filesystem::path> dropped();
    void swap();
    /// Returns the framebuffer before swap(): RGB, display-encoded.
    Image read() const;

  private:
    GLFWwindow* window_ = nullptr;
    std::string title_;
    std::vector<std::filesystem::path> dropped_;
};

}  // namespace halflight::view
