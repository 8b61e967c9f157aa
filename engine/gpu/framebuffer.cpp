#include "engine/gpu/framebuffer.h"

#include <array>
#include <vector>

#include "engine/core/error.h"
#include "engine/gpu/context.h"

namespace halflight::gpu {

Framebuffer::Framebuffer(std::string name, std::span<const Texture* const> colors, const Texture* depth) {
    GLuint id = 0;
    glCreateFramebuffers(1, &id);
    object_ = Object<delete_framebuffer>(id);
    label(GL_FRAMEBUFFER, id, name);
    const auto attach = [&](GLenum point, const Texture& texture) {
        glNamedFramebufferTexture(id, point, texture.id(), 0);
        const TextureDesc& desc = texture.desc();
        if (width_ != 0 && (width_ != desc.width || height_ != desc.height)) {
            throw Error("framebuffer '" + name + "'", "texture '{}' is {} x {} texels, the others are {} x {}",
                        texture.name(), desc.width, desc.height, width_, height_);
        }
        width_ = desc.width;
        height_ = desc.height;
    };
    std::vector<GLenum> drawn(colors.size(), GL_NONE);
    for (std::size_t i = 0; i < colors.size(); ++i) {
        if (colors[i] == nullptr) continue;
        drawn[i] = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i);
        attach(drawn[i], *colors[i]);
    }
    if (depth != nullptr) attach(GL_DEPTH_ATTACHMENT, *depth);
    glNamedFramebufferDrawBuffers(id, static_cast<GLsizei>(drawn.size()), drawn.data());
    const GLenum status = glCheckNamedFramebufferStatus(id, GL_DRAW_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE) {
        check_not_lost("framebuffer '" + name + "'");
        throw Error("framebuffer '" + name + "'", "the driver cannot draw to it (status {:#06x})", status);
    }
}

void Framebuffer::bind() const {
    glBindFramebuffer(GL_FRAMEBUFFER, id());
    glViewport(0, 0, width_, height_);
}

void Framebuffer::clear_color(int attachment, float r, float g, float b, float a) const {
    const std::array value{r, g, b, a};
    glClearNamedFramebufferfv(id(), GL_COLOR, attachment, value.data());
}

void Framebuffer::clear_color_uint(int attachment, std::uint32_t value) const {
    const std::array values{value, value, value, value};
    glClearNamedFramebufferuiv(id(), GL_COLOR, attachment, values.data());
}

void Framebuffer::clear_depth(float depth) const {
    glClearNamedFramebufferfv(id(), GL_DEPTH, 0, &depth);
}

}  // namespace halflight::gpu
