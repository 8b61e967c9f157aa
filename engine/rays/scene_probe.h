// Rays against a scene on the CPU, without OpenGL and without tables: for questions that are asked before a scene is
// prepared, such as what its own lights reach.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "engine/scene/material_lobes.h"
#include "engine/scene/scene.h"

namespace halflight::rays {

struct ProbeHit {
    dvec3 position;  // world units
    dvec3 normal;    // geometric normal, unit, on the side that the ray came from
    bool front;      // the ray met the front face of the triangle (glTF 2.0, section 3.7.2.1)
    const Material* material = nullptr;
    std::size_t instance = 0;  // index into Scene::instances
    vec3 color{0};             // base colour, linear, with texture and vertex colours
    vec3 emission{0};          // radiance at the hit times coverage, unlit colour included
};

/// Surfaces that a ray passes; values add up.
enum Passing : unsigned {
    kPassNone = 0,
    kPassHidden = 1,     // back faces that cameras do not show (is_one_sided())
    kPassClear = 2,      // surfaces that are mostly transparent there, by alpha or transmission
    kPassScattered = 4,  // surfaces that transmit most light diffusely
    kPassPanes = 8,      // the clear surfaces that light without size passes: all but hides_points()
};

/// Returns whether light without size is not found, or hardly ever, through the surface: clear glass that bends it.
/// Rough glass scatters it, so that light samples at the glass find it.
inline bool hides_points(const Material& m) {
    return transmits(m) && !is_pane(m) && m.roughness < 0.05f && !m.metallic_roughness_texture;
}

/// Sine of half the angle from which on a light is found by chance through such glass, as emissive surfaces are.
inline constexpr double kLargeSine = 0.1;
/// Returns the sine of half the angle in which a light is seen from a distance.
inline double sine_of(const PunctualLight& light, double distance) {
    return light.type == LightType::directional ? std::sin(0.5 * double(light.angle))
                                                : double(light.radius) / std::max(distance, 1e-30);
}

/// Traces rays through a scene.
class SceneProbe {
  public:
    /// Builds hierarchies over meshes and instances, by Embree's builder of medium quality, since its
    /// two-level builder of low quality aborts if all bounds are points. Leaves out instances of shared meshes
    /// whose transform has no finite inverse. Keeps a reference to the scene. Throws Error if Embree fails.
    explicit SceneProbe(const Scene& scene);
    ~SceneProbe();
    SceneProbe(const SceneProbe&) = delete;
    SceneProbe& operator=(const SceneProbe&) = delete;

    /// Returns the first surface along a ray, at a distance of at most `most`. `direction` is a unit vector.
    std::optional<ProbeHit> trace(const dvec3& origin, const dvec3& direction, double most = kFar,
                                  unsigned passing = kPassClear) const;
    /// Returns the first surface that a camera shows along a ray. Clear surfaces count if nothing is behind them.
    std::optional<ProbeHit> see(const dvec3& origin, const dvec3& direction) const;
    /// Returns whether a surface within a distance blocks most of the light from a light source.
    bool blocked(const dvec3& from, const dvec3& direction, double distance, bool has_size) const;
    /// Returns the distance to keep from surfaces, world units: float rounding on the scale of the scene.
    double spacing() const { return spacing_; }
    const WorldBounds& bounds() const { return bounds_; }
    const Scene& scene() const { return scene_; }

    static constexpr double kFar = std::numeric_limits<double>::infinity();

  private:
    struct Geometry;
    const Scene& scene_;
    WorldBounds bounds_;
    double spacing_ = 0;
    std::unique_ptr<Geometry> geometry_;
};

/// Builds the probe of a scene when it is first asked for.
class LazyProbe {
  public:
    explicit LazyProbe(const Scene& scene) : scene_(scene) {}
    const SceneProbe& get() const {
        if (!probe_) probe_.emplace(scene_);
        return *probe_;
    }
    bool made() const { return probe_.has_value(); }  ///< Returns whether there is a probe already.
    /// Drops the probe, since surfaces have changed.
    void reset() { probe_.reset(); }

  private:
    const Scene& scene_;
    mutable std::optional<SceneProbe> probe_;
};

/// Returns the radiance of a point of a triangle with barycentric coordinates `weights`, times coverage: its emission
/// with the nearest texel, or its colour if it is unlit.
vec3 emission_at(const Scene& scene, const Material& material, const Mesh& mesh, const uvec3& corners,
                 const vec3& weights);

}  // namespace halflight::rays
