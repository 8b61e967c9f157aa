#include "engine/gpu/context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <chrono>
#include <numeric>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/device.h"
#include "engine/gpu/driver_needs.h"
#include "engine/gpu/gl_string.h"
#include "engine/gpu/program_binaries.h"
#include "engine/gpu/program_limits.h"

namespace halflight::gpu {
namespace {

std::string lower(std::string_view text) {
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return std::tolower(c); });
    return result;
}

std::optional<std::size_t> parse_index(std::string_view text) {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

template <class T>
T gl_value(GLenum name) {
    GLint64 value = 0;
    glGetInteger64v(name, &value);
    return static_cast<T>(value);
}

Limits query_limits() {
    Limits limits;
    limits.texture_buffer_texels = gl_value<std::size_t>(GL_MAX_TEXTURE_BUFFER_SIZE);
    limits.storage_block_bytes = gl_value<std::size_t>(GL_MAX_SHADER_STORAGE_BLOCK_SIZE);
    limits.uniform_block_bytes = gl_value<std::size_t>(GL_MAX_UNIFORM_BLOCK_SIZE);
    limits.texture_size = gl_value<int>(GL_MAX_TEXTURE_SIZE);
    limits.texture_3d_size = gl_value<int>(GL_MAX_3D_TEXTURE_SIZE);
    limits.texture_units = gl_value<int>(GL_MAX_TEXTURE_IMAGE_UNITS);
    limits.storage_blocks = gl_value<int>(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS);
    limits.color_attachments = gl_value<int>(GL_MAX_COLOR_ATTACHMENTS);
    glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &limits.workgroup_count);
    return limits;
}

const char* error_name(GLenum error) {
    switch (error) {
        case GL_INVALID_ENUM:
            return "GL_INVALID_ENUM";
        case GL_INVALID_VALUE:
            return "GL_INVALID_VALUE";
        case GL_INVALID_OPERATION:
            return "GL_INVALID_OPERATION";
        case GL_INVALID_FRAMEBUFFER_OPERATION:
            return "GL_INVALID_FRAMEBUFFER_OPERATION";
        case GL_OUT_OF_MEMORY:
            return "GL_OUT_OF_MEMORY";
        case GL_CONTEXT_LOST:
            return "GL_CONTEXT_LOST";
        default:
            return "unknown GL error";
    }
}

/// Calls what runs after a loss of the context. Epoxy looks a function up at its first call, and ends the process if
/// the driver has no context then, as NVIDIA's after a reset.
void look_up_functions() {
    glGetGraphicsResetStatus();
    glGetError();
    glFinish();
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    glDeleteBuffers(0, nullptr);
    glDeleteFramebuffers(0, nullptr);
    glDeleteQueries(0, nullptr);
    glDeleteTextures(0, nullptr);
    glDeleteVertexArrays(0, nullptr);
    glDeleteShader(0);
    glDeleteProgram(0);
    const GLsync fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glClientWaitSync(fence, 0, 0);
    glDeleteSync(fence);
}

std::int64_t now() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

}  // namespace

struct Context::State {
    explicit State(EglContext&& context) : egl(std::move(context)) {}
    EglContext egl;
    std::vector<DeviceAttempt> attempts;
    std::string renderer;
    std::string version;
    Limits limits;
    std::optional<ProgramBinaries> binaries;
    bool debug = false;
    std::uint64_t errors = 0;  // errors since creation
    std::uint64_t unseen = 0;  // errors since the last check
    std::string first;         // message of the first unseen error

    void add_error(std::string message) {
        ++errors;
        if (unseen++ == 0) first = std::move(message);
    }

    static void GLAPIENTRY on_message(GLenum source, GLenum type, GLuint, GLenum, GLsizei length, const GLchar* text,
                                      const void* user) {
        // Program throws the messages of the shader compiler, so they are not counted here.
        const bool error = type == GL_DEBUG_TYPE_ERROR || type == GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR;
        if (!error || source == GL_DEBUG_SOURCE_SHADER_COMPILER) return;
        static_cast<State*>(const_cast<void*>(user))->add_error(std::string(text, static_cast<std::size_t>(length)));
    }

    void set_up() {
        look_up_functions();
        renderer = gl_string(GL_RENDERER);
        version = gl_string(GL_VERSION);
        limits = query_limits();
        GLuint vertex_array = 0;  // core profiles need a vertex array to draw; the context owns it
        glCreateVertexArrays(1, &vertex_array);
        glBindVertexArray(vertex_array);
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
        if (!debug) return;
        glEnable(GL_DEBUG_OUTPUT);
        glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
        glDebugMessageCallback(&on_message, this);
    }
};

namespace {

/// The search over devices, shared by create() and probe().
struct Search {
    std::vector<DeviceAttempt> attempts;
    std::optional<EglContext> context;

    explicit Search(const ContextOptions& options) : options_(options) {
        check_process();
        devices_ = enumerate_devices();
        const std::string& wanted = options.device;
        const bool by_kind = wanted == "hardware" || wanted == "software";
        const auto index = parse_index(wanted);
        for (const Device& device : devices_) attempts.push_back({device.name, false, ""});
        for (const std::size_t i : order()) {
            DeviceAttempt& attempt = attempts[i];
            if (context) {
                attempt.reason = "not needed";
            } else if (index && *index != i) {
                attempt.reason = "not the one that was asked for";
            } else if (wanted == "hardware" && devices_[i].kind == DeviceKind::software) {
                attempt.reason = "not hardware";
            } else {
                try_device(i, [&](bool software) -> std::string {
                    if (by_kind && software != (wanted == "software")) return "not " + wanted;
                    if (wanted.empty() && software && devices_[i].kind == DeviceKind::hardware) {
                        return "hardware by name, but renders in software";
                    }
                    const bool by_name = !wanted.empty() && !by_kind && !index;
                    const bool named = lower(attempt.name).find(lower(wanted)) != std::string::npos;
                    return by_name && !named ? "its name has no '" + wanted + "'" : "";
                });
            }
        }
    }

  private:
    /// Returns the order of attempts: hardware first, unless software is requested. Hardware contexts may be slow.
    std::vector<std::size_t> order() const {
        std::vector<std::size_t> indices(devices_.size());
        std::iota(indices.begin(), indices.end(), std::size_t{0});
        const auto rank = [&](std::size_t i) {
            const int kind = static_cast<int>(devices_[i].kind);
            return options_.device == "software" ? -kind : kind;
        };
        std::stable_sort(indices.begin(), indices.end(),
                         [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });
        return indices;
    }

    /// Tries device i. `refuse` gets the attempt's full name and returns the reason for a refusal; "" accepts.
    template <class Refuse>
    void try_device(std::size_t i, Refuse refuse) {
        DeviceAttempt& attempt = attempts[i];
        try {
            EglContext candidate(devices_[i], options_.debug);
            const std::string renderer(gl_string(GL_RENDERER));
            if (attempt.name.find(renderer) == std::string::npos) (attempt.name += ", ") += renderer;
            attempt.reason = refuse(is_software_renderer(renderer));
            if (attempt.reason.empty()) attempt.reason = reason_against_driver(renderer, gl_string(GL_VERSION));
            if (!attempt.reason.empty()) return;
            attempt.taken = true;
            attempt.reason = options_.device.empty() ? "the first that works" : "asked for";
            context.emplace(std::move(candidate));
        } catch (const Error& error) {
            attempt.reason = error.what();
        }
    }

    const ContextOptions& options_;
    std::vector<Device> devices_;
};

}  // namespace

Context::Context(std::unique_ptr<State> state) : state_(std::move(state)) {}
Context::Context(Context&&) noexcept = default;
Context& Context::operator=(Context&&) noexcept = default;
Context::~Context() = default;

Context Context::create(const ContextOptions& options) {
    Search search(options);
    if (!search.context) {
        std::string reasons;
        for (const DeviceAttempt& attempt : search.attempts) {
            reasons += (reasons.empty() ? "" : "; ") + attempt.name + ": " + attempt.reason;
        }
        if (search.attempts.empty()) reasons = "EGL lists no device";
        const std::string asked = options.device.empty() ? "" : " for device '" + options.device + "'";
        throw Error("GPU", "no OpenGL 4.5 context{} ({})", asked, reasons);
    }
    forget_run_limits();
    auto state = std::make_unique<State>(std::move(*search.context));
    state->attempts = std::move(search.attempts);
    state->debug = options.debug;
    state->set_up();
    if (!options.binaries_folder.empty()) {
        // The renderer's name contains the vector width of llvmpipe.
        const std::string driver = fmt::format("{}\n{}\n{}\n{}", gl_string(GL_VENDOR), state->renderer, state->version,
                                               gl_string(GL_SHADING_LANGUAGE_VERSION));
        state->binaries.emplace(options.binaries_folder, driver);
    }
    return Context(std::move(state));
}

std::vector<DeviceAttempt> Context::probe(const ContextOptions& options) {
    return Search(options).attempts;
}

void Context::make_current() const {
    state_->egl.make_current();
}
const std::vector<DeviceAttempt>& Context::attempts() const {
    return state_->attempts;
}
const std::string& Context::renderer() const {
    return state_->renderer;
}
const std::string& Context::version() const {
    return state_->version;
}
bool Context::software() const {
    return is_software_renderer(state_->renderer);
}
const Limits& Context::limits() const {
    return state_->limits;
}
const ProgramBinaries* Context::binaries() const {
    return state_->binaries ? &*state_->binaries : nullptr;
}
std::uint64_t Context::error_count() const {
    return state_->errors;
}

void Context::check(std::string_view subject) {
    check_not_lost(subject);
    const bool counted = state_->unseen > 0;  // a debug context has counted every error already, with its text
    for (GLenum error = glGetError(); error != GL_NO_ERROR; error = glGetError()) {
        if (error == GL_CONTEXT_LOST) throw ContextLost(subject);
        if (!counted) state_->add_error(error_name(error));
    }
    if (state_->unseen == 0) return;
    const std::uint64_t more = std::exchange(state_->unseen, 0) - 1;
    const std::string others = more == 0 ? "" : fmt::format(" (and {} more)", more);
    throw Error(subject, "{}{}", std::exchange(state_->first, {}), others);
}

KeepCurrent::KeepCurrent()
    : display_(eglGetCurrentDisplay()),
      draw_(eglGetCurrentSurface(EGL_DRAW)),
      read_(eglGetCurrentSurface(EGL_READ)),
      context_(eglGetCurrentContext()) {}

KeepCurrent::~KeepCurrent() {
    if (eglGetCurrentContext() == context_) return;
    if (context_ != EGL_NO_CONTEXT)
        eglMakeCurrent(display_, draw_, read_, context_);
    else  // a context that stays current on this thread cannot be used on others
        eglMakeCurrent(eglGetCurrentDisplay(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

ContextLost::ContextLost(std::string_view subject)
    : Error(subject, "the driver has reset the GPU, whose context is lost; what was not finished is missing") {}

void check_not_lost(std::string_view subject) {
    if (glGetGraphicsResetStatus() != GL_NO_ERROR) throw ContextLost(subject);
}

bool is_software_renderer(std::string_view renderer) {
    static constexpr std::array<std::string_view, 3> kNames{"llvmpipe", "softpipe", "swrast"};
    const std::string name = lower(renderer);
    return std::any_of(kNames.begin(), kNames.end(), [&](std::string_view n) { return name.find(n) != name.npos; });
}

void default_state() {
    for (const GLenum capability : {GL_DEPTH_TEST, GL_BLEND, GL_CULL_FACE, GL_SCISSOR_TEST}) glDisable(capability);
    glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glUseProgram(0);
}

void finish() {
    glFinish();
}

Stopwatch::Stopwatch() {
    glFinish();
    start_ = now();
}

double Stopwatch::seconds() const {
    glFinish();
    return 1e-9 * static_cast<double>(now() - start_);
}

}  // namespace halflight::gpu
