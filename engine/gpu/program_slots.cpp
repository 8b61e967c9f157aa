#include "engine/gpu/program_slots.h"

#include "engine/core/error.h"
#include "shaders/shared/texture_units.h"

namespace halflight::gpu {
namespace {

bool is_sampler(GLint type) {
    switch (type) {
        case GL_SAMPLER_1D:
        case GL_SAMPLER_2D:
        case GL_SAMPLER_3D:
        case GL_SAMPLER_BUFFER:
        case GL_INT_SAMPLER_2D:
        case GL_INT_SAMPLER_BUFFER:
        case GL_UNSIGNED_INT_SAMPLER_2D:
        case GL_UNSIGNED_INT_SAMPLER_BUFFER:
            return true;
        default:
            return false;
    }
}

bool is_image(GLint type) {
    return type == GL_IMAGE_2D || type == GL_IMAGE_3D || type == GL_INT_IMAGE_2D || type == GL_UNSIGNED_INT_IMAGE_2D;
}

/// Returns whether Program::set() takes values of the type.
bool is_value(GLint type) {
    switch (type) {
        case GL_BOOL:
        case GL_INT:
        case GL_INT_VEC2:
        case GL_INT_VEC3:
        case GL_INT_VEC4:
        case GL_UNSIGNED_INT:
        case GL_UNSIGNED_INT_VEC2:
        case GL_UNSIGNED_INT_VEC3:
        case GL_UNSIGNED_INT_VEC4:
        case GL_FLOAT:
        case GL_FLOAT_VEC2:
        case GL_FLOAT_VEC3:
        case GL_FLOAT_VEC4:
        case GL_FLOAT_MAT3:
        case GL_FLOAT_MAT4:
            return true;
        default:
            return false;
    }
}

/// The resources of one kind that the program uses.
class ActiveResources {
  public:
    ActiveResources(GLuint program, GLenum kind) : program_(program), kind_(kind) {
        glGetProgramInterfaceiv(program, kind, GL_ACTIVE_RESOURCES, &count_);
    }
    GLuint count() const { return static_cast<GLuint>(count_); }
    std::string name(GLuint i) const {
        std::string name(static_cast<std::size_t>(value(i, GL_NAME_LENGTH)), '\0');
        GLsizei length = 0;
        glGetProgramResourceName(program_, kind_, i, static_cast<GLsizei>(name.size()), &length, name.data());
        name.resize(static_cast<std::size_t>(length));
        return name;
    }
    GLint value(GLuint i, GLenum property) const {
        GLint value = 0;
        glGetProgramResourceiv(program_, kind_, i, 1, &property, 1, nullptr, &value);
        return value;
    }

  private:
    GLuint program_;
    GLenum kind_;
    GLint count_ = 0;
};

/// Adds a slot. Throws Error for an element of an array, which has no name of its own in a pass.
void add(std::vector<Slot>& slots, std::string_view program, Slot slot) {
    if (slot.name.ends_with(']'))
        throw Error(program, "{} '{}' is part of an array, which cannot be bound", name(slot.kind), slot.name);
    slots.push_back(std::move(slot));
}

void assign_uniforms(std::string_view program_name, GLuint program, std::vector<Slot>& slots) {
    const ActiveResources uniforms(program, GL_UNIFORM);
    GLuint next_unit = shared::kUnitFree, next_image = 0;
    for (GLuint i = 0; i < uniforms.count(); ++i) {
        const GLint type = uniforms.value(i, GL_TYPE);
        const bool image = is_image(type);
        if (is_value(type) || uniforms.value(i, GL_BLOCK_INDEX) >= 0) continue;
        if (!image && !is_sampler(type))
            throw Error(program_name, "uniform '{}' has a type that can neither be bound nor set", uniforms.name(i));
        const GLint location = uniforms.value(i, GL_LOCATION);
        GLint unit = 0;
        glGetUniformiv(program, location, &unit);
        const bool shared = !image && unit != 0;
        if (!shared) {
            unit = static_cast<GLint>(image ? next_image++ : next_unit++);
            glProgramUniform1i(program, location, unit);
        }
        const SlotKind kind = image ? SlotKind::image : SlotKind::sampler;
        add(slots, program_name, {uniforms.name(i), kind, static_cast<GLuint>(unit), shared});
    }
}

}  // namespace

const char* name(SlotKind kind) {
    switch (kind) {
        case SlotKind::storage_block:
            return "storage block";
        case SlotKind::uniform_block:
            return "uniform block";
        case SlotKind::sampler:
            return "sampler";
        case SlotKind::image:
            return "image";
    }
    return "";
}

std::vector<Slot> assign_slots(std::string_view name, GLuint program) {
    std::vector<Slot> slots;
    const ActiveResources storage(program, GL_SHADER_STORAGE_BLOCK), uniform(program, GL_UNIFORM_BLOCK);
    for (GLuint i = 0; i < storage.count(); ++i) {
        glShaderStorageBlockBinding(program, i, i);
        add(slots, name, {storage.name(i), SlotKind::storage_block, i});
    }
    for (GLuint i = 0; i < uniform.count(); ++i) {
        glUniformBlockBinding(program, i, i);
        add(slots, name, {uniform.name(i), SlotKind::uniform_block, i});
    }
    assign_uniforms(name, program, slots);
    return slots;
}

}  // namespace halflight::gpu
