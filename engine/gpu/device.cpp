#include "engine/gpu/device.h"

#include <dlfcn.h>

#include <array>
#include <mutex>
#include <set>
#include <string_view>

#include "engine/core/error.h"
#include "engine/gpu/release_driver.h"

namespace halflight::gpu {
namespace {

// Token of EGL_EXT_device_query_name, which older headers lack.
constexpr EGLint kRendererName = 0x335F;

/// Checks for the libraries first, because epoxy ends the process if they are missing.
void require_libraries() {
    const auto present = [](const char* file) { return dlopen(file, RTLD_LAZY | RTLD_LOCAL) != nullptr; };
    if (!present("libEGL.so.1")) throw Error("GPU", "libEGL.so.1 is not installed");
    if (!present("libOpenGL.so.0") && !present("libGL.so.1")) throw Error("GPU", "libOpenGL.so.0 is not installed");
}

bool has_extension(const char* list, std::string_view name) {
    std::string_view rest = list == nullptr ? "" : list;
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find(' '), rest.size());
        if (rest.substr(0, end) == name) return true;
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return false;
}

template <class Function>
Function function(const char* name) {
    return reinterpret_cast<Function>(eglGetProcAddress(name));
}

const char* error_name(EGLint error) {
    switch (error) {
        case EGL_NOT_INITIALIZED:
            return "EGL_NOT_INITIALIZED";
        case EGL_BAD_ACCESS:
            return "EGL_BAD_ACCESS";
        case EGL_BAD_ALLOC:
            return "EGL_BAD_ALLOC";
        case EGL_BAD_ATTRIBUTE:
            return "EGL_BAD_ATTRIBUTE";
        case EGL_BAD_CONFIG:
            return "EGL_BAD_CONFIG";
        case EGL_BAD_MATCH:
            return "EGL_BAD_MATCH";
        case EGL_BAD_PARAMETER:
            return "EGL_BAD_PARAMETER";
        case EGL_CONTEXT_LOST:
            return "EGL_CONTEXT_LOST";
        default:
            return "EGL error";
    }
}

std::vector<Device> egl_devices(const char* client_extensions) {
    const bool enumerable = has_extension(client_extensions, "EGL_EXT_device_enumeration") ||
                            has_extension(client_extensions, "EGL_EXT_device_base");
    if (!enumerable || !has_extension(client_extensions, "EGL_EXT_platform_device")) return {};
    const auto query_devices = function<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
    const auto query_string = function<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
    std::array<EGLDeviceEXT, 64> found{};
    EGLint count = 0;
    if (!query_devices || !query_string || !query_devices(found.size(), found.data(), &count)) return {};
    std::vector<Device> devices;
    for (EGLint i = 0; i < count; ++i) {
        const EGLDeviceEXT egl_device = found[static_cast<std::size_t>(i)];
        const char* extensions = query_string(egl_device, EGL_EXTENSIONS);
        const bool software = has_extension(extensions, "EGL_MESA_device_software");
        Device device{fmt::format("EGL device {}", i), software ? DeviceKind::software : DeviceKind::hardware,
                      EGL_PLATFORM_DEVICE_EXT, egl_device};
        if (software) device.name += ", software";
        const auto append = [&](const char* extension, EGLint what) {
            const char* text = has_extension(extensions, extension) ? query_string(egl_device, what) : nullptr;
            if (text != nullptr) (device.name += ", ") += text;
        };
        append("EGL_EXT_device_drm", EGL_DRM_DEVICE_FILE_EXT);
        append("EGL_EXT_device_query_name", kRendererName);
        devices.push_back(std::move(device));
    }
    return devices;
}

[[noreturn]] void fail(std::string_view what) {
    throw Error("", "{} ({})", what, error_name(eglGetError()));
}

/// The displays that contexts of the process have initialised.
class Displays {
  public:
    void add(EGLDisplay display) {
        const std::lock_guard lock(mutex_);
        displays_.insert(display);
    }
    void terminate() {
        const std::lock_guard lock(mutex_);
        for (const EGLDisplay display : displays_) eglTerminate(display);
        displays_.clear();
    }

  private:
    std::mutex mutex_;
    std::set<EGLDisplay> displays_;
};

Displays& displays() {
    static Displays all;
    return all;
}

}  // namespace

std::vector<Device> enumerate_devices() {
    require_libraries();
    const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    std::vector<Device> devices = egl_devices(extensions);
    if (has_extension(extensions, "EGL_MESA_platform_surfaceless")) {
        devices.push_back({"Mesa surfaceless platform", DeviceKind::unknown, EGL_PLATFORM_SURFACELESS_MESA, nullptr});
    }
    return devices;
}

EglContext::EglContext(const Device& device, bool debug) {
    const auto get_display = function<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
    void* native = device.native != nullptr ? device.native : EGL_DEFAULT_DISPLAY;
    display_ = get_display ? get_display(device.platform, native, nullptr) : EGL_NO_DISPLAY;
    // Displays are shared by the whole process and cannot be distinguished from another user's, so they stay
    // initialised until release_driver().
    if (display_ == EGL_NO_DISPLAY) fail("no display");
    create(debug, EGL_NO_CONTEXT);
    displays().add(display_);
}

EglContext::EglContext(EGLDisplay display, EGLContext other) : display_(display) {
    create(false, other);
}

void EglContext::create(bool debug, EGLContext shared) {
    EGLint major = 0, minor = 0;
    if (!eglInitialize(display_, &major, &minor)) fail("no display");
    const char* extensions = eglQueryString(display_, EGL_EXTENSIONS);
    if (!has_extension(extensions, "EGL_KHR_surfaceless_context")) throw Error("", "needs a surface");
    if (!eglBindAPI(EGL_OPENGL_API)) fail("no OpenGL");

    EGLConfig config = EGL_NO_CONFIG_KHR;
    if (!has_extension(extensions, "EGL_KHR_no_config_context")) {
        const std::array<EGLint, 5> wanted{EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
        EGLint count = 0;
        if (!eglChooseConfig(display_, wanted.data(), &config, 1, &count) || count == 0) fail("no configuration");
    }
    std::vector<EGLint> attributes{EGL_CONTEXT_MAJOR_VERSION_KHR,       4,
                                   EGL_CONTEXT_MINOR_VERSION_KHR,       5,
                                   EGL_CONTEXT_OPENGL_PROFILE_MASK_KHR, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT_KHR};
    if (debug) attributes.insert(attributes.end(), {EGL_CONTEXT_FLAGS_KHR, EGL_CONTEXT_OPENGL_DEBUG_BIT_KHR});
    // Reset notification turns the use of a lost context from undefined into an error, and robust access does so with
    // reads and writes beyond a buffer. Not every driver offers both.
    const std::vector<EGLint> reset{EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET};
    const std::vector<EGLint> robust{EGL_CONTEXT_OPENGL_ROBUST_ACCESS, EGL_TRUE};
    const bool offered = major > 1 || minor >= 5;
    for (const int extras : {2, 1, 0}) {
        if (extras > 0 && !offered) continue;
        std::vector<EGLint> all = attributes;
        if (extras > 0) all.insert(all.end(), reset.begin(), reset.end());
        if (extras > 1) all.insert(all.end(), robust.begin(), robust.end());
        all.push_back(EGL_NONE);
        context_ = eglCreateContext(display_, config, shared, all.data());
        if (context_ != EGL_NO_CONTEXT) break;
    }
    if (context_ == EGL_NO_CONTEXT) fail("no OpenGL 4.5 core context");
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
        eglDestroyContext(display_, context_);
        fail("the context cannot be made current");
    }
}

EglContext::~EglContext() {
    if (context_ == EGL_NO_CONTEXT) return;
    if (eglGetCurrentContext() == context_) eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
}

void EglContext::make_current() const {
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
        throw Error("GPU", "the context cannot be made current ({})", error_name(eglGetError()));
    }
}

void release_driver() {
    displays().terminate();
}

}  // namespace halflight::gpu
