#include "api/default_light.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "api/default_camera.h"
#include "engine/scene/light_types.h"

namespace halflight {
namespace {

constexpr std::size_t kRays = 4096;        // camera rays of all cameras together
constexpr std::size_t kMostCameras = 16;   // cameras that are asked, the first ones
constexpr std::size_t kCandidates = 1024;  // points on emitters, and as many punctual lights
constexpr int kVertices = 3;               // surface points of a path
constexpr int kShadowRays = 4;             // shadow rays at a surface point
constexpr double kAlbedo = 0.5;

/// A light as a point, or as a small piece of an emissive triangle.
struct Candidate {
    dvec3 position{0};     // world units; unused where directional
    dvec3 direction{0};    // unit: normal of a triangle, direction of travel of a spot or directional light
    double intensity = 0;  // candela, lux; triangle: radiance x area
    double area = 0;       // area that the piece stands for; 0: punctual
    double cos_outer = -2;
    bool directional = false;
};

double luminance_of(const vec3& c) {
    return double(luminance(c));
}

/// Uniform numbers in [0,1), the same on every machine.
class Random {
  public:
    explicit Random(std::size_t seed) : engine_(seed) {}
    double next() { return double(engine_() >> 11) * 0x1p-53; }

  private:
    std::mt19937_64 engine_;
};

/// Appends points that are spread over all emissive triangles in proportion to area times emission factor. Points at
/// which the texture is black are left out.
void add_emitters(const Scene& scene, std::vector<Candidate>& candidates) {
    struct Emitter {
        const Instance* instance;
        const Mesh* mesh;
        std::size_t triangle;
        double power;  // power of this emitter and all before it
    };
    std::vector<Emitter> emitters;
    double power = 0;
    const auto corner = [](const Instance& instance, const Mesh& mesh, std::uint32_t vertex) {
        return dvec3(instance.object_to_world * dvec4(mesh.positions[vertex], 1));
    };
    for (const Instance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const Material& material = scene.materials[mesh.triangle_material[t]];
            if (material.unlit || !has_emission(material)) continue;
            const uvec3& v = mesh.triangles[t];
            const dvec3 a = corner(instance, mesh, v.x);
            const double area =
                0.5 * glm::length(glm::cross(corner(instance, mesh, v.y) - a, corner(instance, mesh, v.z) - a));
            power += area * luminance_of(material.emission);
            emitters.push_back({&instance, &mesh, t, power});
        }
    }
    if (!(power > 0) || !std::isfinite(power)) return;
    Random random(1);
    for (std::size_t i = 0; i < kCandidates; ++i) {
        const double wanted = power * (double(i) + random.next()) / double(kCandidates);
        const auto found = std::ranges::upper_bound(emitters, wanted, {}, &Emitter::power);
        const Emitter& e = found == emitters.end() ? emitters.back() : *found;
        const uvec3& v = e.mesh->triangles[e.triangle];
        const double root = std::sqrt(random.next()), second = random.next();
        const vec3 weights(1 - root, root * (1 - second), root * second);
        const dvec3 a = corner(*e.instance, *e.mesh, v.x), b = corner(*e.instance, *e.mesh, v.y),
                    c = corner(*e.instance, *e.mesh, v.z);
        const Material& material = scene.materials[e.mesh->triangle_material[e.triangle]];
        const vec3 texel = vec3(rays::texel(scene, material.emission_texture, *e.mesh, v, weights));
        const double factor = luminance_of(material.emission);
        const double share = luminance_of(material.emission * texel) / factor;
        const dvec3 normal = glm::cross(b - a, c - a);
        if (!(share > 0) || !(glm::length(normal) > 0)) continue;
        candidates.push_back({.position = double(weights.x) * a + double(weights.y) * b + double(weights.z) * c,
                              .direction = glm::normalize(normal),
                              .intensity = share * power / double(kCandidates),
                              .area = power / double(kCandidates) / factor});
    }
}

std::vector<Candidate> candidates_of(const Scene& scene) {
    std::vector<Candidate> candidates;
    add_emitters(scene, candidates);
    // A part of the lights stands for all where there are very many.
    const std::size_t step = (scene.lights.size() + kCandidates - 1) / kCandidates;
    for (std::size_t i = 0; i < scene.lights.size(); i += step) {
        const PunctualLight& light = scene.lights[i];
        candidates.push_back({.position = light.position,
                              .direction = dvec3(light.direction),
                              .intensity = double(step) * luminance_of(light.intensity),
                              .cos_outer = light.type == LightType::spot ? std::cos(double(light.outer_cone)) : -2,
                              .directional = light.type == LightType::directional});
    }
    return candidates;
}

/// Returns the irradiance that a candidate gives without occlusion.
double irradiance(const Candidate& light, const rays::ProbeHit& at) {
    if (light.directional) return light.intensity * std::max(-glm::dot(at.normal, light.direction), 0.0);
    const dvec3 to = light.position - at.position;
    const double distance2 = glm::dot(to, to);
    if (!(distance2 > 0)) return 0;
    const dvec3 direction = to / std::sqrt(distance2);
    const double cosine = std::max(glm::dot(at.normal, direction), 0.0);
    if (light.area > 0) {
        const double emitted = light.intensity * std::abs(glm::dot(light.direction, direction));
        return cosine * emitted / (distance2 + light.area);
    }
    return -glm::dot(light.direction, direction) >= light.cos_outer ? cosine * light.intensity / distance2 : 0;
}

/// Estimates the irradiance of all lights by shadow rays to candidates that are drawn in proportion to theirs.
double direct_light(const std::vector<Candidate>& lights, const rays::SceneProbe& probe, const rays::ProbeHit& at,
                    std::vector<double>& sums, Random& random) {
    sums.clear();
    double sum = 0;
    for (const Candidate& light : lights) sums.push_back(sum += irradiance(light, at));
    if (!(sum > 0)) return 0;
    const dvec3 from = at.position + probe.spacing() * at.normal;
    int visible = 0;
    for (int ray = 0; ray < kShadowRays; ++ray) {
        const double wanted = sum * (ray + random.next()) / kShadowRays;
        const auto found = std::ranges::upper_bound(sums, wanted);
        const Candidate& light = lights[std::min<std::size_t>(std::size_t(found - sums.begin()), lights.size() - 1)];
        if (light.directional) {
            visible += !probe.blocked(from, -light.direction, rays::SceneProbe::kFar);
            continue;
        }
        const dvec3 to = light.position - from;
        const double distance = glm::length(to);
        visible += !(distance > 0) || !probe.blocked(from, to / distance, (1 - 1e-4) * distance - probe.spacing());
    }
    return sum * visible / kShadowRays;
}

dvec3 cosine_direction(const dvec3& normal, Random& random) {
    const double z = 2 * random.next() - 1, phi = 2 * kPi * random.next();
    const double r = std::sqrt(std::max(1 - z * z, 0.0));
    const dvec3 direction = normal + dvec3(r * std::cos(phi), r * std::sin(phi), z);
    const double length = glm::length(direction);
    return length > 1e-6 ? direction / length : normal;
}

/// Returns a ray through a point of the picture, x and y in [0,1].
std::pair<dvec3, dvec3> camera_ray(const Camera& camera, double x, double y) {
    const dmat4& m = camera.camera_to_world;
    const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2);
    const double aspect = camera.aspect > 0 ? camera.aspect : kUsualAspect;
    const dvec3 aside = (2 * x - 1) * half * aspect * dvec3(m[0]) + (1 - 2 * y) * half * dvec3(m[1]);
    if (camera.orthographic) return {dvec3(m[3]) + aside, -dvec3(m[2])};
    return {dvec3(m[3]), glm::normalize(aside - dvec3(m[2]))};
}

}  // namespace

LightShares light_shares(const Scene& scene, const rays::SceneProbe& probe, const std::vector<Camera>& cameras) {
    const std::vector<Candidate> lights = candidates_of(scene);
    const std::size_t views = std::min(cameras.size(), kMostCameras);
    std::vector<double> sums;
    std::size_t seen = 0, emitting = 0;
    std::size_t lit[2] = {}, sky_lit[2] = {};  // for kNegligibleLight and for kNegligibleBesideEmission
    const auto side = static_cast<std::size_t>(std::sqrt(double(kRays) / double(std::max(views, std::size_t{1}))));
    for (std::size_t view = 0; view < views; ++view) {
        for (std::size_t cell = 0; cell < side * side; ++cell) {
            Random random(cell * kMostCameras + view + 2);
            const double x = (double(cell % side) + random.next()) / double(side);
            const double y = (double(cell / side) + random.next()) / double(side);
            const auto [origin, direction] = camera_ray(cameras[view], x, y);
            auto hit = probe.trace(origin, direction);
            if (!hit) continue;
            ++seen;
            if (luminance_of(hit->emission) >= kNegligibleLight || hit->material->unlit) {
                ++emitting;
                continue;
            }
            double own = 0, sky = 0, weight = 1;
            for (int vertex = 0; vertex < kVertices && hit; ++vertex, weight *= kAlbedo) {
                if (!hit->material->unlit) own += weight * direct_light(lights, probe, *hit, sums, random) / kPi;
                hit = probe.trace(hit->position + probe.spacing() * hit->normal, cosine_direction(hit->normal, random));
                if (!hit) sky += weight;
            }
            for (const bool beside : {false, true}) {
                const bool enough = own >= (beside ? kNegligibleBesideEmission : kNegligibleLight);
                lit[beside] += enough;
                sky_lit[beside] += !enough && sky >= kNegligibleLight;
            }
        }
    }
    if (seen == emitting) return {.lit = 1};  // there is nothing that a sky could light
    const bool beside = emitting > 0;
    const auto all = double(seen - emitting);
    return {double(lit[beside]) / all, double(sky_lit[beside]) / all};
}

bool needs_sky(const Scene& scene) {
    if (!scene.environment.black()) return false;
    if (!has_light(scene)) return true;
    const rays::SceneProbe probe(scene);
    const std::vector<Camera> cameras =
        scene.cameras.empty() ? std::vector<Camera>{default_camera(scene, kUsualAspect, probe).camera} : scene.cameras;
    const LightShares shares = light_shares(scene, probe, cameras);
    return shares.lit < kLitShare && shares.sky_lit >= kSkyShare;
}

}  // namespace halflight
