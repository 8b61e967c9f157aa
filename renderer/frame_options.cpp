#include "renderer/frame_options.h"

#include "renderer/film.h"

namespace halflight {

FrameOptions frame_options(const RenderSettings& settings, const Estimator& asked) {
    return {.bounces = settings.bounces,
            .want_squares = asked_for(settings, {"variance"}) || settings.preview.of_picture(),
            .want_features = asked_for(settings, {"albedo", "normal"}) || settings.preview.of_picture(),
            .want_hits = asked_for(settings, {"cryptoobject", "cryptomaterial"}),
            .culling = settings.culling,
            .runs = std::uint64_t(settings.pictures) * std::uint64_t(settings.samples),
            .kept = settings.kept,
            .clamp = settings.clamp,
            .primary = settings.primary,
            .group_size = static_cast<int>(settings.estimator.reuse),
            .group_size_piloted = asked.reuse == Reuse::automatic,
            .camera_rays_piloted = asked.camera == CameraRays::automatic,
            .camera_rays = static_cast<int>(settings.estimator.camera),
            .shadow_rays = static_cast<int>(settings.estimator.shadow),
            .preview = settings.preview};
}

}  // namespace halflight
