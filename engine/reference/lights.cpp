#include "engine/reference/lights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace halflight::reference {
namespace {

double mean(const dvec3& v) {
    return (v.x + v.y + v.z) / 3;
}

double area_of(const std::array<dvec3, 3>& c) {
    return 0.5 * length(cross(c[1] - c[0], c[2] - c[0]));
}

/// Samples a triangle uniformly (Osada et al. 2002); returns the weights of its second and third vertex.
dvec2 sample_barycentrics(double u1, double u2) {
    const double r = std::sqrt(u1);
    return {r * (1 - u2), r * u2};
}

/// Returns the mean emission, from 8 x 8 points if a texture varies it. A hundredth of the untextured power is
/// added, so that light sampling also finds small bright spots between the points.
double mean_emission(const Tracer& tracer, const TriangleId& id) {
    const Material& material = tracer.material(id);
    const double untextured = mean(dvec3(material.emission));
    if (!material.emission_texture) return untextured;
    constexpr int kGrid = 8;
    double sum = 0;
    for (int i = 0; i < kGrid * kGrid; ++i) {
        const dvec2 b = sample_barycentrics((i % kGrid + 0.5) / kGrid, (i / kGrid + 0.5) / kGrid);
        sum += mean(emission(tracer, id, b.x, b.y));
    }
    return sum / (kGrid * kGrid) + 0.01 * untextured;
}

using Profiles = std::vector<LightProfile>;

/// Returns the total power of a local light, or the irradiance of a directional one.
double punctual_power(const PunctualLight& light, const Profiles& profiles) {
    const double strength = mean(dvec3(light.intensity));
    if (light.profile != kNone)
        return 4 * kPi * strength * mean_share(profiles[static_cast<std::size_t>(light.profile)]);
    switch (light.type) {
        case LightType::point:
            return 4 * kPi * strength;
        case LightType::spot:
            return 2 * kPi * (1 - std::cos(double(light.outer_cone))) * strength;
        case LightType::directional:
            break;
    }
    return strength;
}

/// Returns the value of a function that is linear between ascending places, and 0 beyond them.
double interpolated(const std::vector<float>& places, double at, const std::function<double(std::size_t)>& value) {
    if (at < places.front() || at > places.back()) return 0;
    const auto above = static_cast<std::size_t>(std::ranges::upper_bound(places, at) - places.begin());
    if (above == places.size()) return value(above - 1);
    const double weight = (at - places[above - 1]) / (double{places[above]} - places[above - 1]);
    return (1 - weight) * value(above - 1) + weight * value(above);
}

/// Returns the share of the intensity that a lamp with a profile emits in a direction.
double profile_share(const PunctualLight& light, const LightProfile& profile, const dvec3& leaving) {
    const double v = std::acos(std::clamp(dot(leaving, normalize(dvec3(light.direction))), -1.0, 1.0));
    double h = std::atan2(dot(leaving, dvec3(light.up)), dot(leaving, dvec3(light.right)));
    if (h < 0) h += 2 * kPi;
    const auto column = [&](std::size_t at) {
        return interpolated(profile.vertical, v,
                            [&](std::size_t row) { return profile.shares[at * profile.vertical.size() + row]; });
    };
    return profile.horizontal.size() == 1 ? column(0) : interpolated(profile.horizontal, h, column);
}

/// Returns the share of the intensity that leaves a light in a direction.
double falloff(const PunctualLight& light, const Profiles& profiles, const dvec3& leaving) {
    if (light.profile != kNone) return profile_share(light, profiles[static_cast<std::size_t>(light.profile)], leaving);
    if (light.type != LightType::spot) return 1;
    const double inner = std::cos(double(light.inner_cone)), outer = std::cos(double(light.outer_cone));
    const double cosine = dot(leaving, normalize(dvec3(light.direction)));
    const double fade = std::clamp((cosine - outer) / std::max(inner - outer, 0.001), 0.0, 1.0);
    return fade * fade;
}

/// The cone of directions in which a light with a size is seen.
struct Cone {
    dvec3 axis;
    double spread;    // 1 - cos of half the angle; 2 from inside of a ball
    double radiance;  // radiance / intensity
    dvec3 to_centre;  // vector to the centre of a ball
    bool inside = false;
    double pdf() const { return 1 / (2 * kPi * spread); }
};

/// Returns 1 - cos of an angle below 90 degrees without cancellation.
double spread_of(double sine) {
    return sine * sine / (1 + std::sqrt((1 - sine) * (1 + sine)));
}

/// Returns how a light is seen from a point, or none if it has no size there; `origin` is Tracer::origin().
std::optional<Cone> cone_of(const PunctualLight& light, const dvec3& origin, const dvec3& from) {
    constexpr double kLeastSine = 1e-6;  // the engine takes smaller lights as points
    if (light.type == LightType::directional) {
        const double sine = std::sin(0.5 * double(light.angle));
        if (sine < kLeastSine) return std::nullopt;
        return Cone{-normalize(dvec3(light.direction)), spread_of(sine), 1 / (kPi * sine * sine), {}};
    }
    const dvec3 to_centre = light.position - origin - from;
    const double distance = length(to_centre), radius = light.radius;
    if (!(radius > 0) || radius < kLeastSine * distance) return std::nullopt;
    const double sine = radius / distance;
    const bool inside = distance <= radius;
    return Cone{distance > 0 ? to_centre / distance : dvec3(0, 0, 1), inside ? 2 : spread_of(sine),
                1 / (kPi * radius * radius), to_centre, inside};
}

/// Returns the distance at which a ray enters a ball, or leaves it from inside; none if it misses the ball.
std::optional<double> distance_to_ball(const Cone& cone, double radius, const dvec3& wi) {
    const double along = dot(cone.to_centre, wi);
    const dvec3 across = cone.to_centre - along * wi;
    const double square = radius * radius - dot(across, across);
    if (square < 0) return std::nullopt;
    const double distance = cone.inside ? along + std::sqrt(square) : along - std::sqrt(square);
    return distance >= 0 ? std::optional(distance) : std::nullopt;
}

/// Samples a light as a cone of directions.
std::optional<LightSample> sample_cone(const PunctualLight& light, const Profiles& profiles, const Cone& cone,
                                       const Surface& surface, Random& random) {
    const double off = random.uniform() * cone.spread, turn = 2 * kPi * random.uniform();
    const double cosine = 1 - off, sine = std::sqrt(off * (2 - off));
    const dvec3 across =
        normalize(std::abs(cone.axis.x) < 0.5 ? cross(cone.axis, dvec3(1, 0, 0)) : cross(cone.axis, dvec3(0, 1, 0)));
    LightSample s;
    s.wi = normalize(cosine * cone.axis + sine * (std::cos(turn) * across + std::sin(turn) * cross(cone.axis, across)));
    s.pdf = cone.pdf();
    s.radiance = dvec3(light.intensity) * cone.radiance * falloff(light, profiles, -s.wi);
    s.infinite = light.type == LightType::directional;
    if (!s.infinite) s.end = surface.position + distance_to_ball(cone, light.radius, s.wi).value_or(0) * s.wi;
    return s;
}

/// Samples a punctual light; `origin` is Tracer::origin().
std::optional<LightSample> sample_punctual(const PunctualLight& light, const Profiles& profiles, const dvec3& origin,
                                           const Surface& surface, Random& random) {
    if (const std::optional<Cone> cone = cone_of(light, origin, surface.position))
        return sample_cone(light, profiles, *cone, surface, random);
    LightSample s;
    s.pdf = 1;
    s.punctual = true;
    s.radiance = dvec3(light.intensity);
    if (light.type == LightType::directional) {
        s.wi = -normalize(dvec3(light.direction));
        s.infinite = true;
        return s;
    }
    s.end = light.position - origin;
    const dvec3 to_light = s.end - surface.position;
    const double distance2 = dot(to_light, to_light);
    if (!(distance2 > 0)) return std::nullopt;
    s.wi = to_light / std::sqrt(distance2);
    s.radiance *= falloff(light, profiles, -s.wi) / distance2;
    return s;
}

}  // namespace

Lights::Lights(const Tracer& tracer) : tracer_(tracer), environment_(tracer.scene().environment) {
    std::vector<double> powers;
    std::vector<bool> infinite;
    add_emitters(powers);
    infinite.resize(powers.size(), false);
    for (const PunctualLight& light : tracer.scene().lights) {
        powers.push_back(punctual_power(light, tracer.scene().light_profiles));
        infinite.push_back(light.type == LightType::directional);
    }
    powers.push_back(environment_.power());
    infinite.push_back(true);

    // Power cannot compare light from infinity with local light without a size of the scene, which says little about a
    // single point. If both exist, each gets half of the samples.
    std::array<double, 2> totals{};
    for (std::size_t i = 0; i < powers.size(); ++i) totals[infinite[i]] += powers[i];
    for (std::size_t i = 0; i < powers.size(); ++i) {
        if (powers[i] > 0) powers[i] /= totals[infinite[i]];
    }
    table_ = AliasTable(powers);
}

void Lights::add_emitters(std::vector<double>& powers) {
    const Scene& scene = tracer_.scene();
    emitter_of_.resize(scene.instances.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = *tracer_.placed(static_cast<int>(i)).mesh;
        for (std::size_t j = 0; j < mesh.triangles.size(); ++j) {
            const Material& material = scene.materials[mesh.triangle_material[j]];
            if (material.unlit || material.emission == vec3(0)) continue;
            const TriangleId id{static_cast<int>(i), static_cast<int>(j)};
            const double area = area_of(tracer_.corners(id));
            if (!(area > 0)) continue;
            emitter_of_[i].resize(mesh.triangles.size(), kNone);
            emitter_of_[i][j] = static_cast<int>(emitters_.size());
            emitters_.push_back({id, area});
            powers.push_back(2 * kPi * area * mean_emission(tracer_, id));
        }
    }
}

std::optional<LightSample> Lights::sample(const Surface& surface, Random& random) const {
    double u = random.uniform();
    const std::size_t chosen = table_.choose(u);
    const std::vector<PunctualLight>& punctual = tracer_.scene().lights;
    std::optional<LightSample> sample;
    if (chosen < emitters_.size()) {
        sample = sample_triangle(emitters_[chosen], surface, random);
    } else if (chosen < emitters_.size() + punctual.size()) {
        sample = sample_punctual(punctual[chosen - emitters_.size()], tracer_.scene().light_profiles, tracer_.origin(),
                                 surface, random);
    } else {
        sample.emplace();
        const double u1 = random.uniform(), u2 = random.uniform();
        sample->wi = environment_.sample(u1, u2);
        sample->radiance = environment_.radiance(sample->wi);
        sample->pdf = environment_.pdf(sample->wi);
        sample->infinite = true;
    }
    if (!sample) return sample;
    sample->pdf *= table_.probability(chosen);
    const Scene& scene = tracer_.scene();
    if (chosen < emitters_.size())
        sample->links = tracer_.links(emitters_[chosen].id);
    else if (chosen < emitters_.size() + punctual.size())
        sample->links = punctual[chosen - emitters_.size()].links;
    else
        sample->links = scene.environment.links;
    return sample;
}

std::optional<LightSample> Lights::sample_triangle(const Emitter& emitter, const Surface& surface,
                                                   Random& random) const {
    if (emitter.id == surface.triangle) return std::nullopt;
    const double u1 = random.uniform(), u2 = random.uniform();
    const dvec2 b = sample_barycentrics(u1, u2);
    const std::array<dvec3, 3> corners = tracer_.corners(emitter.id);
    const dvec3 point = (1 - b.x - b.y) * corners[0] + b.x * corners[1] + b.y * corners[2];
    const dvec3 to_light = point - surface.position;
    const double distance2 = dot(to_light, to_light);
    if (!(distance2 > 0)) return std::nullopt;

    LightSample s;
    s.wi = to_light / std::sqrt(distance2);
    dvec3 n = normalize(cross(corners[1] - corners[0], corners[2] - corners[0]));
    if (dot(n, s.wi) > 0) n = -n;
    const double cosine = -dot(n, s.wi);
    if (!(cosine > 0)) return std::nullopt;
    s.pdf = distance2 / (cosine * emitter.area);
    s.end = point + offset_bound(point, corners) * n;
    s.radiance = emission(tracer_, emitter.id, b.x, b.y);
    s.back = tracer_.one_sided(emitter.id) && dot(tracer_.front(emitter.id), s.wi) > 0;
    const Material& material = tracer_.material(emitter.id);
    if (material.alpha_mode != AlphaMode::opaque) {
        const double alpha = coverage(tracer_, emitter.id, b.x, b.y);
        s.radiance *= material.alpha_mode == AlphaMode::blend ? std::min(alpha, 1.0) : alpha >= material.alpha_cutoff;
    }
    return s;
}

double Lights::pdf(const dvec3& from, const Surface& on_light) const {
    const std::vector<int>& emitter_of = emitter_of_[static_cast<std::size_t>(on_light.triangle.instance)];
    if (emitter_of.empty()) return 0;
    const int emitter = emitter_of[static_cast<std::size_t>(on_light.triangle.triangle)];
    if (emitter == kNone) return 0;
    const dvec3 between = on_light.position - from;
    const double cosine = dot(on_light.n_g, on_light.wo);
    if (!(cosine > 0)) return 0;
    const double area = emitters_[static_cast<std::size_t>(emitter)].area;
    return table_.probability(static_cast<std::size_t>(emitter)) * dot(between, between) / (cosine * area);
}

std::vector<MetLight> Lights::met(const dvec3& from, const dvec3& wi, double begin, double end) const {
    std::vector<MetLight> all;
    const std::vector<PunctualLight>& punctual = tracer_.scene().lights;
    for (std::size_t i = 0; i < punctual.size(); ++i) {
        const std::optional<Cone> cone = cone_of(punctual[i], tracer_.origin(), from);
        if (!cone) continue;
        std::optional<double> distance;
        if (punctual[i].type != LightType::directional)
            distance = distance_to_ball(*cone, punctual[i].radius, wi);
        else if (0.5 * dot(wi - cone->axis, wi - cone->axis) < cone->spread)  // 1 - cos, without its cancellation
            distance = std::numeric_limits<double>::infinity();
        if (!distance || *distance < begin || (*distance >= end && !(std::isinf(*distance) && std::isinf(end))))
            continue;
        all.push_back(
            {dvec3(punctual[i].intensity) * cone->radiance * falloff(punctual[i], tracer_.scene().light_profiles, -wi),
             table_.probability(emitters_.size() + i) * cone->pdf(), *distance, punctual[i].links});
    }
    return all;
}

double Lights::pdf_environment(const dvec3& direction) const {
    if (environment_.black()) return 0;
    return table_.probability(emitters_.size() + tracer_.scene().lights.size()) * environment_.pdf(direction);
}

}  // namespace halflight::reference
