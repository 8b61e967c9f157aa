// An OpenGL 4.5 core context through EGL, without a window system.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/error.h"

namespace halflight::gpu {

class ProgramBinaries;

struct ContextOptions {
    /// Device: "" selects hardware if available, else software; "hardware" and "software" exclude the other kind. A
    /// number is an index into attempts(). Other text is part of a device's name or GL renderer, in either case.
    std::string device;
    /// Folder that keeps linked programs for later runs (program_binaries.h); empty: none.
    std::filesystem::path binaries_folder = {};
    bool debug = false;  ///< debug context with synchronous messages: slower, but every GL error has a text
};

/// A device or platform, in the order of the attempts.
struct DeviceAttempt {
    std::string name;    ///< name such as "EGL device 0, /dev/dri/card0, NVIDIA H200"
    bool taken = false;  ///< true for at most one attempt
    std::string reason;  ///< reason why the device was taken or not
};

struct Limits {
    std::size_t texture_buffer_texels = 0;  ///< texels per texture buffer
    std::size_t storage_block_bytes = 0;    ///< bytes per shader storage block
    std::size_t uniform_block_bytes = 0;
    int texture_size = 0;       ///< texels along an edge of a 2D texture
    int texture_3d_size = 0;    ///< texels along an edge of a 3D texture
    int texture_units = 0;      ///< texture units per shader stage
    int storage_blocks = 0;     ///< storage blocks per compute shader
    int workgroup_count = 0;    ///< maximum number of work groups along x
    int color_attachments = 0;  ///< color attachments per framebuffer
};

/// Owns a context, which is current on the creating thread until it is destroyed or another context becomes current. An
/// empty vertex array is bound, and pixel rows are packed to bytes.
class Context {
  public:
    /// Creates a context. Throws Error with the reason of every attempt if no device provides one.
    static Context create(const ContextOptions& options = {});
    /// Returns the attempts of create() with their reasons, even if none succeeds. The context that is current on this
    /// thread is not current afterwards.
    static std::vector<DeviceAttempt> probe(const ContextOptions& options = {});

    Context(Context&&) noexcept;
    Context& operator=(Context&&) noexcept;
    ~Context();

    void make_current() const;
    const std::vector<DeviceAttempt>& attempts() const;
    const std::string& renderer() const;  ///< Returns GL_RENDERER.
    const std::string& version() const;   ///< Returns GL_VERSION.
    bool software() const;                ///< Returns whether the driver is llvmpipe, softpipe or swrast.
    const Limits& limits() const;
    /// Returns the store for ProgramCache; null unless binaries_folder is set.
    const ProgramBinaries* binaries() const;

    /// Throws Error(subject, first message) if the driver reported an error since the last check. Throws ContextLost.
    void check(std::string_view subject);
    /// Returns the number of errors since creation, including those not yet checked.
    std::uint64_t error_count() const;

  private:
    struct State;
    explicit Context(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// Makes the context that is current on this thread at construction, or none, current again at destruction, whatever
/// others did meanwhile.
class KeepCurrent {
  public:
    KeepCurrent();
    KeepCurrent(const KeepCurrent&) = delete;
    KeepCurrent& operator=(const KeepCurrent&) = delete;
    ~KeepCurrent();

  private:
    void* display_;  // objects of EGL
    void* draw_;
    void* read_;
    void* context_;
};

/// The driver has reset the device. Nothing can be rendered by contexts that were there before.
class ContextLost final : public Error {
  public:
    explicit ContextLost(std::string_view subject);
};
/// Throws ContextLost if the current context was lost. Other calls then fail for no reason of their own.
void check_not_lost(std::string_view subject);

/// Returns whether a GL_RENDERER string names one of Mesa's software rasterizers.
bool is_software_renderer(std::string_view renderer);

/// Sets the default state: depth test, blending, culling and scissor off; all channels written; depth func less; clip
/// depth -1 to 1; no program bound.
void default_state();

/// Waits until all commands are executed.
void finish();

/// Clock of the CPU seconds of the code that follows and of the GL work that it starts. GL timers of software drivers
/// are meaningless.
class Stopwatch {
  public:
    Stopwatch();             ///< Waits for earlier work, then starts.
    double seconds() const;  ///< Waits for all work so far; returns the seconds since construction.
  private:
    std::int64_t start_;  // CPU clock, nanoseconds
};
/// Returns the seconds that f() and all GL commands it starts take.
template <class F>
double timed(F&& f) {
    const Stopwatch watch;
    f();
    return watch.seconds();
}

}  // namespace halflight::gpu
