// Renders a picture and a sequence of two frames through the public headers: consumer SCENE PICTURE.exr FRAMES.##.exr
#include <halflight/halflight.h>
#include <cstdio>

int main(int argc, char** argv) {
    if (argc != 4) return 2;
    try {
        halflight::LoadedScene scene({.scene = argv[1]});
        halflight::RenderSettings settings;
        settings.width = settings.height = 16;
        settings.samples = 1;
        settings.aovs = {"albedo"};
        halflight::FrameRenderer renderer(scene, settings);
        const halflight::RenderResult picture = renderer.render();
        halflight::write_picture(argv[2], picture, picture_info(renderer, picture, {}, ""));

        const halflight::SequenceOptions options{.frames = {1, 2}, .outputs = {argv[3]}};
        const auto made = halflight::render_sequence(scene, settings, {.shutter = {.open = 0.5, .times = 1}}, options);
        const auto kept = halflight::render_sequence(scene, settings, {.shutter = {.open = 0.5, .times = 1}}, options);
        return made.made == 2 && kept.kept == 2 ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "consumer: %s\n", error.what());
        return 1;
    }
}
