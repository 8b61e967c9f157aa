// EGL: which devices there are, and a context on one of them. Of the gpu room's own use.
#pragma once

#include <epoxy/egl.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace halflight::gpu {

/// What a device is known to be before it is tried; unknown: Mesa's surfaceless platform, with whatever driver it
/// finds.
enum class DeviceKind : std::uint8_t { hardware, software, unknown };

/// Something that may give a context without a window system.
struct Device {
    std::string name;
    DeviceKind kind = DeviceKind::unknown;
    EGLenum platform = 0;    // for eglGetPlatformDisplay
    void* native = nullptr;  // EGLDeviceEXT, or nothing
};
/// EGL devices in EGL's order, then the surfaceless platform. Throws Error where EGL or OpenGL are not installed.
std::vector<Device> enumerate_devices();

/// An OpenGL 4.5 core context without surfaces, current on this thread when made.
class EglContext {
  public:
    /// Throws Error with the reason if this device gives no such context.
    EglContext(const Device& device, bool debug);
    EglContext(EglContext&& other) noexcept
        : display_(other.display_), context_(std::exchange(other.context_, EGL_NO_CONTEXT)) {}
    EglContext& operator=(EglContext&&) = delete;
    ~EglContext();
    void make_current() const;

  private:
    EGLDisplay display_;
    EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace halflight::gpu
