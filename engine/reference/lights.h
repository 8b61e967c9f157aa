// Next-event estimation: all lights, selected by power (SHADING.md, "Lights").
#pragma once

#include <vector>

#include "engine/reference/alias.h"
#include "engine/reference/environment.h"
#include "engine/reference/random.h"
#include "engine/reference/surface.h"
#include "engine/reference/tracer.h"

namespace halflight::reference {

struct LightSample {
    dvec3 wi{0};            // unit direction towards the light
    dvec3 radiance{0};      // emitted radiance; punctual lights: irradiance at normal incidence
    double pdf = 0;         // solid angle density times selection probability; punctual lights: the probability alone
    bool punctual = false;  // true: no sampled ray can hit the light
    bool infinite = false;  // true: the shadow ray has no end
    bool back = false;      // true: it is the back of a surface that is seen from its front only
    dvec3 end{0};           // end of the shadow ray unless infinite, relative to Tracer::origin()
    LightLinks links{};
};

/// A light with a size that a ray meets.
struct MetLight {
    dvec3 radiance{0};
    double pdf = 0;       // solid angle density of sample() there, with the selection probability
    double distance = 0;  // infinite for directional lights
    LightLinks links{};
};

class Lights {
  public:
    explicit Lights(const Tracer& tracer);  ///< Keeps a reference to the tracer.

    bool empty() const { return table_.empty(); }
    /// Samples a light, and a point on it, for a surface; returns none if the light certainly contributes nothing.
    std::optional<LightSample> sample(const Surface& surface, Random& random) const;

    /// Returns the density with which sample() selects, from `from`, this point of a triangle or direction to the sky.
    double pdf(const dvec3& from, const Surface& on_light) const;
    /// Returns the lights with a size that a ray from a surface meets at distances in [begin, end). They hide nothing.
    std::vector<MetLight> met(const dvec3& from, const dvec3& wi, double begin, double end) const;
    double pdf_environment(const dvec3& direction) const;

    const EnvironmentLight& environment() const { return environment_; }

  private:
    struct Emitter {
        TriangleId id;
        double area = 0;
    };

    void add_emitters(std::vector<double>& powers);
    std::optional<LightSample> sample_triangle(const Emitter& emitter, const Surface& surface, Random& random) const;

    const Tracer& tracer_;
    EnvironmentLight environment_;
    std::vector<Emitter> emitters_;
    std::vector<std::vector<int>> emitter_of_;  // emitter of each triangle, by instance; empty if none emits
    AliasTable table_;                          // emitters, then Scene::lights, then the environment
};

}  // namespace halflight::reference
