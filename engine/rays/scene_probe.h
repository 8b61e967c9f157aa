// Rays against a scene on the CPU, without OpenGL and without tables: for questions that are asked before a scene is
// prepared, such as what its own lights reach.
#pragma once

#include <memory>
#include <optional>

#include "engine/scene/scene.h"

namespace halflight::rays {

struct ProbeHit {
    dvec3 position;  // world units
    dvec3 normal;    // geometric normal, unit, on the side that the ray came from
    bool front;      // the ray met the front face of the triangle (glTF 2.0, section 3.7.2.1)
    const Material* material = nullptr;
    std::size_t instance = 0;  // index into Scene::instances
    vec3 emission{0};          // radiance at the hit, unlit colour included
};

/// Surfaces that a ray passes.
enum class Passing {
    none,
    clear,      // surfaces that are mostly transparent there, by alpha or transmission
    scattered,  // `clear`, and surfaces that transmit most light diffusely
};

/// Traces rays through a scene.
class SceneProbe {
  public:
    /// Builds hierarchies over meshes and instances, by Embree's fast builder. Leaves out instances of shared meshes
    /// whose transform has no finite inverse. Keeps a reference to the scene. Throws Error where Embree fails.
    explicit SceneProbe(const Scene& scene);
    ~SceneProbe();
    SceneProbe(const SceneProbe&) = delete;
    SceneProbe& operator=(const SceneProbe&) = delete;

    /// Returns the first surface along a ray, at a distance of at most `most`. `direction` is a unit vector.
    std::optional<ProbeHit> trace(const dvec3& origin, const dvec3& direction, double most = kFar,
                                  Passing passing = Passing::clear) const;
    /// Returns whether there is a surface within a distance that lets little light pass.
    bool blocked(const dvec3& from, const dvec3& direction, double distance) const;
    /// Returns the distance to keep from surfaces, world units: float rounding on the scale of the scene.
    double spacing() const { return spacing_; }
    const WorldBounds& bounds() const { return bounds_; }

    static constexpr double kFar = std::numeric_limits<double>::infinity();

  private:
    struct Geometry;
    const Scene& scene_;
    WorldBounds bounds_;
    double spacing_ = 0;
    std::unique_ptr<Geometry> geometry_;
};

/// Returns the value of an sRGB-encoded texture from its nearest texel: linear rgb, alpha; 1 without an image.
/// `weights` are the barycentric coordinates of a point in the triangle of `corners`.
vec4 texel(const Scene& scene, const TextureRef& texture, const Mesh& mesh, const uvec3& corners, const vec3& weights);

}  // namespace halflight::rays
