// Enumeration of EGL devices, and contexts on them. Only engine/gpu includes this file.
#pragma once

#include <epoxy/egl.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace halflight::gpu {

/// Kind of a device before it is tried. The driver of Mesa's surfaceless platform is unknown.
enum class DeviceKind : std::uint8_t { hardware, software, unknown };

/// A device that may provide a context without a window system.
struct Device {
    std::string name;
    DeviceKind kind = DeviceKind::unknown;
    EGLenum platform = 0;    // argument of eglGetPlatformDisplay()
    void* native = nullptr;  // EGLDeviceEXT or null
};
/// Returns the EGL devices in EGL's order, then the surfaceless platform. Throws Error if EGL or OpenGL is not
/// installed.
std::vector<Device> enumerate_devices();

/// An OpenGL 4.5 core context without surfaces, current on this thread once created.
class EglContext {
  public:
    /// Throws Error with the reason if the device provides no such context.
    EglContext(const Device& device, bool debug);
    /// Creates a context that shares objects with `other`, a context of EGL that may be current on another thread.
    EglContext(EGLDisplay display, EGLContext other);
    EglContext(EglContext&& other) noexcept
        : display_(other.display_), context_(std::exchange(other.context_, EGL_NO_CONTEXT)) {}
    EglContext& operator=(EglContext&&) = delete;
    ~EglContext();
    void make_current() const;

  private:
    void create(bool debug, EGLContext shared);

    EGLDisplay display_;
    EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace halflight::gpu
