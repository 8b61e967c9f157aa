#include "engine/reference/sheen.h"

#include <algorithm>
#include <cmath>

namespace halflight::reference {
namespace {

/// Interpolates the paper's table 1, whose columns are alpha = 1 and alpha = 0, in (1 - alpha)^2.
double log_lambda(double x, double alpha) {
    constexpr double kRough[] = {21.5473, 3.82987, 0.19823, -1.97760, -4.32054};
    constexpr double kSmooth[] = {25.3245, 3.32435, 0.16801, -1.27393, -4.85967};
    const double smooth = (1 - alpha) * (1 - alpha), rough = 1 - smooth;
    const auto p = [&](int i) { return rough * kRough[i] + smooth * kSmooth[i]; };
    return p(0) / (1 + p(1) * std::pow(x, p(2))) + p(3) * x + p(4);
}

double lambda(double mu, double alpha) {
    if (mu < 0.5) return std::exp(log_lambda(mu, alpha));
    return std::exp(2 * log_lambda(0.5, alpha) - log_lambda(std::max(1 - mu, 0.0), alpha));
}

}  // namespace

double sheen_value(const dvec3& wo, const dvec3& wi, double roughness) {
    const double alpha = std::pow(std::max(roughness, kLeastSheenRoughness), 2);
    const dvec3 sum = wo + wi;
    const double sine = std::hypot(sum.x, sum.y) / std::max(length(sum), 1e-150);
    const double distribution = (2 + 1 / alpha) * std::pow(sine, 1 / alpha) / (2 * kPi);
    const double q_o = std::hypot(wo.z, 0.01), q_i = std::hypot(wi.z, 0.01);
    return distribution * wi.z / (4 * q_o * q_i * (1 + lambda(q_o, alpha) + lambda(q_i, alpha)));
}

double sheen_pdf(double mu, double roughness) {
    const double rate = 0.5 / std::max(roughness, kLeastSheenRoughness);
    return rate * std::exp(-rate * mu) / (-std::expm1(-rate) * 2 * kPi);
}

dvec3 sample_sheen(double roughness, double u1, double u2) {
    const double rate = 0.5 / std::max(roughness, kLeastSheenRoughness);
    const double mu = std::min(-std::log1p(u1 * std::expm1(-rate)) / rate, 1.0);
    const double r = std::sqrt((1 - mu) * (1 + mu)), phi = 2 * kPi * u2;
    return {r * std::cos(phi), r * std::sin(phi), mu};
}

}  // namespace halflight::reference
