#include "renderer/frame_options.h"

#include "renderer/film.h"

namespace halflight {

FrameOptions frame_options(const RenderSettings& settings, const Estimator& asked) {
    return {.bounces = bounces_of(settings),
            .want_squares = asked_for(settings, {LayerSource::squares}) || settings.adaptive,
            .want_features =
                asked_for(settings, {LayerSource::features}) || settings.preview.of_picture() || has_halves(settings),
            .denoise = has_halves(settings),
            .adaptive = settings.adaptive,
            .want_hits = asked_for(settings, {LayerSource::objects, LayerSource::materials}),
            .culling = settings.culling,
            .runs = std::uint64_t(settings.pictures) * std::uint64_t(settings.samples),
            .kept = settings.kept,
            .light_groups = static_cast<int>(light_group_layers(settings).size()),
            .clamp = settings.clamp,
            .primary = settings.primary,
            .backfaces = settings.backfaces,
            .group_size = static_cast<int>(settings.estimator.reuse),
            .group_size_piloted = asked.reuse == Reuse::automatic,
            .camera_rays_piloted = asked.camera == CameraRays::automatic,
            .camera_rays = static_cast<int>(settings.estimator.camera),
            .lens = settings.camera.lens.blurs(),
            .optics = settings.camera.optics.traced(),
            .show_lamps = settings.show_lamps,
            .shadow_rays = static_cast<int>(settings.estimator.shadow),
            .preview = settings.preview};
}

FrameOptions cached_options(FrameOptions options) {
    options.group_size = 1, options.group_size_piloted = false, options.radiance_cache = true;
    return options;
}

FrameOptions listed_options(FrameOptions options) {
    options.group_size = 1, options.group_size_piloted = false, options.camera_rays = 1, options.want_hits = false;
    options.primary = PrimaryVisibility::traced;
    return options;
}

}  // namespace halflight
