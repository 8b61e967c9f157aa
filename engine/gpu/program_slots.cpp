#include "engine/gpu/program_slots.h"

#include "shaders/shared/bindings.h"

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

void assign_uniforms(GLuint program, std::vector<Slot>& slots) {
    const ActiveResources uniforms(program, GL_UNIFORM);
    GLuint next_unit = UNIT_FREE, next_image = 0;
    for (GLuint i = 0; i < uniforms.count(); ++i) {
        const GLint type = uniforms.value(i, GL_TYPE);
        const bool image = is_image(type);
        if (!image && !is_sampler(type)) continue;
        const GLint location = uniforms.value(i, GL_LOCATION);
        GLint unit = 0;
        glGetUniformiv(program, location, &unit);
        if (image || unit == 0) {
            unit = static_cast<GLint>(image ? next_image++ : next_unit++);
            glProgramUniform1i(program, location, unit);
        }
        slots.push_back({uniforms.name(i), image ? SlotKind::image : SlotKind::sampler, static_cast<GLuint>(unit)});
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

std::vector<Slot> assign_slots(GLuint program) {
    std::vector<Slot> slots;
    const ActiveResources storage(program, GL_SHADER_STORAGE_BLOCK), uniform(program, GL_UNIFORM_BLOCK);
    for (GLuint i = 0; i < storage.count(); ++i) {
        glShaderStorageBlockBinding(program, i, i);
        slots.push_back({storage.name(i), SlotKind::storage_block, i});
    }
    for (GLuint i = 0; i < uniform.count(); ++i) {
        glUniformBlockBinding(program, i, i);
        slots.push_back({uniform.name(i), SlotKind::uniform_block, i});
    }
    assign_uniforms(program, slots);
    return slots;
}

}  // namespace halflight::gpu
