#include "tools/view/display.h"

#include <epoxy/gl.h>

#include <span>

#include "engine/core/image_tools.h"
#include "engine/gpu/context.h"
#include "shaders/shared/bindings.h"

namespace halflight::view {

void Display::set_view(const ViewProcessor& view) {
    const GpuShader shader = view.gpu_shader();
    developed_ = false;
    if (view_ && view_id_ == shader.cache_id) {
        view_->exposure_scale = view.exposure_scale();
        return;
    }
    View made{
        {"view through " + view.view() + " " + shader.cache_id, shader.glsl + "\n#include \"shaders/view.frag\"\n"},
        {},
        view.exposure_scale()};
    for (const GpuLut& lut : shader.luts) {
        gpu::TextureDesc desc;
        desc.width = lut.width, desc.height = lut.height, desc.depth = lut.depth;
        desc.format = lut.channels == 1 ? GL_R32F : GL_RGB32F;
        desc.target = lut.dimensions == 1 ? GL_TEXTURE_1D : lut.dimensions == 2 ? GL_TEXTURE_2D : GL_TEXTURE_3D;
        gpu::Texture& texture = made.luts.emplace_back(lut.sampler, gpu::Texture(lut.sampler, desc)).second;
        texture.upload(std::span<const float>(lut.values));
        texture.set_filter(lut.linear ? GL_LINEAR : GL_NEAREST);
    }
    view_ = std::move(made);
    view_id_ = shader.cache_id;
}

void Display::set_picture(const Seen& seen) {
    const Image& image = seen.image;
    const GLenum format = image.channels == 4 ? GL_RGBA32F : GL_RGB32F;
    const gpu::TextureDesc desc{image.width, image.height, format};
    if (!linear_ || linear_->desc() != desc) {
        const gpu::TextureDesc shown{image.width, image.height, GL_RGBA8};
        target_.reset();
        linear_.emplace("picture", desc);
        shown_.emplace("picture as it is shown", shown);
        const gpu::Texture* const colors[] = {&*shown_};
        target_.emplace("picture as it is shown", colors);
    }
    linear_->upload(std::span<const float>(image.pixels));
    encoded_ = seen.encoded;
    developed_ = false;
}

void Display::develop() {
    if (developed_) return;
    gpu::default_state();
    target_->bind();
    linear_->bind(0);
    if (encoded_ || !view_) {
        programs_.graphics("shaders/raster_cover.vert", "shaders/view.frag").draw(GL_TRIANGLES, 3);
    } else {
        const gpu::Program& program =
            programs_.graphics("shaders/raster_cover.vert", view_->source, {{"HALFLIGHT_VIEW", "1"}});
        int unit = UNIT_FREE;
        for (const auto& [sampler, texture] : view_->luts) {
            texture.bind(static_cast<GLuint>(unit));
            program.set(sampler, unit++);
        }
        program.set("exposure_scale", view_->exposure_scale);
        program.draw(GL_TRIANGLES, 3);
    }
    developed_ = true;
}

void Display::draw(const ivec2& framebuffer) {
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, framebuffer.x, framebuffer.y);
    glClearColor(0, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    if (empty()) return;
    develop();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    // The window's first row is the lower one.
    const bool whole = target_->width() == framebuffer.x && target_->height() == framebuffer.y;
    glBlitNamedFramebuffer(target_->id(), 0, 0, 0, target_->width(), target_->height(), 0, framebuffer.y, framebuffer.x,
                           0, GL_COLOR_BUFFER_BIT, whole ? GL_NEAREST : GL_LINEAR);
}

Image Display::read() {
    develop();
    Image image(target_->width(), target_->height(), 4);
    image.pixels = shown_->read_float();
    return rgb(image);
}

}  // namespace halflight::view
