// OpenGL 4.5 core without a window system, through EGL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace halflight::gpu {

class ProgramBinaries;

struct ContextOptions {
    /// "": hardware if there is any, else software. "hardware", "software": only such. A number: index into attempts().
    /// Anything else: the first device whose name or GL renderer contains it (whatever its case).
    std::string device;
    /// Where linked programs are kept for later runs (program_binaries.h); empty: nowhere.
    std::filesystem::path binaries_folder = {};
    bool debug = false;  ///< Debug context with synchronous messages: slower, and every GL error has a text.
};

/// One device or platform, in the order in which they are tried.
struct DeviceAttempt {
    std::string name;    ///< "EGL device 0, /dev/dri/card0, NVIDIA H200"
    bool taken = false;  ///< At most one is.
    std::string reason;  ///< Why it was taken or not.
};

struct Limits {
    std::size_t texture_buffer_texels = 0;  ///< of one texture buffer
    std::size_t storage_block_bytes = 0;    ///< of one shader storage block
    std::size_t uniform_block_bytes = 0;
    int texture_size = 0;       ///< texels along an edge of a 2D texture
    int texture_3d_size = 0;    ///< texels along an edge of a 3D texture
    int texture_units = 0;      ///< per shader stage
    int storage_blocks = 0;     ///< per compute shader
    int workgroup_count = 0;    ///< along x
    int color_attachments = 0;  ///< of one framebuffer
};

/// Current on the thread that made it until it is destroyed or another one is made; then the other one is.
/// An empty vertex array is bound, pixel rows are packed to bytes.
class Context {
  public:
    /// Throws Error with the reason of every attempt if no device gives a context.
    static Context create(const ContextOptions& options = {});
    /// What create() would try and why, also where none can be taken. A context that is current on this thread stops to
    /// be.
    static std::vector<DeviceAttempt> probe(const ContextOptions& options = {});

    Context(Context&&) noexcept;
    Context& operator=(Context&&) noexcept;
    ~Context();

    void make_current() const;
    const std::vector<DeviceAttempt>& attempts() const;
    const std::string& renderer() const;  ///< GL_RENDERER
    const std::string& version() const;   ///< GL_VERSION
    bool software() const;                ///< llvmpipe, softpipe, swrast
    const Limits& limits() const;
    /// For ProgramCache; null unless asked for.
    const ProgramBinaries* binaries() const;

    /// Throws Error(subject, first message) if the driver reported an error since the last check, or lost the context.
    void check(std::string_view subject);
    /// Errors that check() has seen or will see, since creation.
    std::uint64_t error_count() const;

  private:
    struct State;
    explicit Context(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// Whether a GL_RENDERER string names one of Mesa's software rasterizers.
bool is_software_renderer(std::string_view renderer);

/// Depth test, blending, culling, scissor off; all channels written; depth func less, clip depth -1 to 1; no program
/// bound.
void default_state();

/// Waits until all commands are executed.
void finish();

/// Seconds of CPU clock that f() and all GL work it starts take. (Software drivers give meaningless GL timers.)
class Stopwatch {
  public:
    Stopwatch();             ///< waits for earlier work
    double seconds() const;  ///< waits for all work until now
  private:
    std::int64_t start_;  // nanoseconds
};
template <class F>
double timed(F&& f) {
    const Stopwatch watch;
    f();
    return watch.seconds();
}

}  // namespace halflight::gpu
