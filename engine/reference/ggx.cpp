#include "engine/reference/ggx.h"

#include <cmath>

namespace halflight::reference {

Frame::Frame(const dvec3& unit_normal) : z(unit_normal) {
    const double sign = std::copysign(1.0, z.z);
    const double a = -1 / (sign + z.z);
    const double b = z.x * z.y * a;
    x = {1 + sign * z.x * z.x * a, sign * b, -sign * z.x};
    y = {b, sign + z.y * z.y * a, -z.y};
}

double ggx_distribution(const dvec3& h, double alpha) {
    const double a2 = alpha * alpha;
    const double s = h.x * h.x + h.y * h.y + a2 * h.z * h.z;  // 1 - h.z^2 would cancel for small alpha
    return a2 / (kPi * s * s);
}

namespace {

/// Returns sqrt(alpha^2 + (1 - alpha^2) mu^2) = mu sqrt(1 + alpha^2 tan^2), the root in Smith's Lambda.
double smith_root(double mu, double alpha) {
    const double a2 = alpha * alpha;
    return std::sqrt(a2 + (1 - a2) * mu * mu);
}

}  // namespace

double ggx_visibility(double mu_o, double mu_i, double alpha) {
    return 0.5 / (mu_o * smith_root(mu_i, alpha) + mu_i * smith_root(mu_o, alpha));
}

dvec3 sample_visible_normal(const dvec3& wo, const dvec2& alpha, double u1, double u2) {
    const dvec3 v = normalize(dvec3(alpha.x * wo.x, alpha.y * wo.y, wo.z));  // stretched to the hemisphere
    const double r = std::sqrt(u1);
    const double phi = 2 * kPi * u2;
    // The visible half disk is seen along v. One of its axes must be horizontal, so both are built from v itself.
    const double horizontal = std::hypot(v.x, v.y);
    const dvec3 t1 = horizontal > 0 ? dvec3(-v.y, v.x, 0) / horizontal : dvec3(1, 0, 0);
    const dvec3 t2 = cross(v, t1);
    const double p1 = r * std::cos(phi);
    const double s = 0.5 * (1 + v.z);
    const double p2 = (1 - s) * std::sqrt(std::max(1 - p1 * p1, 0.0)) + s * r * std::sin(phi);
    const dvec3 n = p1 * t1 + p2 * t2 + std::sqrt(std::max(1 - p1 * p1 - p2 * p2, 0.0)) * v;
    return normalize(dvec3(alpha.x * n.x, alpha.y * n.y, std::max(n.z, 0.0)));  // stretched back
}

dvec3 sample_visible_normal(const dvec3& wo, double alpha, double u1, double u2) {
    return sample_visible_normal(wo, dvec2(alpha), u1, u2);
}

double reflection_pdf(const dvec3& wo, const dvec3& h, double alpha) {
    // The density is D G1 dot(wo, h) / wo.z, divided by 4 dot(wo, h); G1 = 2 mu / (mu + root).
    return ggx_distribution(h, alpha) / (2 * (wo.z + smith_root(wo.z, alpha)));
}

// Heitz 2014, eq. 85 and 86: D of stretched slopes, and Lambda with alpha^2 tan^2 = |alpha w_xy|^2 / w_z^2.

double ggx_distribution(const dvec3& h, const dvec2& alpha) {
    const double s = h.x * h.x / (alpha.x * alpha.x) + h.y * h.y / (alpha.y * alpha.y) + h.z * h.z;
    return 1 / (kPi * alpha.x * alpha.y * s * s);
}

namespace {

double smith_root(const dvec3& w, const dvec2& alpha) {
    return std::hypot(alpha.x * w.x, alpha.y * w.y, w.z);
}

}  // namespace

double ggx_visibility(const dvec3& wo, const dvec3& wi, const dvec2& alpha) {
    return 0.5 / (wo.z * smith_root(wi, alpha) + wi.z * smith_root(wo, alpha));
}

double reflection_pdf(const dvec3& wo, const dvec3& h, const dvec2& alpha) {
    return ggx_distribution(h, alpha) / (2 * (wo.z + smith_root(wo, alpha)));
}

}  // namespace halflight::reference
