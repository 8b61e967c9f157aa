#include "tools/view/display.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <span>

#include "engine/core/image_tools.h"
#include "engine/gpu/context.h"

namespace halflight::view {

void Display::set_view(const ViewProcessor& view) {
    const GpuShader shader = view.gpu_shader();
    for (std::optional<Source>* picture : {&picture_, &comparison_})
        if (*picture) (*picture)->view_applied = false;
    if (view_ && view_id_ == shader.cache_id) {
        view_->exposure_scale = view.exposure_scale();
        return;
    }
    View made{{"shaders/view.frag through " + view.view() + " " + shader.cache_id,
               shader.glsl + "\n#include \"shaders/view.frag\"\n"},
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

Display::Source::Source(const gpu::TextureDesc& desc)
    : linear("picture", desc),
      shown("picture as it is shown", {desc.width, desc.height, GL_RGBA8}),
      target("picture as it is shown", std::array<const gpu::Texture*, 1>{&shown}) {}

void Display::upload(const DisplayImage& seen, std::optional<Source>& to) {
    const Image& image = seen.image;
    const GLenum format = image.channels == 4 ? GL_RGBA32F : GL_RGB32F;
    const gpu::TextureDesc desc{image.width, image.height, format};
    if (!to || to->linear.desc() != desc) to.emplace(desc);
    to->linear.upload(std::span<const float>(image.pixels));
    to->encoded = seen.encoded;
    to->view_applied = false;
}

void Display::set_picture(const DisplayImage& seen) {
    upload(seen, picture_);
}

void Display::set_comparison(const DisplayImage& seen) {
    upload(seen, comparison_);
    if (picture_) picture_->view_applied = false;
}

void Display::close_comparison() {
    comparison_.reset();
    if (picture_) picture_->view_applied = false;
}

void Display::set_difference(bool on) {
    if (on != difference_ && picture_) picture_->view_applied = false;
    difference_ = on;
}

void Display::keep_comparison() {
    const gpu::TextureDesc& desc = picture_->linear.desc();
    comparison_.emplace(desc);
    glCopyImageSubData(picture_->linear.id(), desc.target, 0, 0, 0, 0, comparison_->linear.id(), desc.target, 0, 0, 0,
                       0, desc.width, desc.height, 1);
    comparison_->encoded = picture_->encoded;
    picture_->view_applied = false;
}

void Display::reload_shaders() {
    if (programs_.reload() == 0) return;
    for (std::optional<Source>* picture : {&picture_, &comparison_})
        if (*picture) (*picture)->view_applied = false;
}

void Display::apply_view(Source& picture) {
    if (picture.view_applied) return;
    gpu::default_state();
    picture.target.bind();
    const bool difference = difference_ && can_subtract() && &picture == &*picture_;
    const bool encoded = picture.encoded || !view_;
    gpu::Defines defines;
    if (!encoded) defines.set("HALFLIGHT_VIEW");
    if (difference) defines.set("HALFLIGHT_DIFFERENCE");
    const gpu::Program& program = encoded
                                      ? programs_.graphics("shaders/raster_cover.vert", "shaders/view.frag", defines)
                                      : programs_.graphics("shaders/raster_cover.vert", view_->source, defines);
    program.bind_texture("picture", picture.linear);
    if (difference) program.bind_texture("other", comparison_->linear);
    if (!encoded) {
        for (const auto& [sampler, texture] : view_->luts) program.bind_texture(sampler, texture);
        program.set("exposure_scale", view_->exposure_scale);
    }
    program.draw(GL_TRIANGLES, 3);
    picture.view_applied = true;
}

void Display::compose(GLuint framebuffer, int left, int right, int top, int bottom, float split) {
    const int width = right - left, height = std::abs(bottom - top);
    const auto blit = [&](Source& picture) {
        apply_view(picture);
        const gpu::Framebuffer& target = picture.target;
        const bool whole = target.width() == width && target.height() == height;
        glBlitNamedFramebuffer(target.id(), framebuffer, 0, 0, target.width(), target.height(), left, top, right,
                               bottom, GL_COLOR_BUFFER_BIT, whole ? GL_NEAREST : GL_LINEAR);
    };
    blit(*picture_);
    if (!comparison_) return;
    apply_view(*comparison_);  // the scissor test must still be off
    const int first = left + static_cast<int>(std::lround(split * static_cast<float>(width)));
    glEnable(GL_SCISSOR_TEST);
    glScissor(first, std::min(top, bottom), right - first, height);
    blit(*comparison_);
    glDisable(GL_SCISSOR_TEST);
}

void Display::draw(const ivec2& framebuffer, const Rectangle& where, float split) {
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, framebuffer.x, framebuffer.y);
    glClearColor(0, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    if (empty()) return;
    // The window's first row is the bottom one.
    compose(0, where.origin.x, where.end().x, framebuffer.y - where.origin.y, framebuffer.y - where.end().y, split);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

Image Display::read(float split) {
    const int width = picture_->target.width(), height = picture_->target.height();
    const gpu::Texture both("pictures as they are shown", {width, height, GL_RGBA8});
    const gpu::Framebuffer target("pictures as they are shown", std::array<const gpu::Texture*, 1>{&both});
    compose(target.id(), 0, width, 0, height, split);
    Image image(width, height, 4);
    image.pixels = both.read_float();
    return rgb(image);
}

}  // namespace halflight::view
