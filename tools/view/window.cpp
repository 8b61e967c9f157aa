#include "tools/view/window.h"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/driver_needs.h"
#include "tools/view/clock.h"

namespace halflight::view {
namespace {

/// Returns the reason of the last failed GLFW call.
std::string reason() {
    const char* text = nullptr;
    return glfwGetError(&text) == GLFW_NO_ERROR || !text ? "unknown reason" : text;
}

constexpr ivec2 kFirstSize(640, 360);  // size until the sizes of text and picture are known

GLFWwindow* create(const std::string& title, int creation_api) {
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    glfwWindowHint(GLFW_CONTEXT_CREATION_API, creation_api);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_DEPTH_BITS, 0);
    glfwWindowHint(GLFW_STENCIL_BITS, 0);
    return glfwCreateWindow(kFirstSize.x, kFirstSize.y, title.c_str(), nullptr, nullptr);
}

/// Starts GLFW. Since 3.4 it tries Wayland before X11. Without XDG_RUNTIME_DIR, Wayland's library finds no display, and
/// prints that.
bool start_glfw() {
#ifdef GLFW_PLATFORM_X11
    if (!std::getenv("XDG_RUNTIME_DIR") && glfwPlatformSupported(GLFW_PLATFORM_X11))
        glfwInitHint(GLFW_PLATFORM, GLFW_PLATFORM_X11);
#endif
    return glfwInit() == GLFW_TRUE;
}

}  // namespace

Window::Window(const std::string& title) : title_(title) {
    gpu::check_process(2);  // the window, and the thread that renders
    if (!start_glfw()) throw Error("window", "there is no display: {}", reason());
    window_ = create(title, GLFW_EGL_CONTEXT_API);
    if (!window_) window_ = create(title, GLFW_NATIVE_CONTEXT_API);
    if (!window_) {
        const std::string why = reason();
        glfwTerminate();
        throw Error("window", "no window with OpenGL 4.5: {}", why);
    }
    glfwMakeContextCurrent(window_);
    glfwSwapInterval(1);
    GLuint vertex_array = 0;  // core profiles draw nothing without one; the context owns it
    glCreateVertexArrays(1, &vertex_array);
    glBindVertexArray(vertex_array);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glfwSetWindowUserPointer(window_, this);
    listen();
}

void Window::add(InputEvent event) {
    event.time = now();
    events_.add(event);
}

void Window::listen() {
    static constexpr auto self = [](GLFWwindow* window) {
        return static_cast<Window*>(glfwGetWindowUserPointer(window));
    };
    glfwSetKeyCallback(window_, [](GLFWwindow* window, int key, int scancode, int action, int modifiers) {
        self(window)->repeating_ = action == GLFW_REPEAT;
        if (action == GLFW_REPEAT) return;  // Dear ImGui repeats keys itself
        const char* name = glfwGetKeyName(key, scancode);
        const bool sign = name && name[0] > ' ' && name[0] < 0x7f && name[1] == 0;
        self(window)->add({.kind = InputEvent::Kind::key,
                           .code = key,
                           .down = action == GLFW_PRESS,
                           .modifiers = modifiers,
                           .symbol = sign ? static_cast<char>(std::toupper(name[0])) : char{0}});
    });
    glfwSetCharCallback(window_, [](GLFWwindow* window, unsigned letter) {
        self(window)->add(
            {.kind = InputEvent::Kind::letter, .down = !self(window)->repeating_, .letter = std::uint32_t{letter}});
    });
    glfwSetMouseButtonCallback(window_, [](GLFWwindow* window, int button, int action, int modifiers) {
        self(window)->add(
            {.kind = InputEvent::Kind::button, .code = button, .down = action == GLFW_PRESS, .modifiers = modifiers});
    });
    glfwSetCursorPosCallback(window_, [](GLFWwindow* window, double x, double y) {
        const dvec2 factor = dvec2(self(window)->framebuffer_size()) / glm::max(dvec2(self(window)->size()), 1.0);
        self(window)->add({.kind = InputEvent::Kind::position, .value = factor * dvec2(x, y)});
    });
    glfwSetScrollCallback(window_, [](GLFWwindow* window, double x, double y) {
        self(window)->add({.kind = InputEvent::Kind::wheel, .value = {x, y}});
    });
    glfwSetWindowFocusCallback(window_, [](GLFWwindow* window, int focused) {
        self(window)->add({.kind = InputEvent::Kind::focus, .down = focused == GLFW_TRUE});
    });
    glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** paths) {
        std::vector<std::filesystem::path>& all = self(window)->dropped_;
        all.insert(all.end(), paths, paths + count);
    });
}

Window::~Window() {
    glfwDestroyWindow(window_);
    glfwTerminate();
}

ivec2 Window::framebuffer_size() const {
    ivec2 size;
    glfwGetFramebufferSize(window_, &size.x, &size.y);
    return size;
}

ivec2 Window::size() const {
    ivec2 size;
    glfwGetWindowSize(window_, &size.x, &size.y);
    return size;
}

void Window::resize(const ivec2& size) {
    const dvec2 factor = dvec2(this->size()) / glm::max(dvec2(framebuffer_size()), 1.0);
    const ivec2 wanted(glm::round(factor * dvec2(size)));
    glfwSetWindowSize(window_, wanted.x, wanted.y);
    glfwShowWindow(window_);
}

ivec2 Window::largest() const {
    GLFWmonitor* const monitor = glfwGetPrimaryMonitor();
    if (!monitor) return ivec2(1 << 14);
    ivec2 at, size;
    glfwGetMonitorWorkarea(monitor, &at.x, &at.y, &size.x, &size.y);
    const dvec2 factor = dvec2(framebuffer_size()) / glm::max(dvec2(this->size()), 1.0);
    return ivec2(factor * dvec2(size));
}

double Window::monitor_scale() const {
    float x = 1, y = 1;
    glfwGetWindowContentScale(window_, &x, &y);
    return double{std::max(x, y)};
}

bool Window::closing() const {
    return glfwWindowShouldClose(window_) != 0;
}

void Window::close() {
    glfwSetWindowShouldClose(window_, GLFW_TRUE);
}

void Window::stay_open() {
    glfwSetWindowShouldClose(window_, GLFW_FALSE);
}

void Window::set_title(const std::string& title) {
    if (title != title_) glfwSetWindowTitle(window_, title.c_str());
    title_ = title;
}

bool Window::wait(double seconds) {
    const Stopwatch watch;
    glfwWaitEventsTimeout(seconds);
    return watch.seconds() < seconds;
}

void Window::wake() {
    glfwPostEmptyEvent();
}

std::vector<std::filesystem::path> Window::dropped() {
    return std::exchange(dropped_, {});
}

void Window::swap() {
    glfwSwapBuffers(window_);
}

Image Window::read() const {
    const ivec2 size = framebuffer_size();
    std::vector<std::uint8_t> bytes(std::size_t(size.x) * std::size_t(size.y) * 3);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glReadBuffer(GL_BACK);
    glReadPixels(0, 0, size.x, size.y, GL_RGB, GL_UNSIGNED_BYTE, bytes.data());
    Image image(size.x, size.y, 3);
    for (int y = 0; y < size.y; ++y)
        for (int i = 0; i < size.x * 3; ++i)
            image.at(0, y)[i] =
                float(bytes[std::size_t(size.y - 1 - y) * std::size_t(size.x) * 3 + std::size_t(i)]) / 255;
    return image;
}

}  // namespace halflight::view
