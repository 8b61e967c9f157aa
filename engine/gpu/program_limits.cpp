#include "engine/gpu/program_limits.h"

#include <epoxy/egl.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <regex>
#include <utility>

#include "engine/gpu/declarations.h"
#include "engine/gpu/dispatch_pieces.h"
#include "engine/gpu/gl_string.h"

namespace halflight::gpu {
namespace {

std::size_t limit_of(GLenum name) {
    GLint64 value = 0;
    glGetInteger64v(name, &value);
    return static_cast<std::size_t>(std::max<GLint64>(value, 0));
}

/// Returns the invocations of a workgroup, or 0 if the text gives no numbers.
std::size_t group_size(const std::string& text) {
    static const std::regex axis(R"(\blocal_size_[xyz]\s*=\s*(\d{1,9}))");
    std::size_t size = 0;
    for (auto at = std::sregex_iterator(text.begin(), text.end(), axis); at != std::sregex_iterator(); ++at)
        size = std::max<std::size_t>(size, 1) * std::stoul((*at)[1].str());
    return size;
}

/// A row per kind of resource, with the limits on its number in each stage.
struct Kind {
    SlotKind kind;
    std::string_view what;
    GLenum compute, vertex, fragment;
    std::string_view limit;
};
constexpr Kind kKinds[] = {
    {SlotKind::storage_block, "storage blocks", GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS,
     GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS, "GL_MAX_*_SHADER_STORAGE_BLOCKS"},
    {SlotKind::uniform_block, "uniform blocks", GL_MAX_COMPUTE_UNIFORM_BLOCKS, GL_MAX_VERTEX_UNIFORM_BLOCKS,
     GL_MAX_FRAGMENT_UNIFORM_BLOCKS, "GL_MAX_*_UNIFORM_BLOCKS"},
    {SlotKind::sampler, "texture units", GL_MAX_COMPUTE_TEXTURE_IMAGE_UNITS, GL_MAX_VERTEX_TEXTURE_IMAGE_UNITS,
     GL_MAX_TEXTURE_IMAGE_UNITS, "GL_MAX_*_TEXTURE_IMAGE_UNITS"},
    {SlotKind::image, "images", GL_MAX_COMPUTE_IMAGE_UNIFORMS, GL_MAX_VERTEX_IMAGE_UNIFORMS,
     GL_MAX_FRAGMENT_IMAGE_UNIFORMS, "GL_MAX_*_IMAGE_UNIFORMS"},
};

/// A row per kind of slot, with the limit on its index.
struct Slots {
    SlotKind kind;
    std::string_view what;
    GLenum most;
    std::string_view limit;
};
constexpr Slots kSlots[] = {
    {SlotKind::storage_block, "bindings of storage blocks", GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS,
     "GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS"},
    {SlotKind::uniform_block, "bindings of uniform blocks", GL_MAX_UNIFORM_BUFFER_BINDINGS,
     "GL_MAX_UNIFORM_BUFFER_BINDINGS"},
    {SlotKind::sampler, "texture units in all", GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS,
     "GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS"},
    {SlotKind::image, "image units", GL_MAX_IMAGE_UNITS, "GL_MAX_IMAGE_UNITS"},
};

RunLimits asked_limits() {
    RunLimits limits;
    for (GLuint axis = 0; axis < 3; ++axis) {
        GLint most = 0;
        glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, axis, &most);
        limits.groups[axis] = static_cast<std::uint32_t>(most);
    }
    limits.storage_block_bytes = limit_of(GL_MAX_SHADER_STORAGE_BLOCK_SIZE);
    limits.uniform_block_bytes = limit_of(GL_MAX_UNIFORM_BLOCK_SIZE);
    limits.dispatch_seconds = dispatch_limit(gl_string(GL_RENDERER));
    return limits;
}

}  // namespace

std::vector<Requirement> declared_requirements(GLenum stage, std::string_view text) {
    const Declarations declared = declarations(text);
    std::vector<Requirement> found;
    for (const Kind& kind : kKinds) {
        const GLenum most = stage == GL_COMPUTE_SHADER  ? kind.compute
                            : stage == GL_VERTEX_SHADER ? kind.vertex
                                                        : kind.fragment;
        const std::string prefix = fmt::format("{} ", name(kind.kind));
        const auto count = std::ranges::count_if(declared, [&](const auto& each) { return each.starts_with(prefix); });
        found.push_back({kind.what, static_cast<std::size_t>(count), limit_of(most), kind.limit});
    }
    if (stage == GL_COMPUTE_SHADER)
        found.push_back({"invocations in a workgroup", group_size(std::string(text)),
                         limit_of(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS), "GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS"});
    return found;
}

std::vector<Requirement> slot_requirements(const std::vector<Slot>& slots) {
    std::vector<Requirement> found;
    for (const Slots& row : kSlots) {
        std::size_t needed = 0;
        for (const Slot& slot : slots)
            if (slot.kind == row.kind) needed = std::max<std::size_t>(needed, slot.index + 1);
        found.push_back({row.what, needed, limit_of(row.most), row.limit});
    }
    return found;
}

std::string unmet(const std::vector<Requirement>& requirements) {
    for (const Requirement& r : requirements)
        if (r.needed > r.allowed)
            return fmt::format("needs {} {}, the driver allows {} ({})", r.needed, r.what, r.allowed, r.limit);
    return "";
}

namespace {
std::atomic<std::uint64_t> generation{0};  // number of forget_run_limits()
}

const RunLimits& run_limits() {
    using Of = std::pair<EGLContext, std::uint64_t>;
    static thread_local std::optional<std::pair<Of, RunLimits>> last;
    if (const Of now(eglGetCurrentContext(), generation.load()); !last || last->first != now)
        last.emplace(now, asked_limits());
    return last->second;
}

void forget_run_limits() {
    ++generation;
}

}  // namespace halflight::gpu
