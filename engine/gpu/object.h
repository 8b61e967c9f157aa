// Owner of an OpenGL object name.
#pragma once

#include <epoxy/gl.h>

#include <string_view>
#include <utility>

namespace halflight::gpu {

/// Owns an object name and deletes it with Delete; move-only. It must not outlive the Context of its creation.
template <void (*Delete)(GLuint)>
class Object {
  public:
    Object() = default;
    explicit Object(GLuint id) : id_(id) {}
    Object(Object&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
    Object& operator=(Object&& other) noexcept {
        std::swap(id_, other.id_);
        return *this;
    }
    ~Object() {
        if (id_ != 0) Delete(id_);
    }
    GLuint id() const { return id_; }
    GLuint release() { return std::exchange(id_, 0); }

  private:
    GLuint id_ = 0;
};

void delete_buffer(GLuint id);
void delete_texture(GLuint id);
void delete_framebuffer(GLuint id);
void delete_vertex_array(GLuint id);
void delete_shader(GLuint id);
void delete_program(GLuint id);

/// Sets the debug label, truncated to the driver's limit. `kind`: GL_BUFFER, GL_TEXTURE, ...
void label(GLenum kind, GLuint id, std::string_view name);

}  // namespace halflight::gpu
