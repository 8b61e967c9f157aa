// Names and versions of the current driver.
#pragma once

#include <epoxy/gl.h>

#include <string_view>

namespace halflight::gpu {

/// Returns a text of the current context, such as GL_RENDERER; "" without a context.
inline std::string_view gl_string(GLenum name) {
    const GLubyte* const text = glGetString(name);
    return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}

}  // namespace halflight::gpu
