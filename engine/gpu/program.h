// Programs, compiled from the shaders/ folder (see shader_source.h).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/math.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/dispatch_pieces.h"
#include "engine/gpu/object.h"
#include "engine/gpu/program_binaries.h"
#include "engine/gpu/program_slots.h"
#include "engine/gpu/shader_source.h"
#include "engine/gpu/texture.h"

namespace halflight::gpu {

/// A linked program. It keeps the values of its uniforms between uses. Resources are bound by their names in the
/// shader; the slots follow from the linked program (program_slots.h).
class Program {
  public:
    /// Compiles and links a program. `binaries`, if not null, stores linked programs for later runs. Throws
    /// Error("shaders/x.comp:12", message) if a shader does not compile. Throws Error(name, ...) if the program
    /// does not link, needs more than the driver allows (program_limits.h), or has resources that cannot be bound by
    /// name (program_slots.h).
    static Program compute(const ShaderSource& source, const Defines& defines = {},
                           const ProgramBinaries* binaries = nullptr);
    static Program graphics(const ShaderSource& vertex, const ShaderSource& fragment, const Defines& defines = {},
                            const ProgramBinaries* binaries = nullptr);

    GLuint id() const { return object_.id(); }
    const std::string& name() const { return name_; }
    const std::string& text() const { return text_; }  ///< Returns the source of all stages as compiled.
    /// Makes this program current. Throws Error naming program and resource if an active resource was never bound,
    /// or if another program has taken its slot since. Scene tables are not checked.
    void bind() const;

    /// Returns the location of a uniform, -1 if the name is declared but not active. Throws Error if the source
    /// declares no such uniform.
    GLint uniform(std::string_view name) const;
    void set(std::string_view name, bool value) const { set(name, static_cast<int>(value)); }
    void set(std::string_view name, int value) const;
    void set(std::string_view name, std::uint32_t value) const;
    void set(std::string_view name, float value) const;
    void set(std::string_view name, const vec2& value) const;
    void set(std::string_view name, const vec3& value) const;
    void set(std::string_view name, const vec4& value) const;
    void set(std::string_view name, const ivec2& value) const;
    void set(std::string_view name, const ivec3& value) const;
    void set(std::string_view name, const ivec4& value) const;
    void set(std::string_view name, const uvec2& value) const;
    void set(std::string_view name, const uvec3& value) const;
    void set(std::string_view name, const uvec4& value) const;
    void set(std::string_view name, const mat3& value) const;
    void set(std::string_view name, const mat4& value) const;

    /// Binds a resource to the block, sampler or image of this name. The binding holds until another program's resource
    /// takes the slot, so bind right before the dispatch or draw. A name that is declared but not active does nothing.
    /// Throws Error naming program and resource if the shader declares no such resource, or the buffer is too large.
    void bind_storage(std::string_view block, const Buffer& buffer) const;
    void bind_uniform(std::string_view block, const Buffer& buffer) const;
    void bind_texture(std::string_view sampler, const Texture& texture) const;
    void bind_texture(std::string_view sampler, const Buffer& buffer, GLenum format) const;  ///< `format` is sized
    void bind_image(std::string_view image, const Texture& texture) const;
    /// Returns the slots of all active resources.
    const std::vector<Slot>& slots() const { return slots_; }
    /// Returns whether the source declares a name, or a kind and name (declarations.h), active or not.
    bool declares(std::string_view identifier) const;

    /// Binds the program and starts workgroups, at most as many as the driver allows. The graph places the barriers.
    /// If dispatches are limited in time (dispatch_pieces.h), they are started in pieces.
    void dispatch(std::uint32_t x, std::uint32_t y = 1, std::uint32_t z = 1) const;
    /// Binds the program and starts workgroups; their counts are three uints at `offset` bytes of the buffer. There are
    /// at most `most` of them.
    void dispatch_indirect(const Buffer& arguments, std::uint64_t most, std::size_t offset = 0) const;
    /// Binds the program and draws `vertices` vertices without attributes (gl_VertexID), `instances` times.
    void draw(GLenum mode, std::uint32_t vertices, std::uint32_t instances = 1) const;

  private:
    Program(std::string name, std::string text, GLuint id);
    const Slot* slot(std::string_view name, SlotKind kind, const std::string& resource) const;
    void start_in_pieces(const GroupCounts& counts) const;
    /// Starts workgroups, by `start`, and takes their time if it is wanted. `groups`: their number.
    template <class Start>
    void start_timed(std::uint64_t groups, Start start) const;

    std::string name_;
    std::string text_;  // source of all stages
    Object<delete_program> object_;
    std::uint64_t serial_;  // unique in the process
    std::vector<Slot> slots_;
    mutable std::set<std::string, std::less<>> declared_;  // declarations(text_), made when a name is not active
    mutable std::map<std::string, GLint, std::less<>> uniforms_;
    std::unique_ptr<PieceSize> pieces_;  // null: dispatches are not limited in time
};

/// Returns Program::text() of a program with these stages: a compute shader, or a vertex and a fragment shader.
std::string program_text(const std::vector<ShaderSource>& stages, const Defines& defines);

}  // namespace halflight::gpu
