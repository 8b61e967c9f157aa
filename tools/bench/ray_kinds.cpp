#include "tools/bench/ray_kinds.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "shaders/shared/pixel_order.h"

namespace halflight::bench {
namespace {

using shared::Hit;
using shared::Ray;

constexpr Ray kDead{vec3(0), 1, vec3(1), 0};

std::vector<Ray> primary_rays(const TraceTables& tables, const Camera& camera, int width, int height) {
    const uvec2 tiles((width + 15) / 16, (height + 15) / 16);
    const double half = camera.orthographic ? 0.5 * camera.ortho_height : std::tan(0.5 * camera.vertical_fov);
    const dmat3 axes(camera.camera_to_world);
    const vec3 eye(dvec3(camera.camera_to_world[3]) - tables.origin);
    std::vector<Ray> rays(std::size_t{tiles.x} * tiles.y * 256, kDead);
    for (std::uint32_t path = 0; path < rays.size(); ++path) {
        const ivec2 pixel = shared::pixel_of_path(path, tiles);
        if (pixel.x >= width || pixel.y >= height) continue;
        const double x = (2 * (pixel.x + 0.5) / width - 1) * half * width / height;
        const double y = (1 - 2 * (pixel.y + 0.5) / height) * half;
        if (camera.orthographic) {
            rays[path] = {eye + vec3(axes * dvec3(x, y, 0)), 0, vec3(-axes[2]), kInfinity};
        } else {
            rays[path] = {eye, 0, vec3(glm::normalize(axes * dvec3(x, y, -1))), kInfinity};
        }
    }
    return rays;
}

/// Where shadow rays go: a direction (at infinity) or a point.
struct Target {
    bool directional = false;
    vec3 value{0};
};

Target shadow_target(const Scene& scene, const TraceTables& tables, const Camera& camera) {
    for (const PunctualLight& light : scene.lights) {
        if (light.type == LightType::directional) return {true, -light.direction};
    }
    if (!scene.lights.empty()) return {false, vec3(scene.lights.front().position - tables.origin)};
    const vec3 eye(dvec3(camera.camera_to_world[3]) - tables.origin);
    return {false, eye + vec3(0, 0.05f * glm::length(tables.bounds.extent()), 0)};
}

class Sampler {
  public:
    float uniform() { return uniform_(random_); }
    /// About `normal` (unit), density cos / pi.
    vec3 cosine(const vec3& normal) {
        const float r = std::sqrt(uniform()), phi = angle();
        return around(normal, {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0f, 1 - r * r))});
    }
    /// A GGX normal about `normal` (Walter et al. 2007, eq. 35).
    vec3 microfacet(const vec3& normal, float alpha) {
        const float u = uniform(), phi = angle();
        const float z = std::sqrt((1 - u) / (1 + (alpha * alpha - 1) * u)), r = std::sqrt(std::max(0.0f, 1 - z * z));
        return around(normal, {r * std::cos(phi), r * std::sin(phi), z});
    }
    /// Within a cone of half angle `spread` (radians) about a unit direction.
    vec3 cone(const vec3& axis, float spread) {
        const float z = 1 - uniform() * (1 - std::cos(spread)), r = std::sqrt(std::max(0.0f, 1 - z * z)), phi = angle();
        return around(axis, {r * std::cos(phi), r * std::sin(phi), z});
    }

  private:
    float angle() { return 2 * static_cast<float>(kPi) * uniform(); }
    static vec3 around(const vec3& n, const vec3& local) {
        const vec3 side = glm::normalize(glm::cross(n, std::abs(n.x) < 0.7f ? vec3(1, 0, 0) : vec3(0, 1, 0)));
        return side * local.x + glm::cross(n, side) * local.y + n * local.z;
    }
    std::mt19937 random_{1};
    std::uniform_real_distribution<float> uniform_{0, 1};
};

}  // namespace

const std::vector<std::string>& ray_kinds() {
    static const std::vector<std::string> names{"primary", "hard", "soft", "glossy", "diffuse", "ao"};
    return names;
}

std::vector<RaySet> make_rays(const Scene& scene, const TraceTables& tables, const EmbreeTracer& tracer,
                              const Camera& camera, int width, int height) {
    std::vector<RaySet> sets(6);
    for (std::size_t k = 0; k < sets.size(); ++k) sets[k].kind = ray_kinds()[k];
    RaySet &primary = sets[0], &hard = sets[1], &soft = sets[2], &glossy = sets[3], &diffuse = sets[4], &ao = sets[5];
    hard.any_hit = soft.any_hit = ao.any_hit = true;
    primary.coherent = hard.coherent = soft.coherent = true;

    primary.rays = primary_rays(tables, camera, width, height);
    for (RaySet& set : sets) set.rays.resize(primary.rays.size(), kDead);
    std::vector<Hit> hits(primary.rays.size());
    tracer.closest(primary.rays, hits, true);

    const float diagonal = glm::length(tables.bounds.extent());
    const Target target = shadow_target(scene, tables, camera);
    Sampler random;
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const Ray& ray = primary.rays[i];
        if (hits[i].triangle == shared::kMiss || ray.t_max < ray.t_min) continue;
        vec3 normal = glm::normalize(tracer.normal_at(ray));
        if (glm::dot(normal, ray.direction) > 0) normal = -normal;
        const vec3 from = ray.origin + hits[i].t * ray.direction + normal * (diagonal * 1e-5f);
        const vec3 on_light =
            target.value + vec3(random.uniform() - 0.5f, 0, random.uniform() - 0.5f) * (0.05f * diagonal);
        if (target.directional) {
            hard.rays[i] = {from, 0, target.value, kInfinity};
            soft.rays[i] = {from, 0, random.cone(target.value, glm::radians(3.0f)), kInfinity};
        } else {
            hard.rays[i] = {from, 0, target.value - from, 1};
            soft.rays[i] = {from, 0, on_light - from, 1};
        }
        const vec3 reflected = glm::reflect(ray.direction, random.microfacet(normal, 0.2f * 0.2f));
        if (glm::dot(reflected, normal) > 0) glossy.rays[i] = {from, 0, reflected, kInfinity};
        diffuse.rays[i] = {from, 0, random.cosine(normal), kInfinity};
        ao.rays[i] = {from, 0, random.cosine(normal), 0.05f * diagonal};
    }
    for (RaySet& set : sets) {
        set.tolerance = diagonal * 0x1p-20f;
        set.live = static_cast<std::size_t>(
            std::count_if(set.rays.begin(), set.rays.end(), [](const Ray& r) { return r.t_max >= r.t_min; }));
    }
    return sets;
}

}  // namespace halflight::bench
