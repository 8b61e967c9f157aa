// All that can be found by next-event estimation, chosen by power (SHADING.md, "Lights").
#pragma once

#include <vector>

#include "engine/reference/alias.h"
#include "engine/reference/environment.h"
#include "engine/reference/random.h"
#include "engine/reference/surface.h"
#include "engine/reference/tracer.h"

namespace halflight::reference {

struct LightSample {
    dvec3 wi{0};            // unit
    dvec3 radiance{0};      // punctual lights: irradiance over cosine
    double pdf = 0;         // solid angle times choice; of the choice alone for punctual lights
    bool punctual = false;  // cannot be met by a sampled ray
    bool infinite = false;  // the shadow ray has no end
    dvec3 end{0};           // its end otherwise, relative to Tracer::origin()
};

class Lights {
  public:
    explicit Lights(const Tracer& tracer);  ///< Keeps a reference.

    bool empty() const { return table_.empty(); }
    /// One light and a point on it, seen from a surface; none where it surely gives nothing.
    std::optional<LightSample> sample(const Surface& surface, Random& random) const;

    /// The density with which sample() would have found, from `from`, the point of a triangle or a direction to the
    /// sky.
    double pdf(const dvec3& from, const Surface& on_light) const;
    double pdf_environment(const dvec3& direction) const;

    const EnvironmentLight& environment() const { return environment_; }

  private:
    struct Emitter {
        TriangleId id;
        double area = 0;
    };

    void add_emitters(std::vector<double>& powers);
    std::optional<LightSample> sample_triangle(const Emitter& emitter, const Surface& surface, Random& random) const;
    std::optional<LightSample> sample_punctual(const PunctualLight& light, const Surface& surface) const;

    const Tracer& tracer_;
    EnvironmentLight environment_;
    std::vector<Emitter> emitters_;
    std::vector<std::vector<int>> emitter_of_;  // per instance, per triangle; empty where an instance does not emit
    AliasTable table_;                          // emitters, then Scene::lights, then the environment
};

}  // namespace halflight::reference
