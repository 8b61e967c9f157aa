#include "api/first_picture/default_light.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "api/first_picture/default_camera.h"
#include "engine/core/image.h"
#include "engine/core/statistics.h"
#include "engine/scene/light_types.h"
#include "renderer/metering.h"

namespace halflight {
namespace {

constexpr double kRays = 1024;                            // camera rays of all cameras together
constexpr std::size_t kMostCameras = 16;                  // cameras that are asked, the first ones
constexpr int kCandidates = 256;                          // points on emitters, and as many punctual lights
constexpr int kVertices = 3;                              // surface points of a path
constexpr int kShadowRays = 4;                            // shadow rays at a surface point
constexpr double kLeastAlbedo = 0.05, kMostAlbedo = 0.8;  // black surfaces need no light, and textures may be missing

/// A light as a point, or as a small piece of an emissive triangle.
struct Candidate {
    dvec3 position{0};     // world units; unused if directional
    dvec3 direction{0};    // unit: normal of a triangle, direction of travel of a spot or directional light
    double intensity = 0;  // candela, lux; triangle: radiance x area
    double area = 0;       // area that the piece stands for; 0: punctual
    double cos_outer = -2;
    bool directional = false;
    const PunctualLight* light = nullptr;  // null: a triangle
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
    std::vector<std::vector<std::uint32_t>> emissive(scene.meshes.size());  // triangles, by mesh
    for (std::size_t m = 0; m < scene.meshes.size(); ++m)
        for (std::size_t t = 0; t < scene.meshes[m].triangles.size(); ++t) {
            const Material& material = scene.materials[scene.meshes[m].triangle_material[t]];
            if (!material.unlit && has_emission(material)) emissive[m].push_back(static_cast<std::uint32_t>(t));
        }
    // Calls f(mesh, triangle, corners in the world, power) for all emissive triangles of all instances.
    const auto for_emitters = [&](const auto& f) {
        for (const Instance& instance : scene.instances) {
            const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
            for (const std::uint32_t t : emissive[static_cast<std::size_t>(instance.mesh)]) {
                const Material& material = scene.materials[mesh.triangle_material[t]];
                dmat3 corners;
                for (int k = 0; k < 3; ++k)
                    corners[k] = dvec3(instance.object_to_world * dvec4(mesh.positions[mesh.triangles[t][k]], 1));
                const double doubled = glm::length(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
                f(mesh, t, corners, 0.5 * doubled * luminance_of(material.emission));
            }
        }
    };
    double power = 0;
    for_emitters([&](const Mesh&, std::size_t, const dmat3&, double more) { power += more; });
    if (!(power > 0) || !std::isfinite(power)) return;
    Random random(1);
    int next = 0;  // systematic sampling: the next point is on the triangle at which the sum of powers passes its place
    double sum = 0, place = power * random.next() / kCandidates;
    for_emitters([&](const Mesh& mesh, std::size_t t, const dmat3& corners, double more) {
        sum += more;
        for (; next < kCandidates && place < sum; place = power * (++next + random.next()) / kCandidates) {
            const double root = std::sqrt(random.next()), second = random.next();
            const vec3 weights(1 - root, root * (1 - second), root * second);
            const Material& material = scene.materials[mesh.triangle_material[t]];
            const double factor = luminance_of(material.emission);
            const double share =
                luminance_of(rays::emission_at(scene, material, mesh, mesh.triangles[t], weights)) / factor;
            const dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
            if (!(share > 0) || !(glm::length(normal) > 0)) continue;
            candidates.push_back({.position = corners * dvec3(weights),
                                  .direction = glm::normalize(normal),
                                  .intensity = share * power / kCandidates,
                                  .area = power / kCandidates / factor});
        }
    });
}

std::vector<Candidate> candidates_of(const Scene& scene) {
    std::vector<Candidate> candidates;
    add_emitters(scene, candidates);
    // A part of the lights stands for all if there are very many.
    const std::size_t step = (scene.lights.size() + kCandidates - 1) / kCandidates;
    for (std::size_t i = 0; i < scene.lights.size(); i += step) {
        const PunctualLight& light = scene.lights[i];
        Candidate candidate{.position = light.position,
                            .direction = dvec3(light.direction),
                            .intensity = double(step) * luminance_of(light.intensity),
                            .cos_outer = light.type == LightType::spot ? std::cos(double(light.outer_cone)) : -2,
                            .directional = light.type == LightType::directional,
                            .light = &light};
        if (light.profile != kNone) {
            const LitCone lit = lit_cone(scene.light_profiles[static_cast<std::size_t>(light.profile)]);
            if (lit.reversed) candidate.direction = -candidate.direction;
            candidate.intensity *= lit.share;
            candidate.cos_outer = std::cos(lit.angle);
        }
        candidates.push_back(candidate);
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
    const double most = std::max(distance2, double(light.light->radius) * double(light.light->radius));
    return -glm::dot(light.direction, direction) >= light.cos_outer ? cosine * light.intensity / most : 0;
}

/// Returns the share of light that a surface reflects, by its base colour.
double albedo(const rays::ProbeHit& at) {
    return std::clamp(luminance_of(at.color), kLeastAlbedo, kMostAlbedo);
}

/// Returns whether light from a point reaches a surface. has_size: it is a point of a light that paths can meet.
bool reaches(const rays::SceneProbe& probe, const dvec3& light, const rays::ProbeHit& at, bool has_size) {
    const dvec3 from = at.position + probe.spacing() * at.normal, to = light - from;
    const double distance = glm::length(to);
    return !(distance > 0) || !probe.blocked(from, to / distance, (1 - 1e-4) * distance - probe.spacing(), has_size);
}

/// Estimates the irradiance of all lights by shadow rays to candidates that are drawn in proportion to theirs.
double direct_light(const std::vector<Candidate>& lights, const rays::SceneProbe& probe, const rays::ProbeHit& at,
                    std::vector<double>& sums, Random& random) {
    sums.clear();
    double sum = 0;
    for (const Candidate& light : lights) sums.push_back(sum += irradiance(light, at));
    if (!(sum > 0)) return 0;
    int visible = 0;
    for (int ray = 0; ray < kShadowRays; ++ray) {
        const double wanted = sum * (ray + random.next()) / kShadowRays;
        const auto found = std::ranges::upper_bound(sums, wanted);
        const Candidate& light = lights[std::min<std::size_t>(std::size_t(found - sums.begin()), lights.size() - 1)];
        const dvec3 from = at.position + probe.spacing() * at.normal;
        const bool is_large =
            !light.light || rays::sine_of(*light.light, glm::length(light.position - from)) > rays::kLargeSine;
        visible += light.directional ? !probe.blocked(from, -light.direction, rays::SceneProbe::kFar, is_large)
                                     : reaches(probe, light.position, at, is_large);
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

double aspect_of(const Camera& camera) {
    return camera.aspect > 0 ? camera.aspect : kUsualAspect;
}

}  // namespace

LightShares light_shares(const rays::SceneProbe& probe, const std::vector<Camera>& cameras, double environment) {
    const std::vector<Candidate> lights = candidates_of(probe.scene());
    const std::size_t views = std::min(cameras.size(), kMostCameras);
    constexpr int kBlock = 4;  // rays along each side of a block, whose mean is less noisy than a path
    const int blocks = static_cast<int>(std::sqrt(kRays / double(std::max(views, std::size_t{1})))) / kBlock;
    const int side = blocks * kBlock;
    std::vector<double> sums;
    double seen = 0, visible = 0, bright = 0;
    for (std::size_t view = 0; view < views; ++view) {
        struct Part {
            double seen = 0, radiance = 0;  // number of points, and the sum of their radiance
            double points = 0,
                   own = 0;  // number of points that do not glow, and the sum of their radiance by the scene's light
        };
        std::vector<Part> seen_parts(static_cast<std::size_t>(blocks * blocks));
        for (int cell = 0; cell < side * side; ++cell) {
            Random random(static_cast<std::size_t>(cell) * kMostCameras + view + 2);
            const double x = (cell % side + random.next()) / side, y = (cell / side + random.next()) / side;
            const auto [origin, direction] = camera_ray(cameras[view], aspect_of(cameras[view]), x, y);
            auto hit = probe.see(origin, direction);
            if (!hit) continue;
            const bool glows = luminance_of(hit->emission) >= kVisible || hit->material->unlit;
            double own = luminance_of(hit->emission), of_sky = 0, weight = 1;
            for (int vertex = 0; vertex < kVertices && hit && !hit->material->unlit; ++vertex) {
                weight *= albedo(*hit);
                own += weight * direct_light(lights, probe, *hit, sums, random) / kPi;
                hit = probe.trace(hit->position + probe.spacing() * hit->normal, cosine_direction(hit->normal, random));
                if (!hit)
                    of_sky += weight;
                else if (hit->material->unlit)  // direct_light() leaves it out
                    own += weight * luminance_of(hit->emission);
            }
            Part& part = seen_parts[static_cast<std::size_t>(cell / side / kBlock * blocks + cell % side / kBlock)];
            part.radiance += own + environment * of_sky, ++part.seen;
            if (!glows) part.own += own + environment * of_sky, ++part.points;
        }
        Image picture(blocks, blocks, 3);
        for (int i = 0; i < blocks * blocks; ++i) {
            const Part& part = seen_parts[static_cast<std::size_t>(i)];
            std::fill_n(picture.at(i % blocks, i / blocks), 3, float(part.radiance / std::max(part.seen, 1.0)));
        }
        const double stops = metered_exposure(picture), least = kVisible / std::exp2(stops);
        const double least_bright = kVisible / std::exp2(std::min(stops, kMostStops));
        for (const Part& part : seen_parts) {
            visible += part.own >= least * part.points ? part.points : 0;
            bright += part.own >= least_bright * part.points ? part.points : 0;
            seen += part.points;
        }
    }
    if (seen == 0) return {.visible = 1, .bright = 1};
    return {visible / seen, bright / seen};
}

std::vector<PunctualLight> room_lamps(const rays::SceneProbe& probe, const std::vector<Camera>& cameras) {
    constexpr int kSide = 12, kPlaces = 64;
    constexpr std::size_t kLamps = 6;
    std::vector<rays::ProbeHit> seen;
    std::vector<dvec3> places;
    const std::size_t views = std::min(cameras.size(), kMostCameras);
    for (std::size_t view = 0; view < views; ++view)
        for (int cell = 0; cell < kSide * kSide; ++cell) {
            const auto [origin, direction] = camera_ray(cameras[view], aspect_of(cameras[view]),
                                                        (cell % kSide + 0.5) / kSide, (cell / kSide + 0.5) / kSide);
            const auto hit = probe.see(origin, direction);
            if (!hit) continue;
            seen.push_back(*hit);
            const dvec3 up(0, 1, 0), between = glm::mix(origin, hit->position, 0.2 + 0.6 * (cell % 7) / 6.0);
            const auto ceiling = probe.trace(between, up);
            places.push_back(ceiling ? glm::mix(between, ceiling->position, 0.5) : between);
        }
    // Fixed places among all, with their distances to surfaces and the points that they reach.
    struct Place {
        dvec3 point;
        double clearance;
        std::vector<bool> reached;
    };
    std::vector<Place> candidates;
    const int count = std::min(kPlaces, static_cast<int>(places.size()));
    for (int i = 0; i < count; ++i) {
        Place place{places[places.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(count)],
                    rays::SceneProbe::kFar,
                    {}};
        for (const dvec3& direction : sphere_directions(48))
            if (const auto hit = probe.trace(place.point, direction))
                place.clearance = std::min(place.clearance, glm::length(hit->position - place.point));
        for (const rays::ProbeHit& at : seen) place.reached.push_back(reaches(probe, place.point, at, false));
        if (place.clearance < rays::SceneProbe::kFar && place.clearance > 0) candidates.push_back(std::move(place));
    }
    std::vector<int> lamps_at(seen.size());  // number of lamps that reach each point
    Scene lit;
    while (lit.lights.size() < kLamps && !candidates.empty()) {
        const auto value = [&](const Place& p) {
            double sum = 0;
            for (std::size_t i = 0; i < seen.size(); ++i) sum += p.reached[i] ? std::exp2(-2.0 * lamps_at[i]) : 0;
            return sum * p.clearance;
        };
        const auto best = std::ranges::max_element(candidates, {}, value);
        if (value(*best) == 0) break;
        PunctualLight& lamp = lit.lights.emplace_back();
        lamp.name = fmt::format("room lamp {}", lit.lights.size());
        lamp.position = best->point;
        lamp.intensity = vec3(static_cast<float>(best->clearance * best->clearance));
        lamp.of_environment = true;
        for (std::size_t i = 0; i < seen.size(); ++i) lamps_at[i] += best->reached[i];
        candidates.erase(best);
    }
    const std::vector<Candidate> lamps = candidates_of(lit);
    std::vector<double> sums, irradiances;
    Random random(1);
    for (const rays::ProbeHit& at : seen) irradiances.push_back(direct_light(lamps, probe, at, sums, random));
    const double middle = irradiances.empty() ? 0 : median(irradiances);
    if (!(middle > 0)) return {};
    for (PunctualLight& lamp : lit.lights) lamp.intensity *= static_cast<float>(kPi / 3 / middle);
    return lit.lights;
}

DefaultLight default_light(const rays::SceneProbe& probe, const std::vector<Camera>& cameras, double environment) {
    const LightShares own = light_shares(probe, cameras, environment);
    if (own.bright >= kLeastVisible) return {};
    if (environment == 0 && light_shares(probe, cameras, kSkyRadiance).bright >= kLeastVisible) return {.sky = true};
    if (own.visible >= kLeastVisible) return {};
    return {.closed = true, .lamps = room_lamps(probe, cameras)};
}

}  // namespace halflight
