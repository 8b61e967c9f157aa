#include "api/default_light.h"

#include <algorithm>
#include <cmath>
#include <iterator>
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
constexpr std::size_t kTurns = 17;  // parts of the camera rays, after each of which a lit scene ends the search

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
    // Instances may have far more emissive triangles than memory holds records. A record then stands for several
    // triangles one after the other, whose powers are summed again where a point is among them.
    constexpr std::size_t kMostRecords = std::size_t{1} << 20;
    struct Record {
        std::size_t instance, place;  // the first one, and its place in the list of the mesh
        double before;                // power of all emitters before it
    };
    std::vector<Record> records;
    const auto corner = [](const Instance& instance, const Mesh& mesh, std::uint32_t vertex) {
        return dvec3(instance.object_to_world * dvec4(mesh.positions[vertex], 1));
    };
    std::vector<std::vector<std::uint32_t>> emissive(scene.meshes.size());  // triangles that emit, by mesh
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
        const Mesh& mesh = scene.meshes[m];
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const Material& material = scene.materials[mesh.triangle_material[t]];
            if (!material.unlit && has_emission(material)) emissive[m].push_back(static_cast<std::uint32_t>(t));
        }
    }
    // Calls f(instance, place in `emissive`, power) for all emitters from one on, until it returns true.
    const auto walk = [&](std::size_t instance, std::size_t place, const auto& f) {
        for (; instance < scene.instances.size(); ++instance, place = 0) {
            const Instance& i = scene.instances[instance];
            const Mesh& mesh = scene.meshes[static_cast<std::size_t>(i.mesh)];
            const std::vector<std::uint32_t>& triangles = emissive[static_cast<std::size_t>(i.mesh)];
            for (; place < triangles.size(); ++place) {
                const uvec3& v = mesh.triangles[triangles[place]];
                const Material& material = scene.materials[mesh.triangle_material[triangles[place]]];
                const dvec3 a = corner(i, mesh, v.x);
                const double area = 0.5 * glm::length(glm::cross(corner(i, mesh, v.y) - a, corner(i, mesh, v.z) - a));
                if (f(instance, place, area * luminance_of(material.emission))) return;
            }
        }
    };
    std::size_t emitters = 0;
    for (const Instance& instance : scene.instances)
        emitters += emissive[static_cast<std::size_t>(instance.mesh)].size();
    const std::size_t of_record = emitters / kMostRecords + 1;
    double power = 0;
    std::size_t walked = 0;
    walk(0, 0, [&](std::size_t instance, std::size_t place, double more) {
        if (walked++ % of_record == 0) records.push_back({instance, place, power});
        power += more;
        return false;
    });
    if (!(power > 0) || !std::isfinite(power)) return;
    Random random(1);
    for (std::size_t i = 0; i < kCandidates; ++i) {
        const double wanted = power * (double(i) + random.next()) / double(kCandidates);
        const auto after = std::ranges::upper_bound(records, wanted, {}, &Record::before);
        const Record& record = after == records.begin() ? records.front() : *std::prev(after);
        std::size_t at = record.instance, place_at = record.place;
        double sum = record.before;
        walk(at, place_at, [&](std::size_t instance, std::size_t place, double more) {
            at = instance, place_at = place;
            return (sum += more) > wanted;
        });
        const Instance& instance = scene.instances[at];
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        const std::size_t t = emissive[static_cast<std::size_t>(instance.mesh)][place_at];
        const uvec3& v = mesh.triangles[t];
        const double root = std::sqrt(random.next()), second = random.next();
        const vec3 weights(1 - root, root * (1 - second), root * second);
        const dvec3 a = corner(instance, mesh, v.x), b = corner(instance, mesh, v.y), c = corner(instance, mesh, v.z);
        const Material& material = scene.materials[mesh.triangle_material[t]];
        const vec3 texel = vec3(rays::texel(scene, material.emission_texture, mesh, v, weights));
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

/// Returns whether all light comes from emissive textures of at most 1.
bool only_displays(const Scene& scene) {
    return scene.lights.empty() && std::ranges::all_of(scene.materials, [](const Material& m) {
               return !has_emission(m) ||
                      (m.emission_texture && std::max({m.emission.r, m.emission.g, m.emission.b}) <= 1);
           });
}

/// Returns whether more than kLitShare of all points are lit, judged with four standard errors by some of them.
bool clearly_lit(std::size_t points, std::size_t lit) {
    if (points == 0) return false;
    const double share = double(lit) / double(points);
    return share - 4 * std::sqrt(kLitShare / double(points)) > kLitShare;
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

/// Returns whether a camera may be enclosed by the scene. Scenes without cameras are not asked: most of them are
/// objects, for which a probe would take time.
bool may_be_inside(const Scene& scene) {
    const WorldBounds bounds = world_bounds(scene);
    if (scene.paged_bounds || bounds.empty()) return false;
    return std::ranges::any_of(scene.cameras, [&](const Camera& camera) {
        const dvec3 at(camera.camera_to_world[3]);
        return glm::all(glm::greaterThan(at, bounds.lower)) && glm::all(glm::lessThan(at, bounds.upper));
    });
}

double median(std::vector<double>& values) {
    const auto middle = values.begin() + std::ssize(values) / 2;
    std::ranges::nth_element(values, middle);
    return *middle;
}

/// Returns a point light at each of the first cameras. All lamps together give the camera that sees most of their light
/// a median irradiance of pi, as the neutral sky does. The intensity of a lamp follows from the median distance of what
/// its camera sees.
std::vector<PunctualLight> camera_lamps(const rays::SceneProbe& probe, const std::vector<Camera>& cameras) {
    constexpr int kSide = 16;  // rays along both sides of a picture
    Scene lit;
    std::vector<std::vector<rays::ProbeHit>> seen;  // by lamp
    for (std::size_t i = 0; i < std::min(cameras.size(), kMostCameras); ++i) {
        std::vector<double> distances;
        std::vector<rays::ProbeHit> hits;
        for (int cell = 0; cell < kSide * kSide; ++cell) {
            const auto [origin, direction] =
                camera_ray(cameras[i], (cell % kSide + 0.5) / kSide, (cell / kSide + 0.5) / kSide);
            const auto hit = probe.trace(origin, direction);
            if (!hit) continue;
            distances.push_back(glm::length(hit->position - origin));
            hits.push_back(*hit);
        }
        if (distances.empty()) continue;
        seen.push_back(std::move(hits));
        PunctualLight& lamp = lit.lights.emplace_back();
        lamp.name = "camera lamp";
        lamp.position = dvec3(cameras[i].camera_to_world[3]);
        const double distance = median(distances);
        lamp.intensity = vec3(static_cast<float>(kPi * distance * distance));
        lamp.of_environment = true;
    }
    const std::vector<Candidate> lamps = candidates_of(lit);
    std::vector<double> sums;
    Random random(1);
    double most = 0;
    for (const std::vector<rays::ProbeHit>& hits : seen) {
        std::vector<double> irradiances;
        for (const rays::ProbeHit& at : hits) irradiances.push_back(direct_light(lamps, probe, at, sums, random));
        most = std::max(most, median(irradiances));
    }
    for (PunctualLight& lamp : lit.lights) lamp.intensity *= static_cast<float>(most > 0 ? kPi / most : 1);
    return lit.lights;
}

}  // namespace

LightShares light_shares(const Scene& scene, const rays::SceneProbe& probe, const std::vector<Camera>& cameras) {
    const std::vector<Candidate> lights = candidates_of(scene);
    const std::size_t views = std::min(cameras.size(), kMostCameras);
    std::vector<double> sums;
    std::size_t seen = 0, glowing = 0;
    const double limits[] = {kNegligibleLight,
                             only_displays(scene) ? kNegligibleBesideDisplays : kNegligibleBesideEmission};
    std::size_t lit[2] = {};  // by limit: that without visible emission, and that beside it
    double sky[2] = {};       // sums of the sky's light, by the same limits
    const auto side = static_cast<std::size_t>(std::sqrt(double(kRays) / double(std::max(views, std::size_t{1}))));
    for (std::size_t turn = 0; turn < kTurns && !clearly_lit(seen - glowing, std::min(lit[0], lit[1])); ++turn) {
        for (std::size_t ray = turn; ray < views * side * side; ray += kTurns) {
            const std::size_t view = ray % views, cell = ray / views;
            Random random(cell * kMostCameras + view + 2);
            const double x = (double(cell % side) + random.next()) / double(side);
            const double y = (double(cell / side) + random.next()) / double(side);
            const auto [origin, direction] = camera_ray(cameras[view], x, y);
            auto hit = probe.trace(origin, direction);
            if (!hit) hit = probe.trace(origin, direction, rays::SceneProbe::kFar, rays::Passing::none);
            if (!hit) continue;
            ++seen;
            if (luminance_of(hit->emission) >= kGlow || hit->material->unlit) {
                ++glowing;
                continue;
            }
            double own = 0, of_sky = 0, weight = 1;
            const double most = std::max(limits[0], limits[1]);
            for (int vertex = 0; vertex < kVertices && hit && own < most; ++vertex, weight *= kAlbedo) {
                own += weight * direct_light(lights, probe, *hit, sums, random) / kPi;
                hit = probe.trace(hit->position + probe.spacing() * hit->normal, cosine_direction(hit->normal, random));
                if (!hit) {
                    of_sky += weight;
                } else if (hit->material->unlit) {  // direct_light() leaves it out, and it reflects nothing
                    own += weight * luminance_of(hit->emission);
                    hit.reset();
                }
            }
            for (const bool beside : {false, true}) {
                const bool enough = own >= limits[beside];
                lit[beside] += enough;
                sky[beside] += enough ? 0 : of_sky;
            }
        }
    }
    if (seen == glowing) return {.lit = 1};  // there is nothing that a sky could light
    const bool beside = double(glowing) > kGlowingShare * double(seen);
    const auto all = double(seen - glowing);
    return {double(lit[beside]) / all, sky[beside] / all};
}

DefaultLight default_light(const Scene& scene) {
    if (!scene.environment.black()) return {};
    const bool dark = !has_light(scene);
    if (dark && !may_be_inside(scene)) return {.sky = true};
    const rays::SceneProbe probe(scene);
    const std::vector<Camera> cameras =
        scene.cameras.empty() ? std::vector<Camera>{default_camera(scene, kUsualAspect, probe).camera} : scene.cameras;
    const LightShares shares = light_shares(scene, probe, cameras);
    if (!dark) return {.sky = shares.lit < kLitShare && shares.sky >= kLeastSky};
    std::vector<PunctualLight> lamps;
    if (shares.sky < kLeastSky) lamps = camera_lamps(probe, cameras);
    return {lamps.empty(), std::move(lamps)};
}

}  // namespace halflight
