#include "engine/scene/atmosphere.h"

#include <algorithm>
#include <cmath>

#include "engine/core/chromaticities.h"

namespace halflight {
namespace {

using Spectrum = Atmosphere::Spectrum;
constexpr int kBands = Atmosphere::kBands;

constexpr double kGround = 6360e3, kTop = 6460e3;  // radii, metres (Bruneton, Neyret 2008)
// Scale heights, metres: air and aerosols of Bruneton, Neyret 2008.
constexpr double kAirHeight = 8000, kAerosolHeight = 1200;
// Ozone is a tent around 25 km, 15 km wide at half height, of 300 Dobson units (Bruneton 2017, A Qualitative and
// Quantitative Evaluation of 8 Clear Sky Models).
constexpr double kOzoneCentre = 25e3, kOzoneWidth = 15e3, kOzoneDensity = 300 * 2.687e20 / kOzoneWidth;
constexpr double kAerosolAlbedo = 0.9, kAerosolG = 0.8;  // scattering over extinction; mean cosine (Bruneton 2017)

double wavelength(int band) {  // micrometres
    return 0.4 + 0.02 * band;
}

// Irradiance outside the atmosphere, W / (m^2 nm): ASTM G-173, means of 20 nm.
constexpr Spectrum kSun = {1.43744f, 1.70962f, 1.76226f, 2.02758f, 1.97795f, 1.93748f, 1.84915f, 1.87230f,
                           1.84225f, 1.82460f, 1.76744f, 1.68922f, 1.62567f, 1.53883f, 1.49265f, 1.42919f};
// Absorption cross section of ozone at 233 K, 1e-26 m^2 (Gorshelev et al. 2014, Serdyuchenko et al. 2014), means of
// 20 nm.
constexpr Spectrum kOzone = {0.1095f, 0.4142f, 1.2136f, 2.9925f, 6.338f,  11.908f, 18.705f, 29.23f,
                             38.83f,  45.35f,  48.60f,  40.225f, 29.385f, 20.45f,  13.41f,  8.439f};

/// Returns the CIE 1931 colour matching functions (Wyman, Sloan, Shirley 2013, Simple Analytic Approximations to the
/// CIE XYZ Color Matching Functions).
dvec3 colour_matching(double micrometres) {
    const double nm = 1000 * micrometres;
    const auto lobe = [&](double height, double centre, double left, double right) {
        const double t = (nm - centre) * (nm < centre ? left : right);
        return height * std::exp(-0.5 * t * t);
    };
    return {
        lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) - lobe(0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725)};
}

/// Returns the linear Rec.709 colour of unit spectral radiance in a band, lm/W times the width of the band.
const std::array<dvec3, kBands>& band_colours() {
    static const std::array<dvec3, kBands> colours = [] {
        const dmat3 to_rgb = glm::inverse(rgb_to_xyz(kRec709));
        std::array<dvec3, kBands> made;
        for (int b = 0; b < kBands; ++b) made[std::size_t(b)] = to_rgb * colour_matching(wavelength(b)) * (683.0 * 20);
        return made;
    }();
    return colours;
}

double rayleigh_phase(double cosine) {
    return 3 / (16 * kPi) * (1 + cosine * cosine);
}

/// Henyey, Greenstein 1941.
double aerosol_phase(double cosine) {
    constexpr double g = kAerosolG;
    return (1 - g * g) / (4 * kPi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

/// Returns the distance to a sphere around the centre of the earth, from inside it.
double exit_distance(double radius, double cosine, double sphere) {
    return -radius * cosine + std::sqrt(std::max(sphere * sphere - radius * radius * (1 - cosine * cosine), 0.0));
}

double horizon_cosine(double radius) {
    return -std::sqrt(std::max(1 - kGround * kGround / (radius * radius), 0.0));
}

/// Returns the length of a ray to the ground or to space.
double length_of(double radius, double cosine) {
    if (cosine >= horizon_cosine(radius)) return exit_distance(radius, cosine, kTop);
    return -radius * cosine - std::sqrt(std::max(kGround * kGround - radius * radius * (1 - cosine * cosine), 0.0));
}

// Nodes of the tables of columns and of multiple scattering.
constexpr int kRadii = 48, kCosines = 128;
constexpr int kHeights = 16, kSuns = 22;
// Largest change of the sun's elevation along a ray. The longest one, from the highest camera past the ground, spans
// acos(kGround / kTop) and the dip of that camera's horizon.
constexpr double kSunRange = 0.24;  // radians

double radius_of_node(double node) {  // dense at the ground
    return kGround + (kTop - kGround) * node * node;
}

template <class T, class F>
T bilinear(const std::vector<T>& table, int width, int height, double x, double y, const F& mix) {
    const double u = std::clamp(x, 0.0, 1.0) * (width - 1), v = std::clamp(y, 0.0, 1.0) * (height - 1);
    const int i = std::min(int(u), width - 2), j = std::min(int(v), height - 2);
    const auto at = [&](int a, int b) -> const T& {
        return table[std::size_t(b) * std::size_t(width) + std::size_t(a)];
    };
    const float s = float(u - i), t = float(v - j);
    return mix(mix(at(i, j), at(i + 1, j), s), mix(at(i, j + 1), at(i + 1, j + 1), s), t);
}

}  // namespace

Atmosphere::Column Atmosphere::density(double radius) {
    const double height = radius - kGround;
    return {float(std::exp(-height / kAirHeight)), float(std::exp(-height / kAerosolHeight)),
            float(std::max(1 - std::abs(height - kOzoneCentre) / kOzoneWidth, 0.0))};
}

Atmosphere::Spectrum Atmosphere::transmittance(const Column& c) const {
    Spectrum result;
    for (std::size_t b = 0; b < kBands; ++b)
        result[b] = std::exp(-(air_[b] * c.air + aerosol_[b] * c.aerosol + ozone_[b] * c.ozone));
    return result;
}

/// Calls visit(radius, distance, length, density) for the steps of a ray, which are short near the eye.
template <class F>
void Atmosphere::march(double radius, double cosine, double length, int steps, const F& visit) const {
    double from = 0;
    for (int i = 1; i <= steps; ++i) {
        const double to = length * (double(i) / steps) * (double(i) / steps), t = 0.5 * (from + to);
        const double r = std::max(std::sqrt(radius * radius + t * t + 2 * radius * cosine * t), kGround);
        visit(r, t, to - from, density(r));
        from = to;
    }
}

void Atmosphere::make_columns() {
    columns_.resize(kRadii * kCosines);
    for (int j = 0; j < kRadii; ++j) {
        const double radius = radius_of_node(double(j) / (kRadii - 1));
        // Nodes are evenly spaced in the length of the ray (idea: Bruneton, Neyret 2008).
        const double shortest = kTop - radius, longest = exit_distance(radius, horizon_cosine(radius), kTop);
        for (int i = 0; i < kCosines; ++i) {
            const double d = shortest + (longest - shortest) * i / (kCosines - 1);
            const double cosine =
                d > 0 ? std::clamp((kTop * kTop - radius * radius - d * d) / (2 * radius * d), -1.0, 1.0) : 1;
            Column& c = columns_[std::size_t(j * kCosines + i)];
            march(radius, cosine, d, 80, [&](double, double, double length, const Column& density) {
                c.air += density.air * float(length), c.aerosol += density.aerosol * float(length);
                c.ozone += density.ozone * float(length);
            });
        }
    }
}

/// Returns the column of a ray that leaves the atmosphere.
Atmosphere::Column Atmosphere::column_to_space(double radius, double cosine) const {
    const double shortest = kTop - radius, longest = exit_distance(radius, horizon_cosine(radius), kTop);
    const double d = exit_distance(radius, std::max(cosine, horizon_cosine(radius)), kTop);
    return bilinear(columns_, kCosines, kRadii, longest > shortest ? (d - shortest) / (longest - shortest) : 0,
                    std::sqrt(std::max(radius - kGround, 0.0) / (kTop - kGround)),
                    [](const Column& a, const Column& b, float t) {
                        return Column{a.air + t * (b.air - a.air), a.aerosol + t * (b.aerosol - a.aerosol),
                                      a.ozone + t * (b.ozone - a.ozone)};
                    });
}

/// Returns the spectral irradiance of a surface facing the sun. The disc sets while its centre passes the horizon.
Spectrum Atmosphere::sun_at(double radius, double sun_cosine) const {
    const double above = std::asin(std::clamp(sun_cosine, -1.0, 1.0)) - std::asin(horizon_cosine(radius));
    const double s = std::clamp(above / (kSunRadius * kPi / 180), -1.0, 1.0);  // height of the disc's centre, radii
    const double visible = 0.5 + (s * std::sqrt(1 - s * s) + std::asin(s)) / kPi;
    Spectrum light{};
    if (visible <= 0) return light;
    light = transmittance(column_to_space(radius, sun_cosine));
    for (std::size_t b = 0; b < kBands; ++b) light[b] *= kSun[b] * float(visible);
    return light;
}

/// Fills the table of isotropic radiance by two and more scatterings (Hillaire 2020, section 5.5).
void Atmosphere::make_multiple_scattering() {
    multiple_.resize(kHeights * kSuns);
    constexpr int kZeniths = 12, kAzimuths = 4, kSteps = 16;
    const float albedo = float(ground_albedo_);
    for (int j = 0; j < kHeights; ++j)
        for (int i = 0; i < kSuns; ++i) {
            const double radius = std::max(radius_of_node(double(j) / (kHeights - 1)), kGround + 1);
            const double sun_elevation = std::asin(sun_) + kSunRange * (2.0 * i / (kSuns - 1) - 1);
            const double s = std::sin(sun_elevation), across = std::cos(sun_elevation);
            Spectrum second{}, transfer{};
            for (int z = 0; z < kZeniths; ++z) {
                const double cosine = 2 * (z + 0.5) / kZeniths - 1, sine = std::sqrt(1 - cosine * cosine);
                const double length = length_of(radius, cosine);
                const bool ground = cosine < horizon_cosine(radius);
                constexpr float kShare = 1.0f / kZeniths;
                const auto mean_sun = [&](double r, double t) {
                    Spectrum mean{};
                    for (int a = 0; a < kAzimuths; ++a) {
                        const double to_sun = cosine * s + sine * across * std::cos(kPi * (a + 0.5) / kAzimuths);
                        const Spectrum sun = sun_at(r, (radius * s + t * to_sun) / r);
                        for (std::size_t b = 0; b < kBands; ++b) mean[b] += sun[b] / kAzimuths;
                    }
                    return mean;
                };
                Spectrum seen;
                seen.fill(kShare);
                march(radius, cosine, length, kSteps, [&](double r, double t, double step, const Column& d) {
                    const Spectrum sun = mean_sun(r, t);
                    const float width = float(step);
                    for (std::size_t b = 0; b < kBands; ++b) {
                        const float air = air_[b] * d.air, aerosol = aerosol_[b] * d.aerosol;
                        const float extinction = air + aerosol + ozone_[b] * d.ozone;
                        const float left = std::exp(-extinction * width);
                        const float scattering = air + float(kAerosolAlbedo) * aerosol;
                        const float share = seen[b] * scattering * (extinction > 0 ? (1 - left) / extinction : width);
                        second[b] += share * sun[b] * float(1 / (4 * kPi));
                        transfer[b] += share;
                        seen[b] *= left;
                    }
                });
                if (!ground) continue;
                // The ground is near, so that the sun is about as high there.
                const Spectrum sun = mean_sun(kGround, length);
                for (std::size_t b = 0; b < kBands; ++b) {
                    second[b] += seen[b] * albedo * float(std::max(s, 0.0) / kPi) * sun[b];
                    transfer[b] += seen[b] * albedo;
                }
            }
            Spectrum& result = multiple_[std::size_t(j * kSuns + i)];
            for (std::size_t b = 0; b < kBands; ++b) result[b] = second[b] / (1 - transfer[b]);
        }
}

Spectrum Atmosphere::scattered(double radius, double sun_cosine) const {
    const double offset = std::asin(std::clamp(sun_cosine, -1.0, 1.0)) - std::asin(sun_);
    return bilinear(multiple_, kSuns, kHeights, 0.5 + 0.5 * offset / kSunRange,
                    std::sqrt(std::max(radius - kGround, 0.0) / (kTop - kGround)),
                    [](const Spectrum& a, const Spectrum& b, float t) {
                        Spectrum mixed;
                        for (std::size_t i = 0; i < kBands; ++i) mixed[i] = a[i] + t * (b[i] - a[i]);
                        return mixed;
                    });
}

dvec3 Atmosphere::to_rgb(const Spectrum& spectrum) const {
    dvec3 rgb(0);
    for (std::size_t b = 0; b < kBands; ++b) rgb += double(spectrum[b]) * band_colours()[b];
    return rgb;
}

Atmosphere::Atmosphere(const ClearSky& sky)
    : ground_albedo_(sky.ground_albedo),
      radius_(kGround + std::max(sky.altitude, 0.0) + 2),  // eyes are 2 m above the ground
      sun_(std::sin(sky.elevation * kPi / 180)) {
    for (int b = 0; b < kBands; ++b) {
        const double l = wavelength(b), l2 = l * l;
        const std::size_t i = std::size_t(b);
        // Optical depth of the air at 1013 hPa (Hansen, Travis 1974, Light Scattering in Planetary Atmospheres).
        const double air = 0.008569 / (l2 * l2) * (1 + 0.0113 / l2 + 0.00013 / (l2 * l2));
        // Optical depth of aerosols after Angstrom, whose coefficient follows from the turbidity as in Preetham,
        // Shirley, Smits 1999, appendix A.1.
        const double aerosol = std::max(0.04608 * sky.turbidity - 0.04586, 0.0) * std::pow(l, -1.3);
        air_[i] = float(air / kAirHeight), aerosol_[i] = float(aerosol / kAerosolHeight);
        ozone_[i] = float(1e-26 * double(kOzone[i]) * kOzoneDensity);
    }
    make_columns();
    make_multiple_scattering();
    constexpr int kRows = 24, kColumns = 16;
    for (int i = 0; i < kRows; ++i) {
        const double from = std::sin(0.5 * kPi * i / kRows), to = std::sin(0.5 * kPi * (i + 1) / kRows);
        const double elevation = 0.5 * kPi * (i + 0.5) / kRows;
        for (int j = 0; j < kColumns; ++j) {
            const double azimuth = kPi * (j + 0.5) / kColumns;
            const double to_sun =
                std::sin(elevation) * sun_ + std::cos(elevation) * std::sqrt(1 - sun_ * sun_) * std::cos(azimuth);
            sky_illuminance_ += kPi / kColumns * (to * to - from * from) * radiance(light(elevation, azimuth), to_sun);
        }
    }
    // The illuminance is that at the eye: below it, the sky gains most of what the sun loses.
    ground_ = ground_albedo_ / kPi * (sky_illuminance_ + std::max(sun_, 0.0) * sun_illuminance());
}

std::vector<Atmosphere::Light> Atmosphere::lights(double elevation, std::span<const double> azimuths) const {
    struct Sums {
        double to_sun;  // cosine between ray and sun
        Spectrum rayleigh{}, aerosols{}, rest{};
    };
    std::vector<Sums> sums;
    const double cosine = std::sin(elevation), across = std::cos(elevation) * std::sqrt(1 - sun_ * sun_);
    for (const double azimuth : azimuths) sums.push_back({cosine * sun_ + across * std::cos(azimuth)});
    const bool ground = cosine < horizon_cosine(radius_);
    Spectrum seen;
    seen.fill(1);
    march(radius_, cosine, length_of(radius_, cosine), ground ? 16 : 40,
          [&](double r, double t, double step, const Column& d) {
              Spectrum by_air, by_aerosols;
              for (std::size_t b = 0; b < kBands; ++b) {
                  const float air = air_[b] * d.air, aerosol = aerosol_[b] * d.aerosol, width = float(step);
                  const float extinction = air + aerosol + ozone_[b] * d.ozone, left = std::exp(-extinction * width);
                  const float share = seen[b] * (extinction > 0 ? (1 - left) / extinction : width);
                  by_air[b] = share * air, by_aerosols[b] = share * float(kAerosolAlbedo) * aerosol;
                  seen[b] *= left;
              }
              for (Sums& s : sums) {
                  const double sun_cosine = (radius_ * sun_ + t * s.to_sun) / r;
                  const Spectrum sun = sun_at(r, sun_cosine), multiple = scattered(r, sun_cosine);
                  for (std::size_t b = 0; b < kBands; ++b) {
                      s.rayleigh[b] += by_air[b] * sun[b], s.aerosols[b] += by_aerosols[b] * sun[b];
                      s.rest[b] += (by_air[b] + by_aerosols[b]) * multiple[b];
                  }
              }
          });
    Spectrum white = seen;
    for (std::size_t b = 0; b < kBands; ++b) white[b] *= kSun[b];
    const dvec3 by_ground = ground ? ground_ * (to_rgb(white) / to_rgb(kSun)) : dvec3(0);
    std::vector<Light> result;
    for (const Sums& s : sums) result.push_back({to_rgb(s.rayleigh), to_rgb(s.aerosols), to_rgb(s.rest) + by_ground});
    return result;
}

dvec3 Atmosphere::radiance(const Light& light, double cos_to_sun) {
    return rayleigh_phase(cos_to_sun) * light.rayleigh + aerosol_phase(cos_to_sun) * light.aerosol + light.rest;
}

dvec3 Atmosphere::sun_illuminance() const {
    return to_rgb(sun_at(radius_, sun_));
}

/// Limb darkening: I(mu) = I(1) mu^a, a = -0.023 + 0.292 / micrometres (Hestroffer, Magnan 1998, Wavelength dependency
/// of the Solar limb darkening). Its mean over the disc is 2 / (a + 2).
dvec3 Atmosphere::sun_radiance(double distance) const {
    const double mu = std::sqrt(std::max(1 - distance * distance, 0.0));
    const double solid_angle = 2 * kPi * (1 - std::cos(kSunRadius * kPi / 180));
    Spectrum light = transmittance(column_to_space(radius_, sun_));
    for (int b = 0; b < kBands; ++b) {
        const double a = -0.023 + 0.292 / wavelength(b);
        light[std::size_t(b)] *= kSun[std::size_t(b)] * float(std::pow(mu, a) * (a + 2) / 2 / solid_angle);
    }
    return to_rgb(light);
}

}  // namespace halflight
