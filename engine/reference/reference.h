// The oracle: a path tracer on the CPU, over Embree in robust mode, written from shaders/SHADING.md alone. Tests and
// error reports compare the GL engine with it, so it prefers correctness to speed. All shading is in double, and
// geometry is relative to the centre of the scene's bounds. New rays leave their surface by an error bound (surface.h).
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/core/pixel_filter.h"
#include "engine/scene/backfaces.h"
#include "engine/scene/scene.h"

namespace halflight {

/// A segment origin + t * direction, world space; t is in units of the direction's length, which is arbitrary.
struct ReferenceRay {
    dvec3 origin{0};
    dvec3 direction{0, 0, -1};
    double t_min = 0;
    double t_max = std::numeric_limits<double>::infinity();
    bool passes_backs = false;  // back faces of single-sided materials are no hits (SHADING.md, Surfaces)
    std::uint64_t classes = ~std::uint64_t{0};  // objects of other link classes are no hits
};

/// The nearest hit of a ray; the lower (instance, triangle) wins ties of t.
struct ReferenceHit {
    double t = 0;
    double u = 0;      // barycentric weight of the triangle's second vertex
    double v = 0;      // barycentric weight of the triangle's third vertex
    int instance = 0;  // index into Scene::instances
    int triangle = 0;  // index into the mesh's triangles
};

/// Test of alpha `blend`: a triangle is opaque if uniform(key, instance, triangle), in [0, 1), is below alpha.
struct AlphaTest {
    std::uint64_t key = 0;
    double (*uniform)(std::uint64_t key, std::uint32_t instance,
                      std::uint32_t triangle) = nullptr;  // null: the oracle's own hash
};

namespace reference {
struct Prepared;
}

/// A scene prepared for tracing. Every instance is flattened, so memory grows with the instanced triangles (about 150 B
/// each). It keeps a reference: `scene` must outlive it. Throws Error if Embree fails. Calls may be concurrent.
class ReferenceScene {
  public:
    explicit ReferenceScene(const Scene& scene);
    ~ReferenceScene();
    ReferenceScene(ReferenceScene&&) noexcept;
    ReferenceScene& operator=(ReferenceScene&&) noexcept;

    std::optional<ReferenceHit> closest_hit(const ReferenceRay& ray, const AlphaTest& alpha = {}) const;
    bool occluded(const ReferenceRay& ray, const AlphaTest& alpha = {}) const;

    /// Returns the world point relative to which all geometry is stored in float: the centre of the scene's bounds.
    const dvec3& origin() const;
    const reference::Prepared& prepared() const { return *prepared_; }  ///< Returns data for files of this folder.

  private:
    std::unique_ptr<reference::Prepared> prepared_;
};

/// Estimators of direct light. All have the same mean; the partial ones exist to test the full one.
enum class ReferenceStrategy : std::uint8_t { mis, lights_only, surfaces_only };

struct ReferenceSettings {
    int width = 0;         // pixels, > 0
    int height = 0;        // pixels, > 0
    int samples = 16;      // samples per pixel, > 0
    int first_sample = 0;  // samples [first_sample, first_sample + samples): disjoint ranges are independent
    int bounces = 8;       // reflections, >= 0 (SHADING.md, "Estimator")
    std::uint64_t seed = 0;
    Camera camera;
    PixelFilter filter{};
    Backfaces backfaces = Backfaces::automatic;
    bool show_lamps = false;  // camera rays see lights with a size
    int threads = 0;          // maximum number of threads; 0: all cores; the result does not depend on it
    /// `lights_only` ignores light hit by sampled rays if light sampling could have found it. `surfaces_only`
    /// samples no lights, and therefore has no punctual lights.
    ReferenceStrategy strategy = ReferenceStrategy::mis;
};

/// Mean radiance by component (SHADING.md "Estimator"), 3 channels each; their sum is the beauty.
struct ReferenceComponents {
    Image emission, direct_diffuse, direct_glossy, indirect_diffuse, indirect_glossy;
};

/// Surfaces hit by the rays through the pixels' centres; 0 and kNone for the background.
struct ReferenceAovs {
    Image position;  // 3 channels: world units, relative to the camera's position
    Image normal;    // 3 channels: shading normal, unit, world
    Image albedo;    // 3 channels: base colour
    Image depth;     // 1 channel: world units along the view axis, or along the ray of other projections
    std::vector<std::int32_t> instance, triangle;
};

struct ReferenceResult {
    Image beauty;    // 3 channels: mean radiance
    Image variance;  // 3 channels: unbiased variance of one sample (not of the mean); 0 below two samples
    Image alpha;     // 1 channel: share of camera rays that hit a surface
    ReferenceComponents components;
    ReferenceAovs aovs;
    int samples = 0;                       // samples per pixel
    std::uint64_t non_finite_samples = 0;  // samples excluded from the means; each is a bug
};

/// Renders a picture deterministically: equal scenes and settings give equal bits. Throws Error for settings out of
/// range.
ReferenceResult render_reference(const ReferenceScene& scene, const ReferenceSettings& settings);

}  // namespace halflight
