#include <algorithm>
#include <set>
#include <utility>

#include "api/halflight/loaded_scene.h"
#include "api/scene/animation_choice.h"

namespace halflight {

SceneFile::SceneFile(const std::filesystem::path& path, const GltfOptions& options, std::size_t picture_bytes,
                     bool moves, bool tile)
    : path_(path), file_(path, options) {
    SceneSize size = file_.size();
    size.moves = moves;
    tile_textures({&file_, 1}, size, picture_bytes, tile);
    check_fits(size, path, picture_bytes);
    check_tables(size, path);
}

void SceneFile::play(const std::string& animation, const Log& log) {
    rest_bounds_.reset();
    playing_ = choose_animations(file_, path_, animation, log);
}

void SceneFile::set_frame_rate(const std::optional<FrameRate>& wanted, const Log& log) {
    const std::optional<FrameRate>& own = file_.frame_rate();
    if (!wanted && own) log.note("{} frames per second, as the scene's extras say; --fps overrides them", text(*own));
    frame_rate_ = wanted.value_or(own.value_or(FrameRate()));
}

Scene SceneFile::at(double seconds, std::vector<TextureImage> images) {
    Scene scene;
    scene.images = std::move(images);
    file_.pose(scene, seconds, playing_);
    set_rest_bounds(scene, seconds);
    return scene;
}

Scene SceneFile::at(double seconds) {
    Scene scene = file_.at(seconds, playing_);
    set_rest_bounds(scene, seconds);
    return scene;
}

void SceneFile::set_rest_bounds(Scene& scene, double seconds) {
    if (!rest_bounds_) rest_bounds_ = world_bounds(seconds == 0 ? scene : file_.at(0, playing_));
    scene.rest_bounds = rest_bounds_;
}

void SceneFile::pose(Scene& scene, double seconds) {
    Environment environment = std::move(scene.environment);
    std::vector<LightProfile> profiles = std::move(scene.light_profiles);
    const std::optional<WorldBounds> paged = scene.paged_bounds;
    try {
        file_.pose(scene, seconds, playing_);
    } catch (...) {
        scene.environment = std::move(environment);
        scene.light_profiles = std::move(profiles);
        throw;
    }
    scene.environment = std::move(environment);
    scene.light_profiles = std::move(profiles);
    scene.paged_bounds = paged;
    set_rest_bounds(scene, seconds);
}

bool SceneFile::drives_light() {
    return std::ranges::any_of(playing_, [&](std::size_t index) {
        return std::ranges::any_of(file_.animations().at(index).channels, [](const AnimationChannel& channel) {
            return channel.property == AnimatedProperty::light || channel.property == AnimatedProperty::emission ||
                   channel.property == AnimatedProperty::visibility;
        });
    });
}

std::set<std::size_t> SceneFile::driven_emission() {
    std::set<std::size_t> materials;
    for (const std::size_t index : playing_)
        for (const AnimationChannel& channel : file_.animations().at(index).channels)
            if (channel.property == AnimatedProperty::emission)
                materials.insert(static_cast<std::size_t>(channel.target));
    return materials;
}

double SceneFile::end() {
    double end = 0;
    for (const std::size_t index : playing_) end = std::max(end, file_.animations().at(index).end);
    return end;
}

}  // namespace halflight
