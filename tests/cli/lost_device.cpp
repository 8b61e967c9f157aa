// Library to preload: lets a driver lose its context after as many checks as HALFLIGHT_LOSE_AFTER says. What is read
// then is 0. Drivers cannot be asked to do so. The program finds OpenGL through pointers of libepoxy, which are
// replaced here.
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <atomic>
#include <cstdlib>
#include <cstring>

namespace {

std::atomic<int>& left() {
    static std::atomic<int> checks = std::atoi(std::getenv("HALFLIGHT_LOSE_AFTER"));
    return checks;
}

GLenum GLAPIENTRY status() {
    return left()-- > 0 ? GL_NO_ERROR : GL_UNKNOWN_CONTEXT_RESET;
}

void GLAPIENTRY read(GLuint buffer, GLintptr offset, GLsizeiptr bytes, void* to) {
    using Read = void(GLAPIENTRY*)(GLuint, GLintptr, GLsizeiptr, void*);
    static const Read driver = reinterpret_cast<Read>(eglGetProcAddress("glGetNamedBufferSubData"));
    driver(buffer, offset, bytes, to);
    if (left() <= 0) std::memset(to, 0, static_cast<std::size_t>(bytes));
}

[[gnu::constructor]] void replace() {
    epoxy_glGetGraphicsResetStatus = status;
    epoxy_glGetNamedBufferSubData = read;
}

}  // namespace
