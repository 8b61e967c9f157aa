// Library to preload: lets a driver lose its context after as many checks as HALFLIGHT_LOSE_AFTER says. Drivers cannot
// be asked to do so. The program finds OpenGL through pointers of libepoxy, one of which is replaced here.
#include <epoxy/gl.h>

#include <atomic>
#include <cstdlib>

namespace {

GLenum GLAPIENTRY status() {
    static std::atomic<int> left = std::atoi(std::getenv("HALFLIGHT_LOSE_AFTER"));
    return left-- > 0 ? GL_NO_ERROR : GL_UNKNOWN_CONTEXT_RESET;
}

[[gnu::constructor]] void replace() {
    epoxy_glGetGraphicsResetStatus = status;
}

}  // namespace
