#include "tools/view/window.h"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <cstdint>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/driver_needs.h"

namespace halflight::view {
namespace {

/// Returns the reason of the last failed GLFW call.
std::string reason() {
    const char* text = nullptr;
    return glfwGetError(&text) == GLFW_NO_ERROR || !text ? "unknown reason" : text;
}

GLFWwindow* create(const ivec2& size, const std::string& title, int creation_api) {
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CONTEXT_CREATION_API, creation_api);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_DEPTH_BITS, 0);
    glfwWindowHint(GLFW_STENCIL_BITS, 0);
    return glfwCreateWindow(size.x, size.y, title.c_str(), nullptr, nullptr);
}

}  // namespace

Window::Window(const ivec2& size, const std::string& title) : title_(title) {
    gpu::prepare_for_drivers();
    if (!glfwInit()) throw Error("window", "there is no display: {}", reason());
    window_ = create(size, title, GLFW_EGL_CONTEXT_API);
    if (!window_) window_ = create(size, title, GLFW_NATIVE_CONTEXT_API);
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
    glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** paths) {
        auto* self = static_cast<Window*>(glfwGetWindowUserPointer(window));
        self->dropped_.insert(self->dropped_.end(), paths, paths + count);
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

bool Window::closing() const {
    return glfwWindowShouldClose(window_) != 0;
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
