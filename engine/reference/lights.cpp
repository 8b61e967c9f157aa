#include "engine/reference/lights.h"

#include <algorithm>
#include <array>
#include <cmath>

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

/// Returns the mean emission, from 8 x 8 points where a texture varies it. A hundredth of the untextured power is
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

/// Returns the total power of a local light, or the irradiance of a directional one.
double punctual_power(const PunctualLight& light) {
    const double strength = mean(dvec3(light.intensity));
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

/// Samples a punctual light; `origin` is Tracer::origin().
std::optional<LightSample> sample_punctual(const PunctualLight& light, const dvec3& origin, const Surface& surface) {
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
    s.radiance /= distance2;
    if (light.type == LightType::spot) {
        const double inner = std::cos(double(light.inner_cone)), outer = std::cos(double(light.outer_cone));
        const double cosine = -dot(s.wi, normalize(dvec3(light.direction)));
        const double fade = std::clamp((cosine - outer) / std::max(inner - outer, 0.001), 0.0, 1.0);
        s.radiance *= fade * fade;
    }
    return s;
}

}  // namespace

Lights::Lights(const Tracer& tracer) : tracer_(tracer), environment_(tracer.scene().environment) {
    std::vector<double> powers;
    std::vector<bool> infinite;
    add_emitters(powers);
    infinite.resize(powers.size(), false);
    for (const PunctualLight& light : tracer.scene().lights) {
        powers.push_back(punctual_power(light));
        infinite.push_back(light.type == LightType::directional);
    }
    powers.push_back(environment_.power());
    infinite.push_back(true);

    // Power cannot compare light from infinity with local light without a size of the scene, which says little about a
    // single point. Where both exist, each gets half of the samples.
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
        sample = sample_punctual(punctual[chosen - emitters_.size()], tracer_.origin(), surface);
    } else {
        sample.emplace();
        const double u1 = random.uniform(), u2 = random.uniform();
        sample->wi = environment_.sample(u1, u2);
        sample->radiance = environment_.radiance(sample->wi);
        sample->pdf = environment_.pdf(sample->wi);
        sample->infinite = true;
    }
    if (sample) sample->pdf *= table_.probability(chosen);
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

double Lights::pdf_environment(const dvec3& direction) const {
    if (environment_.black()) return 0;
    return table_.probability(emitters_.size() + tracer_.scene().lights.size()) * environment_.pdf(direction);
}

}  // namespace halflight::reference
