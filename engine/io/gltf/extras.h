// Data of applications in the extras of glTF files.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "engine/core/frames.h"
#include "engine/core/lens.h"

namespace halflight {

class GltfWarnings;

/// Returns the frame rate for which a file was made. It is "fps" or "frame_rate" in the extras of the default scene,
/// else of the asset. Blender stores custom properties of a scene there. Values other than numbers from 0.001 to
/// 1000000 are ignored with a warning. `root` is an object, otherwise unchecked.
std::optional<FrameRate> frame_rate_in_extras(const nlohmann::json& root, GltfWarnings& warnings);

/// Returns the lens of each camera, from numbers in its extras with the names of Blender's camera properties:
/// "aperture_fstop", "focus_distance" (metres), "aperture_blades", "aperture_rotation" (radians) and "sensor_width"
/// (mm). A lens blurs if it has the first two. Other values are ignored with a warning. `root` is an object,
/// otherwise unchecked.
std::vector<Lens> lenses_in_extras(const nlohmann::json& root, GltfWarnings& warnings);

/// Size of a light: PunctualLight::radius and angle.
struct LightSize {
    float radius = 0;
    float angle = 0;
};
/// Returns the size of each light, from numbers in its extras: "radius", "shadow_soft_size" (metres) and "angle"
/// (radians). Blender has the latter two names. NVIDIA's vk_gltf_renderer stores "radius": metres, or, for directional
/// lights, the radius in km of a disc at the distance of the sun. Other values are ignored with a warning. `root` is an
/// object, otherwise unchecked.
std::vector<LightSize> light_sizes_in_extras(const nlohmann::json& root, GltfWarnings& warnings);

}  // namespace halflight
