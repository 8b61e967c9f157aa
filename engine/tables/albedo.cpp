#include "engine/tables/albedo.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/math.h"
#include "shaders/shared/albedo_coordinates.h"

namespace halflight {
namespace {

/// Gauss-Legendre rule on [0, 1]: Newton's iteration from Chebyshev's guess (Press et al., Numerical Recipes, 4.6).
struct Quadrature {
    std::vector<double> x, weight;

    explicit Quadrature(int n) : x(static_cast<std::size_t>(n)), weight(x.size()) {
        for (int i = 0; i < n; ++i) {
            double z = std::cos(kPi * (i + 0.75) / (n + 0.5));
            double slope = 0;
            for (double step = 1; std::abs(step) > 1e-15;) {
                double p = 1, before = 0;
                for (int k = 1; k <= n; ++k) before = std::exchange(p, ((2 * k - 1) * z * p - (k - 1) * before) / k);
                slope = n * (z * p - before) / (z * z - 1);
                step = p / slope;
                z -= step;
            }
            x[static_cast<std::size_t>(i)] = 0.5 * (1 - z);
            weight[static_cast<std::size_t>(i)] = 1 / ((1 - z * z) * slope * slope);
        }
    }
};

double fifth_power(double v) {
    return v * v * v * v * v;
}

/// The lobe as an integral over half vectors h: E = int D cos_h G2 (wo.h) / (mu_o cos_h) dh = int dw/pi sin(2 psi) dphi
///     ... with tan(theta_h) = alpha tan(psi), for which D cos_h is the density of sin^2(psi).
/// The azimuths whose reflection stays above the surface are an interval [-phi_max, phi_max] for each theta_h, so the
/// integrand has no edge inside. The interval is complete up to theta_h = (pi/2 - theta_o) / 2, and empty from (pi/2 +
/// theta_o) / 2 on.
class LobeIntegral {
  public:
    LobeIntegral(double cosine, double alpha, const Quadrature& rule)
        : mu_(std::clamp(cosine, 1e-9, 1.0)),  // 1e-9 stands for the limit at 0
          sine_(std::sqrt((1 - mu_) * (1 + mu_))),
          alpha_(alpha),
          root_o_(root(mu_)),
          rule_(rule) {}

    DirectionalAlbedo operator()() const {
        const double theta_o = std::acos(mu_);
        const double whole = std::atan(std::tan(0.5 * (0.5 * kPi - theta_o)) / alpha_);
        const double last = std::atan(std::tan(0.5 * (0.5 * kPi + theta_o)) / alpha_);
        DirectionalAlbedo sum;
        add_panel(0, whole, sum);
        add_panel(whole, last, sum);
        return sum;
    }

  private:
    double root(double cosine) const { return std::sqrt(alpha_ * alpha_ + (1 - alpha_ * alpha_) * cosine * cosine); }

    void add_panel(double from, double to, DirectionalAlbedo& sum) const {
        for (std::size_t i = 0; i < rule_.x.size(); ++i) {
            // Smoothstep: phi_max has a square root's slope where the panels meet.
            const double q = rule_.x[i];
            const double psi = from + (to - from) * q * q * (3 - 2 * q);
            const double scale = rule_.weight[i] * (to - from) * 6 * q * (1 - q) * std::sin(2 * psi);
            const double tangent = alpha_ * std::tan(psi);
            const double cos_h = 1 / std::sqrt(1 + tangent * tangent);
            const DirectionalAlbedo ring = azimuths(cos_h, tangent * cos_h);
            sum.a += scale * ring.a;
            sum.b += scale * ring.b;
        }
    }

    /// Returns the mean over the azimuths of h.
    DirectionalAlbedo azimuths(double cos_h, double sin_h) const {
        const double lowest = (0.5 * mu_ / cos_h - mu_ * cos_h) / std::max(sine_ * sin_h, 1e-300);
        const double phi_max = std::acos(std::clamp(lowest, -1.0, 1.0));
        DirectionalAlbedo mean;
        for (std::size_t j = 0; j < rule_.x.size(); ++j) {
            const double x = std::min(mu_ * cos_h + sine_ * sin_h * std::cos(phi_max * rule_.x[j]), 1.0);  // dot(wo, h)
            const double mu_i = std::clamp(2 * x * cos_h - mu_, 0.0, 1.0);
            const double value =
                rule_.weight[j] * phi_max / kPi * 2 * mu_i * x / ((mu_ * root(mu_i) + mu_i * root_o_) * cos_h);
            const double schlick = fifth_power(1 - x);
            mean.a += value * (1 - schlick);
            mean.b += value * schlick;
        }
        return mean;
    }

    double mu_, sine_, alpha_, root_o_;
    const Quadrature& rule_;
};

/// Integral of an anisotropic lobe over the same density of half vectors: D cos_h dh = dv^2 dchi / (2 pi) for slopes
/// tan(psi) (alpha.x cos(chi), alpha.y sin(chi)) with sin^2(psi) = v^2. Reflections stay above the surface for slopes
/// in a circle around that of wo, which gives the largest psi for each chi.
class AnisotropicLobeIntegral {
  public:
    AnisotropicLobeIntegral(const dvec3& wo, const dvec2& alpha, const Quadrature& chi, const Quadrature& v)
        : wo_(std::abs(wo.x), std::abs(wo.y), std::max(wo.z, 1e-9)),  // 1e-9 stands for the limit at 0
          alpha_(alpha),
          root_o_(root(wo_)),
          chi_(chi),
          v_(v) {}

    DirectionalAlbedo operator()() const {
        // The largest psi changes quickly where the slope is across wo, and the lobe where it is across the rough
        // direction. Panels end there.
        const double towards = std::atan2(alpha_.y * wo_.y, alpha_.x * wo_.x);
        const double ends[] = {-kPi / 2, towards - kPi / 2, kPi / 2, towards + kPi / 2, 3 * kPi / 2};
        DirectionalAlbedo sum;
        for (int panel = 0; panel < 4; ++panel) {
            for (std::size_t i = 0; i < chi_.x.size(); ++i) {
                const double q = chi_.x[i], length = ends[panel + 1] - ends[panel];
                const double scale = chi_.weight[i] * length * 6 * q * (1 - q) / (2 * kPi);
                const DirectionalAlbedo line = slopes(ends[panel] + length * q * q * (3 - 2 * q));
                sum.a += scale * line.a;
                sum.b += scale * line.b;
            }
        }
        return sum;
    }

  private:
    double root(const dvec3& w) const { return std::hypot(alpha_.x * w.x, alpha_.y * w.y, w.z); }

    /// Returns the integral over v at one chi.
    DirectionalAlbedo slopes(double chi) const {
        const dvec2 step = alpha_ * dvec2(std::cos(chi), std::sin(chi));
        const double forward = step.x * wo_.x + step.y * wo_.y, squared = glm::dot(step, step);
        const double reach = std::sqrt(forward * forward + wo_.z * wo_.z * squared);
        const double largest = forward > 0 ? (forward + reach) / (wo_.z * squared) : wo_.z / (reach - forward);
        const double share = 1 / (1 + 1 / (largest * largest));  // sin^2 of the largest psi
        DirectionalAlbedo sum;
        for (std::size_t i = 0; i < v_.x.size(); ++i) {
            // Nodes are denser at the end, where shadowing falls off.
            const double q = 1 - v_.x[i], v = 1 - q * q * q;
            const double tangent = v * std::sqrt(share / (1 - share * v * v));
            const dvec2 slope = tangent * step;
            const double cos_h = 1 / std::sqrt(1 + glm::dot(slope, slope));
            const double x = std::min((wo_.x * slope.x + wo_.y * slope.y + wo_.z) * cos_h, 1.0);  // dot(wo, h)
            const dvec3 wi(2 * x * cos_h * slope - dvec2(wo_), 2 * x * cos_h - wo_.z);
            if (wi.z <= 0 || x <= 0) continue;  // by rounding at the end
            const double value =
                v_.weight[i] * 6 * q * q * v * share * 2 * wi.z * x / ((wo_.z * root(wi) + wi.z * root_o_) * cos_h);
            const double schlick = fifth_power(1 - x);
            sum.a += value * (1 - schlick);
            sum.b += value * schlick;
        }
        return sum;
    }

    dvec3 wo_;
    dvec2 alpha_;
    double root_o_;
    const Quadrature &chi_, &v_;
};

/// Returns the reflectance of a dielectric for unpolarised light (SHADING.md, Solid).
double fresnel(double x, double eta) {
    const double square = 1 - (1 - x * x) / (eta * eta);
    if (square <= 0) return 1;
    const double refracted = std::sqrt(square);
    const double across = (x - eta * refracted) / (x + eta * refracted);
    const double along = (eta * x - refracted) / (eta * x + refracted);
    return 0.5 * (across * across + along * along);
}

/// Returns the integral of the sheen's lobe l_h (SHADING.md), times mu_i, over mu_i and the azimuth.
double integrate_sheen(double mu_o, double roughness, const Quadrature& rule) {
    const double alpha = roughness * roughness, q_o = std::hypot(mu_o, shared::kSheenHorizon);
    const auto lambda = [alpha](double cosine) {
        return double(shared::sheen_lambda(static_cast<float>(cosine), static_cast<float>(alpha)));
    };
    const double lambda_o = lambda(q_o);
    const double sine_o = std::sqrt((1 - mu_o) * (1 + mu_o));
    double sum = 0;
    for (std::size_t i = 0; i < rule.x.size(); ++i) {
        const double q = rule.x[i], mu_i = q * q, sine_i = std::sqrt((1 - mu_i) * (1 + mu_i));
        double ring = 0;
        for (std::size_t j = 0; j < rule.x.size(); ++j) {
            // Nodes are denser where wo and wi are opposite: h turns quickly there at grazing angles.
            const double p = rule.x[j], cosine = -std::cos(kPi * p * p);
            const double squared = 2 + 2 * (sine_o * sine_i * cosine + mu_o * mu_i);
            const double cos_h = (mu_o + mu_i) / std::sqrt(std::max(squared, 1e-300));
            ring += 2 * p * rule.weight[j] * std::pow(std::max(1 - cos_h * cos_h, 0.0), 0.5 / alpha);
        }
        const double q_i = std::hypot(mu_i, shared::kSheenHorizon);
        sum += 2 * q * rule.weight[i] * ring * mu_i / (q_i * (1 + lambda_o + lambda(q_i)));
    }
    return (2 + 1 / alpha) * sum / (4 * q_o);  // 1 / (2 pi) of D, and the 2 pi of the azimuths
}

/// Returns node i of n Chebyshev-Lobatto nodes on [0, 1]. lobatto_weights() returns their weights for the interpolating
/// polynomial's value at x (Berrut and Trefethen 2004, Barycentric Lagrange Interpolation, eq. 5.4).
double lobatto_node(int i, int n) {
    return 0.5 - 0.5 * std::cos(kPi * i / (n - 1));
}
std::vector<double> lobatto_weights(int n, double x) {
    std::vector<double> weights(static_cast<std::size_t>(n), 0.0);
    double sum = 0;
    for (int i = 0; i < n; ++i) {
        const double distance = x - lobatto_node(i, n);
        double& weight = weights[static_cast<std::size_t>(i)];
        if (std::abs(distance) < 1e-14) {
            std::fill(weights.begin(), weights.end(), 0.0);
            weight = 1;
            return weights;
        }
        weight = (i % 2 == 0 ? 1 : -1) * (i == 0 || i == n - 1 ? 0.5 : 1.0) / distance;
        sum += weight;
    }
    for (double& weight : weights) weight /= sum;
    return weights;
}

/// Fills the part of a table that starts at a row with values of a function of its coordinates in [0, 1]. The function
/// is smooth, so a polynomial through few exact values gives all texels.
template <class Function>
void fill_table(Image& table, int first_row, Function&& function) {
    constexpr int kNodes = 24;
    constexpr int kSize = shared::kAlbedoTableSize;
    std::vector<dvec2> exact;
    for (int j = 0; j < kNodes; ++j) {
        for (int i = 0; i < kNodes; ++i) exact.push_back(function(lobatto_node(i, kNodes), lobatto_node(j, kNodes)));
    }
    std::vector<std::vector<double>> weights;
    for (int i = 0; i < kSize; ++i) weights.push_back(lobatto_weights(kNodes, i / (kSize - 1.0)));
    for (int y = 0; y < kSize; ++y) {
        std::vector<dvec2> row(kNodes, dvec2(0));
        for (int j = 0; j < kNodes; ++j) {
            for (int i = 0; i < kNodes; ++i) row[i] += weights[y][j] * exact[j * kNodes + i];
        }
        for (int x = 0; x < kSize; ++x) {
            dvec2 value(0);
            for (int i = 0; i < kNodes; ++i) value += weights[x][i] * row[i];
            table.at(x, first_row + y)[0] = static_cast<float>(std::max(value.x, 0.0));
            table.at(x, first_row + y)[1] = static_cast<float>(value.y);
        }
    }
}

/// Fills the part of the anisotropic lobe. The albedo is smooth along the cosine's coordinate, so a polynomial through
/// half as many exact values gives these texels.
void fill_anisotropy(Image& table, int first_row) {
    constexpr int kNodes = 16, kLastCosine = shared::kAnisotropyCosines - 1;
    const ivec3 last =
        ivec3(shared::kAnisotropyAngles, shared::kAnisotropyRoughnesses, shared::kAnisotropyStrengths) - 1;
    const Quadrature chi(10), v(16);
    std::vector<std::vector<double>> weights;
    for (int x = 0; x <= kLastCosine; ++x) weights.push_back(lobatto_weights(kNodes, double(x) / kLastCosine));
    const auto fill_line = [&](int line) {
        const ivec3 node(line % (last.x + 1), line / (last.x + 1) % (last.y + 1), line / (last.x + 1) / (last.y + 1));
        const dvec3 at = dvec3(node) / dvec3(last);
        // The inverse of anisotropy_coordinates().
        const double angle = kPi / 2 * (1 - (1 - at.x) * (1 - at.x)), roughness = 0.01 + 0.99 * at.y;
        const double alpha = roughness * roughness;
        const dvec2 alphas(alpha + (1 - alpha) * at.z * at.z, alpha);
        const double knee = shared::kAlbedoKnee * std::hypot(alphas.x * std::cos(angle), alphas.y * std::sin(angle));
        std::array<dvec2, kNodes> exact;
        for (int i = 0; i < kNodes; ++i) {
            const double x = lobatto_node(i, kNodes), cosine = std::min(x * x * knee / (1 + knee - x * x), 1.0);
            const double sine = std::sqrt((1 - cosine) * (1 + cosine));
            const dvec3 wo(sine * std::cos(angle), sine * std::sin(angle), cosine);
            const DirectionalAlbedo albedo = AnisotropicLobeIntegral(wo, alphas, chi, v)();
            const double whole = albedo.a + albedo.b;
            exact[i] = dvec2(whole, albedo.b / whole - fifth_power(1 - cosine));
        }
        for (int x = 0; x <= kLastCosine; ++x) {
            dvec2 value(0);
            for (int i = 0; i < kNodes; ++i) value += weights[x][i] * exact[i];
            const ivec2 texel = shared::anisotropy_texel(ivec4(x, node));
            table.at(texel.x, first_row + texel.y)[0] = static_cast<float>(value.x);
            table.at(texel.x, first_row + texel.y)[1] = static_cast<float>(value.y);
        }
    };
    // Isolation keeps this thread, while it waits, from running another task, which could wait for this table.
    tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, (last.x + 1) * (last.y + 1) * (last.z + 1), fill_line); });
}

}  // namespace

DirectionalAlbedo ggx_albedo(double cosine, double alpha, int nodes) {
    const Quadrature rule(nodes);
    return LobeIntegral(cosine, alpha, rule)();
}

DirectionalAlbedo ggx_albedo(const dvec3& wo, const dvec2& alpha, int nodes) {
    const Quadrature rule(nodes);
    return AnisotropicLobeIntegral(wo, alpha, rule, rule)();
}

double sheen_albedo(double cosine, double roughness, int nodes) {
    return integrate_sheen(cosine, roughness, Quadrature(nodes));
}

namespace {

/// Returns points of the R2 sequence (Roberts 2018), as a unit vector xy around the circle and a number in [0, 1).
std::vector<dvec3> circle_points(int count) {
    std::vector<dvec3> points;
    for (int i = 1; i <= count; ++i) {
        const double phi = 2 * kPi * std::fmod(i * 0.7548776662466927, 1.0);
        points.emplace_back(std::cos(phi), std::sin(phi), std::fmod(i * 0.5698402909980532, 1.0));
    }
    return points;
}

/// Averages over visible normals (Dupuy and Benyoub 2023) at circle_points(). With normals that are chosen by their
/// visibility, light that leaves counts G2 / G1.
SolidAlbedo solid_albedo(double cosine, double alpha, double eta, std::span<const dvec3> points) {
    const double mu = std::clamp(cosine, 1e-6, 1.0), sine = std::sqrt((1 - mu) * (1 + mu));
    const auto root = [&](double c) { return std::sqrt(alpha * alpha + (1 - alpha * alpha) * c * c); };
    const double root_o = root(mu);
    const auto seen = [&](double mu_i) {
        return mu_i > 0 ? mu_i * (mu + root_o) / (mu * root(mu_i) + mu_i * root_o) : 0.0;
    };
    const dvec3 stretched = glm::normalize(dvec3(alpha * sine, 0, mu));
    SolidAlbedo sum;
    for (const dvec3& point : points) {
        const double z = (1 - point.z) * (1 + stretched.z) - stretched.z, s = std::sqrt(std::max(1 - z * z, 0.0));
        const dvec3 cap = dvec3(s * point.x, s * point.y, z) + stretched;
        const dvec3 h = glm::normalize(dvec3(alpha * cap.x, alpha * cap.y, std::max(cap.z, 1e-20)));
        const double x = std::clamp(sine * h.x + mu * h.z, 0.0, 1.0);
        const double reflected = fresnel(x, eta);
        const double refracted_z = ((x - std::sqrt(std::max(eta * eta - 1 + x * x, 0.0))) * h.z - mu) / eta;
        const double passed = seen(-refracted_z);
        sum.whole += reflected * seen(2 * x * h.z - mu) + (1 - reflected) * passed;
        sum.refracted += passed;
    }
    const auto count = static_cast<double>(points.size());
    return {sum.whole / count, sum.refracted / count};
}

/// Fills the slices of the table of solid transmission.
void fill_solid_table(Image& table, int first_row) {
    constexpr int kSize = shared::kSolidTableSize;
    constexpr double kLast = kSize - 1;
    const std::vector<dvec3> points = circle_points(1024);  // 256 points have errors of up to 1 %
    const auto fill_slice = [&](int slice) {
        const double root = 2 * slice / (shared::kSolidTableSlices - 1.0) - 1;  // inverse of solid_coordinates()
        const double reflectance = shared::kSolidReflectance * root * std::abs(root);
        const double eta = (1 + reflectance) / (1 - reflectance);
        for (int y = 0; y < kSize; ++y) {
            const double roughness = 0.01 + 0.99 * y / kLast;
            const double knee = shared::kAlbedoKnee * roughness * roughness;
            for (int x = 0; x < kSize; ++x) {
                const double square = x / kLast * (x / kLast);
                const double cosine = square * knee / (1 + knee - square);  // inverse of albedo_coordinates()
                float* const texel = table.at(slice % shared::kSolidTableColumns * kSize + x,
                                              first_row + slice / shared::kSolidTableColumns * kSize + y);
                const SolidAlbedo albedo = solid_albedo(cosine, roughness * roughness, eta, points);
                texel[0] = static_cast<float>(albedo.whole);
                texel[1] = static_cast<float>(albedo.refracted);
            }
        }
    };
    // Isolation keeps this thread, while it waits, from running another task, which could wait for this table.
    tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, shared::kSolidTableSlices, fill_slice); });
}

}  // namespace

SolidAlbedo solid_albedo(double cosine, double alpha, double eta, int samples) {
    return solid_albedo(cosine, alpha, eta, circle_points(samples));
}

Image build_albedo_table(AlbedoParts parts) {
    const Quadrature rule(24);
    const int anisotropy_row = shared::kAlbedoTableSize * (parts.sheen ? 2 : 1);
    const int solid_row = anisotropy_row + (parts.anisotropy ? shared::kAnisotropyTableRows : 0);
    Image table(shared::kAlbedoTableSize, solid_row + (parts.solid ? shared::kSolidTableRows : 0), 2);
    fill_table(table, 0, [&](double x, double y) {
        const double roughness = 0.01 + 0.99 * y;
        const double knee = shared::kAlbedoKnee * roughness * roughness;
        const double cosine = x * x * knee / (1 + knee - x * x);  // inverse of albedo_coordinates()
        const DirectionalAlbedo albedo = LobeIntegral(cosine, roughness * roughness, rule)();
        const double whole = albedo.a + albedo.b;
        return dvec2(whole, albedo.b / whole - fifth_power(1 - cosine));
    });
    if (parts.sheen)
        fill_table(table, shared::kAlbedoTableSize, [&](double x, double y) {  // inverse of sheen_coordinates()
            return dvec2(integrate_sheen(x * x, glm::mix<double>(shared::kLeastSheenRoughness, 1, y * y), rule), 0);
        });
    if (parts.anisotropy) fill_anisotropy(table, anisotropy_row);
    if (parts.solid) fill_solid_table(table, solid_row);
    return table;
}

}  // namespace halflight
