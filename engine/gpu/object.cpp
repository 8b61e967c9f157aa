#include "engine/gpu/object.h"

#include <algorithm>

namespace halflight::gpu {

void delete_buffer(GLuint id) {
    glDeleteBuffers(1, &id);
}
void delete_texture(GLuint id) {
    glDeleteTextures(1, &id);
}
void delete_framebuffer(GLuint id) {
    glDeleteFramebuffers(1, &id);
}
void delete_vertex_array(GLuint id) {
    glDeleteVertexArrays(1, &id);
}
void delete_shader(GLuint id) {
    glDeleteShader(id);
}
void delete_program(GLuint id) {
    glDeleteProgram(id);
}

void label(GLenum kind, GLuint id, std::string_view name) {
    static constexpr std::size_t kLongest = 255;  // GL_MAX_LABEL_LENGTH is at least 256, including the terminator
    glObjectLabel(kind, id, static_cast<GLsizei>(std::min(name.size(), kLongest)), name.data());
}

}  // namespace halflight::gpu
