#include "engine/gpu/program.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/gpu/declarations.h"
#include "engine/gpu/kept_sources.h"
#include "engine/gpu/program_limits.h"

namespace halflight::gpu {
namespace {

using Shader = Object<delete_shader>;

/// Returns a remark if the text of a stage declares more than the driver allows; else "".
std::string crowded_stage(GLenum stage, std::string_view text) {
    const std::string what = unmet(declared_requirements(stage, text));
    return what.empty() ? "" : fmt::format(" (a stage {})", what);
}

Shader compile_stage(GLenum stage, const ShaderSource& source, const ExpandedSource& expanded) {
    Shader shader(glCreateShader(stage));
    label(GL_SHADER, shader.id(), source.name);
    const char* text = expanded.text.data();
    const auto length = static_cast<GLint>(expanded.text.size());
    glShaderSource(shader.id(), 1, &text, &length);
    glCompileShader(shader.id());
    GLint ok = 0, log_length = 0;
    glGetShaderiv(shader.id(), GL_COMPILE_STATUS, &ok);
    if (ok != 0) return shader;
    check_not_lost(source.name);
    glGetShaderiv(shader.id(), GL_INFO_LOG_LENGTH, &log_length);
    std::string log(static_cast<std::size_t>(log_length), '\0');
    glGetShaderInfoLog(shader.id(), log_length, &log_length, log.data());
    log.resize(static_cast<std::size_t>(log_length));
    const CompileMessage message = first_message(log, expanded);
    // Texts declare samplers that their variant does not use, so a remark about any other error would mislead.
    const bool of_limit = message.what.find("exceed") != std::string::npos;
    throw Error(message.place, "{}{}", message.what.empty() ? "does not compile" : message.what,
                of_limit ? crowded_stage(stage, expanded.text) : "");
}

GLint value_of(GLuint program, GLenum what) {
    GLint value = 0;
    glGetProgramiv(program, what, &value);
    return value;
}

/// Returns whether the present driver accepts binaries of this format. Loading another format is an error.
bool takes_format(GLenum format) {
    GLint count = 0;
    glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &count);
    std::vector<GLint> formats(static_cast<std::size_t>(count));
    if (count > 0) glGetIntegerv(GL_PROGRAM_BINARY_FORMATS, formats.data());
    return std::find(formats.begin(), formats.end(), static_cast<GLint>(format)) != formats.end();
}

/// Returns the program that was stored under the key, or 0.
GLuint loaded(std::string_view name, std::string_view key, const ProgramBinaries& binaries) {
    const std::optional<ProgramBinary> binary = binaries.load(key);
    if (!binary || !takes_format(binary->format)) return 0;
    Object<delete_program> program(glCreateProgram());
    label(GL_PROGRAM, program.id(), name);
    glProgramBinary(program.id(), binary->format, binary->bytes.data(), static_cast<GLsizei>(binary->bytes.size()));
    return value_of(program.id(), GL_LINK_STATUS) != 0 ? program.release() : 0;
}

void store(GLuint program, std::string_view key, const ProgramBinaries& binaries) {
    const GLint size = value_of(program, GL_PROGRAM_BINARY_LENGTH);
    if (size <= 0) return;  // the driver has no binary format
    ProgramBinary binary;
    binary.bytes.resize(static_cast<std::size_t>(size));
    GLsizei written = 0;
    glGetProgramBinary(program, size, &written, &binary.format, binary.bytes.data());
    binary.bytes.resize(static_cast<std::size_t>(written));
    if (written > 0) binaries.store(key, binary);
}

/// Loads the stored program of `key`, the text of all stages. If there is none, calls `make` and stores its result.
template <class Make>
GLuint loaded_or_made(std::string_view name, std::string_view key, const ProgramBinaries* binaries, Make make) {
    if (binaries == nullptr) return make();
    if (const GLuint found = loaded(name, key, *binaries)) return found;
    const GLuint made = make();
    store(made, key, *binaries);
    return made;
}

/// Returns the remark of crowded_stage() for the first stage that has one.
std::string crowded_stage(std::span<const Shader> shaders) {
    for (const Shader& shader : shaders) {
        GLint stage = 0, length = 0;
        glGetShaderiv(shader.id(), GL_SHADER_TYPE, &stage);
        glGetShaderiv(shader.id(), GL_SHADER_SOURCE_LENGTH, &length);
        std::string text(static_cast<std::size_t>(length), '\0');
        glGetShaderSource(shader.id(), length, nullptr, text.data());
        if (std::string remark = crowded_stage(static_cast<GLenum>(stage), text); !remark.empty()) return remark;
    }
    return "";
}

Error link_error(std::string_view name, GLuint program, std::span<const Shader> shaders) {
    GLint log_length = value_of(program, GL_INFO_LOG_LENGTH);
    std::string log(static_cast<std::size_t>(log_length), '\0');
    glGetProgramInfoLog(program, log_length, &log_length, log.data());
    log.resize(static_cast<std::size_t>(log_length));
    while (!log.empty() && log.back() == '\n') log.pop_back();
    return Error(name, "does not link: {}{}", log, crowded_stage(shaders));
}

GLuint linked(std::string_view name, std::span<const Shader> shaders) {
    Object<delete_program> program(glCreateProgram());
    label(GL_PROGRAM, program.id(), name);
    glProgramParameteri(program.id(), GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
    for (const Shader& shader : shaders) glAttachShader(program.id(), shader.id());
    glLinkProgram(program.id());
    for (const Shader& shader : shaders) glDetachShader(program.id(), shader.id());
    if (value_of(program.id(), GL_LINK_STATUS) == 0) {
        check_not_lost(name);
        throw link_error(name, program.id(), shaders);
    }
    return program.release();
}

/// Expands a compute shader. If dispatches are limited in time, the result can be started in pieces.
ExpandedSource expand_compute(const ShaderSource& source, const Defines& defines) {
    ExpandedSource expanded = expand(source, defines);
    if (run_limits().dispatch_seconds > 0) return with_pieces(std::move(expanded));
    return expanded;
}

std::uint64_t next_serial() {
    static std::atomic<std::uint64_t> last = 0;
    return ++last;
}

/// Returns the serial of the program that has bound a resource to the slot last on this thread; 0: none has. Slots are
/// state of a context. A thread that uses several contexts may see owners of another one, never itself by mistake.
std::uint64_t& owner_of(const Slot& slot) {
    static thread_local std::map<std::pair<SlotKind, GLuint>, std::uint64_t> owners;
    return owners[{slot.kind, slot.index}];
}

/// Throws Error if the driver allows no block of the buffer's size.
void check_size(std::string_view program, const Slot& slot, const Buffer& buffer, std::size_t most) {
    if (buffer.bytes() > most)
        throw Error(program, "{} '{}' gets buffer '{}' of {} bytes, the driver allows {}", name(slot.kind), slot.name,
                    buffer.name(), buffer.bytes(), most);
}

}  // namespace

std::string program_text(const std::vector<ShaderSource>& stages, const Defines& defines) {
    if (stages.size() == 1) return expand_compute(stages[0], defines).text;
    std::string text;
    for (const ShaderSource& stage : stages) {
        if (!text.empty()) text += '\0';
        text += expand(stage, defines).text;
    }
    return text;
}

Program::Program(std::string name, std::string text, GLuint id)
    : name_(std::move(name)),
      text_(std::move(text)),
      object_(id),
      serial_(next_serial()),
      slots_(assign_slots(name_, id)) {
    if (const std::string what = unmet(slot_requirements(slots_)); !what.empty()) throw Error(name_, "{}", what);
}

Program Program::compute(const ShaderSource& source, const Defines& defines, const ProgramBinaries* binaries) {
    ExpandedSource expanded = expand_compute(source, defines);
    const GLuint id = loaded_or_made(source.name, expanded.text, binaries, [&] {
        return linked(source.name, std::array{compile_stage(GL_COMPUTE_SHADER, source, expanded)});
    });
    Program program(source.name, std::move(expanded.text), id);
    if (const double limit = run_limits().dispatch_seconds; limit > 0)
        program.pieces_ = std::make_unique<PieceSize>(limit);
    keep_sources(program.name(), {{"comp", program.text()}});
    return program;
}

Program Program::graphics(const ShaderSource& vertex, const ShaderSource& fragment, const Defines& defines,
                          const ProgramBinaries* binaries) {
    const ExpandedSource vertex_text = expand(vertex, defines);
    const ExpandedSource fragment_text = expand(fragment, defines);
    const std::string name = vertex.name + " + " + fragment.name;
    std::string text = vertex_text.text + '\0' + fragment_text.text;
    const GLuint id = loaded_or_made(name, text, binaries, [&] {
        return linked(name, std::array{compile_stage(GL_VERTEX_SHADER, vertex, vertex_text),
                                       compile_stage(GL_FRAGMENT_SHADER, fragment, fragment_text)});
    });
    Program program(name, std::move(text), id);
    keep_sources(name, {{"vert", vertex_text.text}, {"frag", fragment_text.text}});
    return program;
}

void Program::bind() const {
    for (const Slot& s : slots_)
        if (!s.shared && owner_of(s) != serial_)
            throw Error(name_, "runs with nothing bound to {} '{}'", gpu::name(s.kind), s.name);
    glUseProgram(id());
}

GLint Program::uniform(std::string_view name) const {
    if (const auto found = uniforms_.find(name); found != uniforms_.end()) return found->second;
    std::string key(name);
    const GLint location = glGetUniformLocation(id(), key.c_str());
    const bool is_value = location < 0 ? declares(fmt::format("uniform {}", name.substr(0, name.find_first_of(".["))))
                                       : std::ranges::find(slots_, name, &Slot::name) == slots_.end();
    if (!is_value) throw Error(name_, "has no uniform '{}'", name);
    return uniforms_.emplace(std::move(key), location).first->second;
}

void Program::set(std::string_view name, int value) const {
    glProgramUniform1i(id(), uniform(name), value);
}
void Program::set(std::string_view name, std::uint32_t value) const {
    glProgramUniform1ui(id(), uniform(name), value);
}
void Program::set(std::string_view name, float value) const {
    glProgramUniform1f(id(), uniform(name), value);
}
void Program::set(std::string_view name, const vec2& value) const {
    glProgramUniform2fv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const vec3& value) const {
    glProgramUniform3fv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const vec4& value) const {
    glProgramUniform4fv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const ivec2& value) const {
    glProgramUniform2iv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const ivec3& value) const {
    glProgramUniform3iv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const ivec4& value) const {
    glProgramUniform4iv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const uvec2& value) const {
    glProgramUniform2uiv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const uvec3& value) const {
    glProgramUniform3uiv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const uvec4& value) const {
    glProgramUniform4uiv(id(), uniform(name), 1, &value.x);
}
void Program::set(std::string_view name, const mat3& value) const {
    glProgramUniformMatrix3fv(id(), uniform(name), 1, GL_FALSE, &value[0].x);
}
void Program::set(std::string_view name, const mat4& value) const {
    glProgramUniformMatrix4fv(id(), uniform(name), 1, GL_FALSE, &value[0].x);
}

bool Program::declares(std::string_view identifier) const {
    if (std::ranges::find(slots_, identifier, &Slot::name) != slots_.end()) return true;
    if (declared_.empty()) declared_ = declarations(text_);
    return declared_.contains(identifier);
}

/// Returns the slot of that name and kind, which this program owns from then on, or null if it is not active.
const Slot* Program::slot(std::string_view name, SlotKind kind, const std::string& resource) const {
    const auto found = std::ranges::find(slots_, name, &Slot::name);
    if (found != slots_.end() && found->kind == kind) return owner_of(*found) = serial_, &*found;
    if (found == slots_.end() && declares(fmt::format("{} {}", gpu::name(kind), name))) return nullptr;
    throw Error(name_, "has no {} '{}' to bind '{}' to", gpu::name(kind), name, resource);
}

void Program::bind_storage(std::string_view block, const Buffer& buffer) const {
    if (const Slot* s = slot(block, SlotKind::storage_block, buffer.name())) {
        check_size(name_, *s, buffer, run_limits().storage_block_bytes);
        buffer.bind_storage(s->index);
    }
}
void Program::bind_uniform(std::string_view block, const Buffer& buffer) const {
    if (const Slot* s = slot(block, SlotKind::uniform_block, buffer.name())) {
        check_size(name_, *s, buffer, run_limits().uniform_block_bytes);
        buffer.bind_uniform(s->index);
    }
}
void Program::bind_texture(std::string_view sampler, const Texture& texture) const {
    if (const Slot* s = slot(sampler, SlotKind::sampler, texture.name())) texture.bind(s->index);
}
void Program::bind_texture(std::string_view sampler, const Buffer& buffer, GLenum format) const {
    if (const Slot* s = slot(sampler, SlotKind::sampler, buffer.name())) buffer.bind_texture(s->index, format);
}
void Program::bind_image(std::string_view image, const Texture& texture) const {
    if (const Slot* s = slot(image, SlotKind::image, texture.name())) texture.bind_image(s->index, GL_READ_WRITE);
}

void Program::dispatch(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    const std::array counts{x, y, z}, most = run_limits().groups;
    for (std::size_t axis = 0; axis < counts.size(); ++axis)
        if (counts[axis] > most[axis])
            throw Error(name_, "needs {} workgroups along {}, the driver allows {} (GL_MAX_COMPUTE_WORK_GROUP_COUNT)",
                        counts[axis], "xyz"[axis], most[axis]);
    bind();
    if (pieces_)
        start_in_pieces(counts);
    else
        glDispatchCompute(x, y, z);
}

template <class Start>
void Program::start_timed(std::uint64_t groups, Start start) const {
    if (pieces_->timed()) return pieces_->add(groups, timed(start));
    start();
    pieces_->add_untimed();
}

void Program::start_in_pieces(const GroupCounts& counts) const {
    const std::uint64_t all = std::uint64_t{counts[0]} * counts[1] * counts[2];
    for_each_piece(
        counts, [&] { return pieces_->groups(); },
        [&](const GroupCounts& first, const GroupCounts& piece) {
            const std::uint64_t groups = std::uint64_t{piece[0]} * piece[1] * piece[2];
            const bool whole = groups == all;
            set("halflight_first_group", uvec3(first[0], first[1], first[2]));
            set("halflight_groups", whole ? uvec3(0) : uvec3(counts[0], counts[1], counts[2]));
            start_timed(groups, [&] { glDispatchCompute(piece[0], piece[1], piece[2]); });
            if (!whole) glFlush();  // the driver would otherwise put the pieces together into one submission
        });
}

void Program::dispatch_indirect(const Buffer& arguments, std::uint64_t most, std::size_t offset) const {
    bind();
    const auto start = [&] {
        glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, arguments.id());
        glDispatchComputeIndirect(static_cast<GLintptr>(offset));
    };
    if (!pieces_) return start();
    if (pieces_->takes_all_of(most)) {  // reading the counts would wait for the work that makes them
        set("halflight_first_group", uvec3(0));
        set("halflight_groups", uvec3(0));
        start();
        return pieces_->add_untimed();
    }
    const std::vector<std::uint32_t> counts = arguments.read<std::uint32_t>(offset / sizeof(std::uint32_t), 3);
    start_in_pieces({counts[0], counts[1], counts[2]});
}

void Program::draw(GLenum mode, std::uint32_t vertices, std::uint32_t instances) const {
    bind();
    glDrawArraysInstanced(mode, 0, static_cast<GLsizei>(vertices), static_cast<GLsizei>(instances));
}

}  // namespace halflight::gpu
