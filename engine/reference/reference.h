// The oracle: a path tracer on the CPU, over Embree in robust mode, written from shaders/SHADING.md alone. Tests and
// error reports hold the GL engine against it, so it prefers being right to being fast: all shading is in double,
// geometry is relative to the centre of the scene's bounds, new rays leave their surface by an error bound (surface.h).
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/scene/scene.h"
#include "engine/core/pixel_filter.h"

namespace halflight {

/// A segment origin + t * direction, world space; t is in units of the direction's length, which need not be 1.
struct ReferenceRay {
    dvec3 origin{0};
    dvec3 direction{0, 0, -1};
    double t_min = 0;
    double t_max = std::numeric_limits<double>::infinity();
};

/// Equal t: the lower (instance, triangle) wins.
struct ReferenceHit {
    double t = 0;
    double u = 0;      // barycentric weight of the triangle's second vertex
    double v = 0;      // and of its third
    int instance = 0;  // index into Scene::instances
    int triangle = 0;  // index into the mesh's triangles
};

/// Decides alpha `blend`: a triangle is there where uniform(key, instance, triangle), in [0, 1), is below alpha.
struct AlphaTest {
    std::uint64_t key = 0;
    double (*uniform)(std::uint64_t key, std::uint32_t instance,
                      std::uint32_t triangle) = nullptr;  // null: our own hash
};

namespace reference {
struct Prepared;
}

/// A scene made ready for tracing. Every instance is flattened, so memory grows with the instanced triangles (about
/// 150 B each). Keeps a reference: `scene` must outlive it. Throws Error where Embree fails. Calls may be concurrent.
class ReferenceScene {
  public:
    explicit ReferenceScene(const Scene& scene);
    ~ReferenceScene();
    ReferenceScene(ReferenceScene&&) noexcept;
    ReferenceScene& operator=(ReferenceScene&&) noexcept;

    std::optional<ReferenceHit> closest_hit(const ReferenceRay& ray, const AlphaTest& alpha = {}) const;
    bool occluded(const ReferenceRay& ray, const AlphaTest& alpha = {}) const;

    /// World point that all geometry is kept relative to, in float: the centre of the scene's bounds.
    const dvec3& origin() const;
    const reference::Prepared& prepared() const { return *prepared_; }  ///< For the room's own files.

  private:
    std::unique_ptr<reference::Prepared> prepared_;
};

/// How direct light is estimated. All have the same mean; the partial ones exist to test the full one.
enum class ReferenceStrategy : std::uint8_t { mis, lights_only, surfaces_only };

struct ReferenceSettings {
    int width = 0;         // pixels, > 0
    int height = 0;        // pixels, > 0
    int samples = 16;      // per pixel, > 0
    int first_sample = 0;  // samples [first_sample, first_sample + samples): disjoint ranges are independent
    int bounces = 8;       // >= 0, SHADING.md "Estimator"
    std::uint64_t seed = 0;
    Camera camera;
    PixelFilter filter{};
    int threads = 0;  // at most; 0: all there are; the result does not depend on it
    /// lights_only: no light by sampled rays where a light table could have found it. surfaces_only: the reverse,
    /// which leaves out punctual lights.
    ReferenceStrategy strategy = ReferenceStrategy::mis;
};

/// Mean radiance by the way it took (SHADING.md "Estimator"): 3 channels each; their sum is the beauty.
struct ReferenceComponents {
    Image emission, direct_diffuse, direct_glossy, indirect_diffuse, indirect_glossy;
};

/// What the ray through each pixel's centre meets first; 0 and kNone where that is nothing.
struct ReferenceAovs {
    Image position;  // 3: world units, relative to the camera's position
    Image normal;    // 3: shading normal, unit, world
    Image albedo;    // 3: base colour
    Image depth;     // 1: world units along the view axis
    std::vector<std::int32_t> instance, triangle;
};

struct ReferenceResult {
    Image beauty;    // 3: mean radiance
    Image variance;  // 3: unbiased variance of one sample (not of the mean); 0 below two samples
    Image alpha;     // 1: share of camera rays that met a surface
    ReferenceComponents components;
    ReferenceAovs aovs;
    int samples = 0;                       // per pixel
    std::uint64_t non_finite_samples = 0;  // left out of the means; always a bug
};

/// Deterministic: the same scene and settings give the same bits. Throws Error for settings out of range.
ReferenceResult render_reference(const ReferenceScene& scene, const ReferenceSettings& settings);

}  // namespace halflight
