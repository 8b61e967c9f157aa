#include "engine/reference/albedo.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/reference/ggx.h"
#include "engine/reference/sheen.h"

namespace halflight::reference {
namespace {

struct Rule {
    std::vector<double> x, weight;  // nodes on [0, 1], and their weights
};

/// Computes Gauss-Legendre nodes by Newton's iteration on the Legendre polynomial (Abramowitz, Stegun 25.4.29).
Rule gauss_legendre(int n) {
    Rule rule{std::vector<double>(n), std::vector<double>(n)};
    for (int i = 0; i < n; ++i) {
        double z = std::cos(kPi * (i + 0.75) / (n + 0.5)), derivative = 1;
        for (double step = 1; std::abs(step) > 1e-15;) {
            double p0 = 1, p1 = z;
            for (int k = 2; k <= n; ++k) p0 = std::exchange(p1, ((2 * k - 1) * z * p1 - (k - 1) * p0) / k);
            derivative = n * (z * p1 - p0) / (z * z - 1);
            step = p1 / derivative;
            z -= step;
        }
        rule.x[i] = 0.5 * (1 - z);
        rule.weight[i] = 1 / ((1 - z * z) * derivative * derivative);
    }
    return rule;
}

Albedo mirror_albedo(double mu) {
    return {1 - schlick(mu), schlick(mu)};
}

constexpr int kNodes = 64;

template <class Value>
using Table = std::array<Value, kNodes * kNodes>;

/// Returns f(x, y) at all nodes in [0, 1]^2.
template <class Value, class Function>
Table<Value> build_table(Function&& f) {
    Table<Value> table;
    const auto fill_row = [&](int j) {
        for (int i = 0; i < kNodes; ++i) {
            table[j * kNodes + i] = f(double(i) / (kNodes - 1), double(j) / (kNodes - 1));
        }
    };
    // Isolation keeps this thread, while it waits, from running a task of the renderer that needs this table.
    tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, kNodes, fill_row); });
    return table;
}

/// Cubic convolution weights (Keys 1981) of the nodes first .. first + 3 at x in [0, 1]. Beyond the ends the table is
/// extrapolated linearly; the weights are folded into the inner ones.
struct Cubic {
    int first = 0;
    std::array<double, 4> weight{};

    explicit Cubic(double x, int nodes = kNodes) {
        const double s = x * (nodes - 1);
        const int i = std::clamp(static_cast<int>(s), 0, nodes - 2);
        const double t = s - i;
        std::array<double, 4> w{t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (-2.5 + 1.5 * t),
                                t * (0.5 + t * (2 - 1.5 * t)), t * t * (-0.5 + 0.5 * t)};
        if (i == 0) {
            w = {w[1] + 2 * w[0], w[2] - w[0], w[3], 0};
        } else if (i == nodes - 2) {
            w = {0, w[0], w[1] - w[3], w[2] + 2 * w[3]};
        }
        first = std::clamp(i - 1, 0, nodes - 4);
        weight = w;
    }
};

}  // namespace

// Integrates over theta and phi, the polar angles of the half vector m against the plane of wo = (s, 0, c). With
// tan(theta) = alpha tan(omega), the distribution D cos(theta) is sin(2 omega) domega dphi / (2 pi). The albedo is its
// mean of 4 V dot(wo, m) F mu_i / cos(theta). The reflected direction is above the horizon where
// mu_i = s cos(phi) sin(2 theta) + c cos(2 theta) >= 0, that is theta <= (pi / 2 + atan2(s cos(phi), c)) / 2.
Albedo integrate_albedo(double mu, double alpha) {
    if (alpha < kMirrorAlpha) return mirror_albedo(mu);
    static const Rule rule = gauss_legendre(32);
    const double c = mu, s = std::sqrt(std::max(1 - mu * mu, 0.0));
    Albedo sum;
    for (int half = 0; half < 2; ++half) {
        for (std::size_t j = 0; j < rule.x.size(); ++j) {
            const double forward = s * std::cos(0.5 * kPi * (half + rule.x[j]));
            const double theta_max = 0.5 * (0.5 * kPi + std::atan2(forward, c));
            const double omega_max = std::atan2(std::sin(theta_max), alpha * std::cos(theta_max));
            for (std::size_t i = 0; i < rule.x.size(); ++i) {
                // At grazing angles the shadowing falls off within mu_i ~ c of the horizon, so the nodes are denser
                // there.
                const double omega = omega_max * (1 - rule.x[i] * rule.x[i]);
                const double theta = std::atan(alpha * std::tan(omega));
                const double cosine = std::cos(theta), sine = std::sin(theta);
                const double x = forward * sine + c * cosine;
                const double mu_i = 2 * x * cosine - c;
                if (mu_i <= 0 || x <= 0) continue;  // rounding at theta_max can cause such values
                const double density = 2 * rule.x[i] * omega_max * std::sin(2 * omega);
                const double value = 4 * ggx_visibility(c, mu_i, alpha) * x * mu_i / cosine;
                const double weight = 0.5 * rule.weight[j] * rule.weight[i] * density * value;
                sum.a += weight * (1 - schlick(x));
                sum.b += weight * schlick(x);
            }
        }
    }
    return sum;
}

Albedo directional_albedo(double mu, double alpha) {
    if (alpha < kMirrorAlpha) return mirror_albedo(mu);
    static const auto table =
        build_table<Albedo>([](double x, double y) { return integrate_albedo(x * x * x, y * y * y); });
    const Cubic x(std::cbrt(glm::clamp(mu, 0.0, 1.0))), y(std::cbrt(alpha));
    Albedo sum;
    for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) {
            const Albedo& node = table[(y.first + j) * kNodes + x.first + i];
            const double weight = x.weight[i] * y.weight[j];
            sum.a += weight * node.a;
            sum.b += weight * node.b;
        }
    }
    return sum;
}

// Integrates as for the isotropic lobe, over slopes tan(omega) (alpha.x cos(chi), alpha.y sin(chi)) of m. Four ranges
// of chi end where m is across wo and where it is across the rough direction.
Albedo integrate_albedo(const dvec3& wo, const dvec2& alpha) {
    static const Rule around = gauss_legendre(8), outward = gauss_legendre(16);
    const double azimuth = std::atan2(std::abs(wo.y), std::abs(wo.x)), c = std::max(wo.z, 1e-6);
    const double s = std::sqrt(std::max(1 - c * c, 0.0));
    const dvec3 view(s * std::cos(azimuth), s * std::sin(azimuth), c);
    const double facing = std::atan2(alpha.y * view.y, alpha.x * view.x);
    const std::array<double, 5> bounds{-kPi / 2, facing - kPi / 2, kPi / 2, facing + kPi / 2, 1.5 * kPi};
    Albedo sum;
    for (int range = 0; range < 4; ++range) {
        for (std::size_t j = 0; j < around.x.size(); ++j) {
            const double u = around.x[j], width = bounds[range + 1] - bounds[range];
            const double chi = bounds[range] + width * u * u * (3 - 2 * u);
            const double share = around.weight[j] * width * 6 * u * (1 - u) / (2 * kPi);
            const double along = alpha.x * std::cos(chi), across = alpha.y * std::sin(chi);
            const double stretch = std::hypot(along, across), phi = std::atan2(across, along);
            const double forward = s * std::cos(phi - azimuth);
            const double theta_max = 0.5 * (0.5 * kPi + std::atan2(forward, c));
            const double omega_max = std::atan2(std::sin(theta_max), stretch * std::cos(theta_max));
            for (std::size_t i = 0; i < outward.x.size(); ++i) {
                const double v = outward.x[i], omega = omega_max * (1 - v * v * v);
                const double theta = std::atan(stretch * std::tan(omega));
                const dvec3 m(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
                const double x = dot(view, m);
                const dvec3 wi = 2 * x * m - view;
                if (wi.z <= 0 || x <= 0) continue;
                const double density = 3 * v * v * omega_max * std::sin(2 * omega);
                const double value = 4 * ggx_visibility(view, wi, alpha) * x * wi.z / m.z;
                const double weight = share * outward.weight[i] * density * value;
                sum.a += weight * (1 - schlick(x));
                sum.b += weight * schlick(x);
            }
        }
    }
    return sum;
}

// The table has the coordinates cosine, azimuth, roughness across and strength. The cosine is stretched around the
// roughness that the viewer sees, and azimuths are dense around the direction of the lower roughness.
Albedo directional_albedo(const dvec3& wo, const dvec2& alpha) {
    constexpr std::array<int, 4> kSize{24, 10, 12, 12};
    const auto stretch = [](double azimuth, const dvec2& a) {
        return 3 * std::hypot(a.x * std::cos(azimuth), a.y * std::sin(azimuth));
    };
    static const std::vector<Albedo> table = [&] {
        std::vector<Albedo> values(static_cast<std::size_t>(kSize[0] * kSize[1] * kSize[2] * kSize[3]));
        const auto fill = [&](int index) {
            std::array<double, 4> node;
            for (int axis = 0, rest = index; axis < 4; rest /= kSize[axis++])
                node[axis] = rest % kSize[axis] / (kSize[axis] - 1.0);
            const auto [x, y, z, w] = node;
            const double azimuth = kPi / 2 * (1 - (1 - y) * (1 - y)), across = std::pow(0.01 + 0.99 * z, 2);
            const dvec2 a(across + (1 - across) * w * w, across);
            const double k = stretch(azimuth, a), mu = x * x * k / (1 + k - x * x);
            const double s = std::sqrt(std::max(1 - mu * mu, 0.0));
            values[static_cast<std::size_t>(index)] =
                integrate_albedo({s * std::cos(azimuth), s * std::sin(azimuth), mu}, a);
        };
        tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, static_cast<int>(values.size()), fill); });
        return values;
    }();
    const double azimuth = std::atan2(std::abs(wo.y), std::abs(wo.x)), mu = glm::clamp(wo.z, 0.0, 1.0);
    const double k = stretch(azimuth, alpha), strength = (alpha.x - alpha.y) / std::max(1 - alpha.y, 1e-12);
    const std::array<Cubic, 4> at{Cubic(std::sqrt(mu * (1 + k) / (mu + k)), kSize[0]),
                                  Cubic(1 - std::sqrt(std::max(1 - azimuth * 2 / kPi, 0.0)), kSize[1]),
                                  Cubic((std::sqrt(alpha.y) - 0.01) / 0.99, kSize[2]),
                                  Cubic(std::sqrt(glm::clamp(strength, 0.0, 1.0)), kSize[3])};
    Albedo sum;
    for (int corner = 0; corner < 256; ++corner) {
        double weight = 1;
        int index = 0;
        for (int axis = 3; axis >= 0; --axis) {
            const int step = corner >> (2 * axis) & 3;
            weight *= at[axis].weight[step];
            index = index * kSize[axis] + at[axis].first + step;
        }
        sum.a += weight * table[static_cast<std::size_t>(index)].a;
        sum.b += weight * table[static_cast<std::size_t>(index)].b;
    }
    return sum;
}

// Integrates over mu_i = u^3, whose nodes are dense at the horizon, and over the azimuth phi in [0, pi].
double integrate_sheen_albedo(double mu, double roughness) {
    static const Rule rule = gauss_legendre(32);
    const dvec3 wo(std::sqrt(std::max(1 - mu * mu, 0.0)), 0, mu);
    double sum = 0;
    for (std::size_t i = 0; i < rule.x.size(); ++i) {
        const double u = rule.x[i], mu_i = u * u * u, sine = std::sqrt(1 - mu_i * mu_i);
        for (std::size_t j = 0; j < rule.x.size(); ++j) {
            // Light from ahead, phi = pi, has a narrow dip at grazing angles.
            const double v = rule.x[j], phi = kPi * (1 - v * v);
            const dvec3 wi(sine * std::cos(phi), sine * std::sin(phi), mu_i);
            sum += rule.weight[i] * rule.weight[j] * 3 * u * u * 4 * kPi * v * sheen_value(wo, wi, roughness);
        }
    }
    return sum;
}

double sheen_albedo(double mu, double roughness) {
    static const auto table = build_table<double>([](double x, double y) {
        return integrate_sheen_albedo(x * x, kLeastSheenRoughness + (1 - kLeastSheenRoughness) * y * y);
    });
    const double r = std::max(roughness, kLeastSheenRoughness);
    const Cubic x(std::sqrt(glm::clamp(mu, 0.0, 1.0)));
    const Cubic y(std::sqrt((r - kLeastSheenRoughness) / (1 - kLeastSheenRoughness)));
    double sum = 0;
    for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) sum += x.weight[i] * y.weight[j] * table[(y.first + j) * kNodes + x.first + i];
    }
    return std::max(sum, 0.0);
}

}  // namespace halflight::reference
