// Radiance from infinity, and its importance sampling by a table of the map's texels.
#pragma once

#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/reference/alias.h"
#include "engine/scene/scene.h"

namespace halflight::reference {

class EnvironmentLight {
  public:
    /// Keeps a reference to the environment.
    explicit EnvironmentLight(const Environment& environment);

    bool black() const { return !(power_ > 0); }
    double power() const { return power_; }  ///< Returns the radiance's mean channel, integrated over the sphere.

    dvec3 radiance(const dvec3& direction) const;
    dvec3 sample(double u1, double u2) const;  ///< Samples a unit direction; must not be called when black.
    double pdf(const dvec3& direction) const;  ///< Returns the density of sample(), per solid angle.

  private:
    bool constant() const { return environment_.map.width == 0; }
    double solid_angle(int row) const;  // Returns the solid angle, sr, of a texel in the row.

    const Environment& environment_;
    double power_ = 0;
    AliasTable rows_;
    std::vector<AliasTable> columns_;
};

}  // namespace halflight::reference
