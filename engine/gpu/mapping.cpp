#include "engine/gpu/mapping.h"

#include <epoxy/gl.h>

#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/gpu/gl_string.h"

namespace halflight::gpu {

bool renders_on_processor() {
    return is_software_renderer(gl_string(GL_RENDERER));
}

Mapping::Mapping(const Buffer& buffer, Access access) : id_(buffer.id()) {
    GLint64 bytes = 0;
    glGetNamedBufferParameteri64v(id_, GL_BUFFER_SIZE, &bytes);
    data_ = glMapNamedBufferRange(id_, 0, static_cast<GLsizeiptr>(bytes),
                                  access == Access::read ? GL_MAP_READ_BIT : GL_MAP_WRITE_BIT);
    if (data_ != nullptr) return;
    glGetError();  // clears the GL error, which the exception reports
    throw Error("buffer '" + buffer.name() + "'", "the driver does not map it");
}

Mapping::~Mapping() {
    glUnmapNamedBuffer(id_);
}

}  // namespace halflight::gpu
