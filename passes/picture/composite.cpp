#include "passes/picture/composite.h"

namespace halflight {

using graph::Access;

ViewKernel::ViewKernel(const ViewProcessor& processor)
    : exposure_scale_(processor.exposure_scale()),
      source_("composite through " + processor.view(), ""),
      develop_source_("develop through " + processor.view(), "") {
    const GpuShader shader = processor.gpu_shader();
    source_.text = shader.glsl + "\n#include \"shaders/composite.comp\"\n";
    develop_source_.text = shader.glsl + "\n#include \"shaders/develop.comp\"\n";
    for (const GpuLut& lut : shader.luts) {
        gpu::TextureDesc desc;
        desc.width = lut.width, desc.height = lut.height, desc.depth = lut.depth;
        desc.format = lut.channels == 1 ? GL_R32F : GL_RGB32F;
        desc.target = lut.dimensions == 1 ? GL_TEXTURE_1D : lut.dimensions == 2 ? GL_TEXTURE_2D : GL_TEXTURE_3D;
        Lut& made = luts_.emplace_back(Lut{lut.sampler, gpu::Texture(lut.sampler, desc)});
        made.texture.upload(std::span<const float>(lut.values));
        made.texture.set_filter(lut.linear ? GL_LINEAR : GL_NEAREST);
    }
}

void ViewKernel::bind(const gpu::Program& program) const {
    for (const Lut& lut : luts_) program.bind_texture(lut.sampler, lut.texture);
}

Composite add_composite(graph::Graph& graph, const Band& band, const Accumulated& sums, int samples,
                        bool opaque_background, const ViewKernel* view_kernel, bool straight_view) {
    Composite out;
    gpu::Defines defines;
    graph::Pass pass = graph.add_pass("composite");
    read_light(pass, defines, sums);
    if (sums.catchers) {
        pass.read(sums.catchers, Access::storage_read, "Catchers");
        defines.set("HALFLIGHT_CATCHERS");
    }
    const gpu::TextureDesc picture{band.image.x, band.rows, GL_RGBA32F};
    out.beauty = pass.write(graph.create_texture("beauty", picture), Access::image_write, "beauty");
    if (view_kernel) {
        out.view = pass.write(graph.create_texture("view", picture), Access::image_write, "view");
        defines.set("HALFLIGHT_VIEW");
    }
    if (view_kernel && straight_view) defines.set("HALFLIGHT_STRAIGHT_VIEW");
    if (opaque_background) defines.set("HALFLIGHT_OPAQUE_BACKGROUND");
    graph::Kernel kernel{view_kernel ? view_kernel->source() : "shaders/composite.comp", defines};
    if (view_kernel)
        kernel.bind = [view_kernel](graph::Resources&, const gpu::Program& program) { view_kernel->bind(program); };
    pass.kernel(std::move(kernel));
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        if (view_kernel) program.set("exposure_scale", view_kernel->exposure_scale());
        program.set("samples", static_cast<std::uint32_t>(samples));
        program.set("size", ivec2(band.image.x, band.rows));
        program.set("tiles", band.tiles());
        program.dispatch(band.paths() / 64);
    });
    return out;
}

graph::TextureHandle add_view(graph::Graph& graph, graph::TextureHandle picture, const ViewKernel& view_kernel,
                              bool straight_view) {
    const gpu::TextureDesc desc = graph.desc(picture);
    graph::Pass pass = graph.add_pass("develop");
    pass.read(picture, Access::texture_read, "picture");
    const graph::TextureHandle view = pass.write(graph.create_texture("view", desc), Access::image_write, "view");
    gpu::Defines defines;
    if (straight_view) defines.set("HALFLIGHT_STRAIGHT_VIEW");
    graph::Kernel kernel{view_kernel.develop_source(), defines};
    kernel.bind = [&view_kernel](graph::Resources&, const gpu::Program& program) { view_kernel.bind(program); };
    pass.kernel(std::move(kernel));
    pass.execute([=, &view_kernel](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("exposure_scale", view_kernel.exposure_scale());
        program.dispatch(static_cast<std::uint32_t>(desc.width + 7) / 8,
                         static_cast<std::uint32_t>(desc.height + 7) / 8);
    });
    return view;
}

}  // namespace halflight
