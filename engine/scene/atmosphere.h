// The clear atmosphere: radiance of the sky, light of the sun, computed from the optical properties of air, aerosols
// and ozone at 16 wavelengths. Multiple scattering is that of Hillaire 2020 (A Scalable and Production Ready Sky and
// Atmosphere Rendering Technique, section 5.5): isotropic from the second order on.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/core/math.h"
#include "engine/scene/skies.h"

namespace halflight {

inline constexpr double kSunRadius = 0.2665;  // mean radius of the sun's disc, degrees

/// Sky and sun of one set of parameters. Radiances are linear Rec.709 in nits, illuminances in lux; channels may be
/// negative if a colour lies outside Rec.709. Refraction is left out.
class Atmosphere {
  public:
    static constexpr int kBands = 16;  // wavelengths: 400, 420, ..., 700 nm
    using Spectrum = std::array<float, kBands>;

    explicit Atmosphere(const ClearSky& sky);

    /// Light of one direction without the phase functions, which depend only on the angle to the sun.
    struct Light {
        dvec3 rayleigh{0}, aerosol{0}, rest{0};
    };
    /// Returns the light of directions at azimuths from the sun, in radians. Below the horizon, `rest` contains the
    /// light of the ground.
    std::vector<Light> lights(double elevation, std::span<const double> azimuths) const;
    Light light(double elevation, double azimuth) const { return lights(elevation, {&azimuth, 1}).front(); }
    /// Returns the radiance for the cosine of the angle between direction and sun.
    static dvec3 radiance(const Light& light, double cos_to_sun);

    /// Returns the illuminance that the sun gives a surface facing it. At sunset, only the part of the disc above the
    /// horizon counts.
    dvec3 sun_illuminance() const;
    /// Returns the radiance of the sun's disc at a distance from its centre, [0, 1] in radii. Its mean over the disc is
    /// that of sun_illuminance() with the whole disc above the horizon.
    dvec3 sun_radiance(double distance) const;
    /// Returns the illuminance of a horizontal surface by the sky.
    const dvec3& sky_illuminance() const { return sky_illuminance_; }

  private:
    /// Amount of matter along a path: length at sea-level density, metres, of air, aerosols and ozone.
    struct Column {
        float air = 0, aerosol = 0, ozone = 0;
    };
    static Column density(double radius);
    Column column_to_space(double radius, double cosine) const;
    Spectrum transmittance(const Column& column) const;
    Spectrum scattered(double radius, double sun_cosine) const;
    template <class F>
    void march(double radius, double cosine, double length, int steps, const F& visit) const;
    Spectrum sun_at(double radius, double sun_cosine) const;
    void make_columns();
    void make_multiple_scattering();
    dvec3 to_rgb(const Spectrum& spectrum) const;

    double ground_albedo_;
    double radius_ = 0;                     // distance of the eye from the centre of the earth, metres
    double sun_ = 0;                        // cosine between zenith and sun
    Spectrum air_{}, aerosol_{}, ozone_{};  // extinction at sea-level density, 1/m
    std::vector<Column> columns_;
    std::vector<Spectrum> multiple_;
    dvec3 sky_illuminance_{0};
    dvec3 ground_{0};  // radiance
};

}  // namespace halflight
