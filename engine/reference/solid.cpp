#include "engine/reference/solid.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/reference/ggx.h"

namespace halflight::reference {
namespace {

/// Returns Smith's Lambda (Heitz 2014, eq. 72).
double smith_lambda(double mu, double alpha) {
    const double tangent2 = (1 - mu * mu) / (mu * mu);
    return 0.5 * (std::sqrt(1 + alpha * alpha * tangent2) - 1);
}

double g1(double mu, double alpha) {
    return 1 / (1 + smith_lambda(mu, alpha));
}
double g2(double mu_o, double mu_i, double alpha) {
    return 1 / (1 + smith_lambda(mu_o, alpha) + smith_lambda(mu_i, alpha));
}

/// Averages over visible normals at the midpoints of a grid. x: albedo by the Fresnel terms; y: albedo of an interface
/// without reflection.
dvec2 integrate(double mu, double alpha, double eta) {
    constexpr int kGrid = 32;
    const dvec3 wo(std::sqrt(std::max(1 - mu * mu, 0.0)), 0, mu);
    dvec2 sum(0);
    for (int i = 0; i < kGrid * kGrid; ++i) {
        const dvec3 h = sample_visible_normal(wo, alpha, (i / kGrid + 0.5) / kGrid, (i % kGrid + 0.5) / kGrid);
        const double x = std::clamp(dot(wo, h), 0.0, 1.0), reflectance = dielectric_fresnel(x, eta);
        const double up = 2 * x * h.z - mu, down = reflectance < 1 ? -refract(wo, h, eta).z : 0;
        if (up > 0) sum.x += reflectance * g2(mu, up, alpha) / g1(mu, alpha);
        if (down > 0) sum += dvec2(1 - reflectance, 1) * (g2(mu, down, alpha) / g1(mu, alpha));
    }
    return sum / double(kGrid * kGrid);
}

constexpr int kNodes = 28;
constexpr double kMost = 0.93;  // largest (eta - 1) / (eta + 1) of the table

/// Returns the albedo at nodes; x: cube root of the cosine; y: cube root of alpha; z: signed square root of
/// (eta - 1) / (eta + 1), so that nodes are dense around equal indices.
std::vector<dvec2> build_table() {
    std::vector<dvec2> table(kNodes * kNodes * kNodes);
    const auto fill = [&](int k) {
        const double z = 2.0 * k / (kNodes - 1) - 1, r = kMost * z * std::abs(z);
        for (int j = 0; j < kNodes; ++j) {
            for (int i = 0; i < kNodes; ++i) {
                const double x = std::max(double(i) / (kNodes - 1), 1e-2), y = std::max(double(j) / (kNodes - 1), 0.05);
                table[(k * kNodes + j) * kNodes + i] = integrate(x * x * x, y * y * y, (1 + r) / (1 - r));
            }
        }
    };
    // Isolation keeps this thread, while it waits, from running a task of the renderer that needs this table.
    tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, kNodes, fill); });
    return table;
}

}  // namespace

double dielectric_fresnel(double x, double eta) {
    // Walter et al. 2007, eq. 22.
    const double square = eta * eta - 1 + x * x;
    if (square <= 0) return 1;
    const double g = std::sqrt(square);
    if (g + x == 0) return 1;
    const double across = (g - x) / (g + x), along = (x * (g + x) - 1) / (x * (g - x) + 1);
    return 0.5 * across * across * (1 + along * along);
}

dvec3 refract(const dvec3& wo, const dvec3& h, double eta) {
    const double x = dot(wo, h), inverse = 1 / eta;
    return normalize((inverse * x - std::sqrt(std::max(1 + inverse * inverse * (x * x - 1), 0.0))) * h - inverse * wo);
}

Refraction evaluate_refraction(const dvec3& wo, const dvec3& wi, double alpha, double eta, double strength) {
    dvec3 h = -(wo + eta * wi);  // Walter et al. 2007, eq. 16; eta is that of wi's side
    if (h.z < 0) h = -h;
    h = normalize(h);
    const double x = dot(wo, h), y = dot(wi, h);
    if (!(x > 0 && y < 0)) return {};
    Refraction r;
    r.reflectance = strength * dielectric_fresnel(x, eta);
    const double jacobian = eta * eta * -y / ((x + eta * y) * (x + eta * y));  // eq. 17
    const double visible = ggx_distribution(h, alpha) * x / wo.z * jacobian;
    r.value = (1 - r.reflectance) * visible * g2(wo.z, -wi.z, alpha);
    r.pdf = visible * g1(wo.z, alpha);
    return r;
}

double solid_albedo(double mu, double alpha, double eta, double strength) {
    static const std::vector<dvec2> table = build_table();
    const double r = std::clamp((eta - 1) / (eta + 1) / kMost, -1.0, 1.0);
    const dvec3 at = dvec3(std::cbrt(std::clamp(mu, 0.0, 1.0)), std::cbrt(alpha),
                           0.5 + 0.5 * std::copysign(std::sqrt(std::abs(r)), r)) *
                     double(kNodes - 1);
    const glm::ivec3 cell = clamp(glm::ivec3(at), 0, kNodes - 2);
    const dvec3 f = at - dvec3(cell);
    dvec2 sum(0);
    for (int i = 0; i < 8; ++i) {
        const glm::ivec3 step(i & 1, i >> 1 & 1, i >> 2), node = cell + step;
        const double weight = (step.x ? f.x : 1 - f.x) * (step.y ? f.y : 1 - f.y) * (step.z ? f.z : 1 - f.z);
        sum += weight * table[(node.z * kNodes + node.y) * kNodes + node.x];
    }
    return strength * sum.x + (1 - strength) * sum.y;
}

}  // namespace halflight::reference
