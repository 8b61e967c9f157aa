// A window of the desktop with an OpenGL 4.5 core context, and what people do in it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"

struct GLFWwindow;

namespace halflight::view {

/// One at a time, on the main thread; its context is current there as long as it lives.
class Window {
  public:
    /// Pixels of the framebuffer. Throws Error with the reason where there is no display or no such context.
    Window(const ivec2& size, const std::string& title);
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;
    ~Window();

    GLFWwindow* handle() const { return window_; }
    ivec2 framebuffer_size() const;  ///< {0, 0} while it is minimised
    bool closing() const;            ///< somebody wants it closed
    void set_title(const std::string& title);

    /// Waits for something to happen, at most so long; true if it did. What happened went to Dear ImGui, or to
    /// dropped().
    bool wait(double seconds);
    /// Ends a wait(). From any thread, as long as there is a window.
    static void wake();
    /// Files that were dropped since the last call.
    std::vector<std::filesystem::path> dropped();
    void swap();
    /// The framebuffer as it is before swap(): RGB, display-encoded.
    Image read() const;

  private:
    GLFWwindow* window_ = nullptr;
    std::string title_;
    std::vector<std::filesystem::path> dropped_;
};

}  // namespace halflight::view
