// Geometry in Embree: all instances flattened, relative to the centre of the scene's bounds.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

#include "engine/core/embree.h"
#include "engine/core/math.h"
#include "engine/reference/reference.h"
#include "engine/scene/scene.h"

namespace halflight::reference {

struct TriangleId {
    int instance = kNone;
    int triangle = kNone;
    bool operator==(const TriangleId&) const = default;
};

/// An instance in world space.
struct Placed {
    const Mesh* mesh = nullptr;
    const vec3* vertices = nullptr;  // positions relative to Tracer::origin(); null if the mesh has no triangle
    dmat3 linear{1};                 // linear part of object_to_world
    // det(linear) / |det(linear)| times its cofactors: like the inverse transpose, but also defined for flattened
    // instances; gives normals of any length
    dmat3 normals{1};
    double handedness = 1;      // -1 if the instance mirrors
    bool alpha_tested = false;  // true: some triangles are alpha tested
    bool one_sided = false;     // true: some triangles are seen from their front only
};

/// Tracer of rays relative to origin().
class Tracer {
  public:
    explicit Tracer(const Scene& scene);  ///< Keeps a reference to the scene.

    std::optional<ReferenceHit> closest_hit(const ReferenceRay& ray, const AlphaTest& alpha) const;
    bool occluded(const ReferenceRay& ray, const AlphaTest& alpha) const;

    const Scene& scene() const { return scene_; }
    const dvec3& origin() const { return origin_; }
    const Placed& placed(int instance) const { return placed_[static_cast<std::size_t>(instance)]; }
    const Material& material(const TriangleId& id) const;
    LightLinks links(const TriangleId& id) const;  ///< Returns the links of the light that a triangle emits.
    bool one_sided(const TriangleId& id) const;    ///< Returns whether the triangle is seen from its front only.
    /// Returns the geometric normal of the triangle's front, of any length.
    dvec3 front(const TriangleId& id) const;
    std::array<dvec3, 3> corners(const TriangleId& id) const;

  private:
    struct Release {
        void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
        void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    };

    void find_origin();
    void attach(int instance);

    const Scene& scene_;
    dvec3 origin_{0};
    double radius_ = 0;
    std::vector<Placed> placed_;
    std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release> device_;
    std::unique_ptr<std::remove_pointer_t<RTCScene>, Release> geometry_;
};

}  // namespace halflight::reference
