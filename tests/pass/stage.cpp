#include "tests/pass/stage.h"

#include <cassert>
#include <cmath>
#include <optional>

#include "shaders/shared/pixel_order.h"
#include "shaders/shared/sobol.h"

namespace halflight::test {

Stage::Stage(gpu::ProgramCache& programs, const Scene& scene, const Camera& camera, const ivec2& image,
             LightChoice lights)
    : programs_(programs),
      trace_tables_(build_trace_tables(scene)),
      shading_tables_(build_shading_tables(scene, trace_tables_, {}, lights)),
      buffers_(trace_tables_, shading_tables_),
      trace_(trace_tables_, buffers_.defines()) {
    sample_.band = {image, 0, image.y};
    look_through(camera, camera);
}

void Stage::select_sample(const SampleView& sample) {
    sample_ = sample;
    update();
}

void Stage::look_through(const Camera& camera, const Camera& previous) {
    camera_ = camera, previous_ = previous;
    const dvec3 eye = dvec3(camera.camera_to_world[3]) - trace_tables_.origin;
    reach_ = 1;
    if (!trace_tables_.bounds.empty()) {
        const dvec3 lower(trace_tables_.bounds.lower), upper(trace_tables_.bounds.upper);
        reach_ = glm::length(glm::max(glm::abs(lower - eye), glm::abs(upper - eye)));
    }
    update();
}

void Stage::select_sample(std::uint32_t index, std::uint32_t seed) {
    sample_.sample = index, sample_.seed = seed, sample_.begins = index == 0;
    sample_.jitter = shared::sample_2d(shared::make_sampler(~0u, ~0u, index, seed), 0);
    update();
}

void Stage::update() {
    frame_ = frame_constants(camera_, previous_, trace_tables_.origin, reach_, sample_);
    constants_.write(0, sizeof(frame_), &frame_);
}

SceneView Stage::view(graph::Graph& graph) {
    return {buffers_, trace_, tracer_, sample_.band, graph.import_buffer("frame constants", constants_)};
}

std::size_t Stage::path(int x, int y) const {
    const Band& b = sample_.band;
    assert(x >= 0 && x < b.image.x && y >= b.y && y < b.y + b.rows);
    return shared::path_of_pixel(uvec2(x, y - b.y), b.tiles());
}

namespace {

/// Calls f with the vec3 and float member of each row, for packing and unpacking.
template <class Row>
void for_each_row(const SceneNeeds& needs, Row&& row) {
    row(&SurfaceRecord::position, &SurfaceRecord::offset);
    row(&SurfaceRecord::emission, &SurfaceRecord::lift);
    row(&SurfaceRecord::geometric_normal, &SurfaceRecord::p_diffuse);
    row(&SurfaceRecord::normal, &SurfaceRecord::alpha);
    row(&SurfaceRecord::diffuse, &SurfaceRecord::p_transmission);
    if (needs.glossy) {
        row(&SurfaceRecord::specular, &SurfaceRecord::p_coat);
        row(&SurfaceRecord::specular_edge, &SurfaceRecord::coat_alpha);
    }
    if (needs.transmission) row(&SurfaceRecord::transmission, nullptr);
    if (needs.clearcoat) row(&SurfaceRecord::coat_normal, &SurfaceRecord::coat);
    if (needs.sheen) {
        row(&SurfaceRecord::sheen, &SurfaceRecord::sheen_alpha);
        row(&SurfaceRecord::sheen_choice, nullptr);
    }
    if (needs.anisotropy) row(&SurfaceRecord::rough_direction, &SurfaceRecord::alpha_across);
    if (needs.iridescence) {
        row(&SurfaceRecord::film_dielectric, &SurfaceRecord::film_ior);
        row(&SurfaceRecord::film_metal, &SurfaceRecord::film_thickness);
        row(&SurfaceRecord::film_dielectric_f0, nullptr);
        row(&SurfaceRecord::film_metal_f0, nullptr);
    }
    if (needs.volume) {
        row(&SurfaceRecord::solid_reflection, &SurfaceRecord::eta);
        row(&SurfaceRecord::absorption, &SurfaceRecord::thickness);
        row(&SurfaceRecord::coat_tint, &SurfaceRecord::solid_gain);
    }
    if (needs.diffuse_transmission) row(&SurfaceRecord::diffuse_through, &SurfaceRecord::p_through);
}

std::size_t row_count(const SceneNeeds& needs) {
    return needs.surface_record_bytes() / sizeof(vec4);
}

}  // namespace

std::vector<SurfaceRecord> unpack_surfaces(const std::vector<vec4>& rows, const SceneNeeds& needs) {
    const std::size_t stride = row_count(needs);
    std::vector<SurfaceRecord> records(rows.size() / stride);
    for (std::size_t i = 0; i < records.size(); ++i) {
        std::size_t at = i * stride;
        for_each_row(needs, [&](vec3 SurfaceRecord::*xyz, float SurfaceRecord::*w) {
            records[i].*xyz = vec3(rows[at]);
            if (w) records[i].*w = rows[at].w;
            ++at;
        });
        records[i].is_surface = records[i].lift >= 0;
    }
    return records;
}

std::vector<vec4> pack_surfaces(const std::vector<SurfaceRecord>& records, const SceneNeeds& needs) {
    const std::size_t stride = row_count(needs);
    std::vector<vec4> rows;
    rows.reserve(records.size() * stride);
    for (const SurfaceRecord& r : records) {
        for_each_row(needs, [&](vec3 SurfaceRecord::*xyz, float SurfaceRecord::*w) {
            rows.emplace_back(r.*xyz, w ? r.*w : 0.0f);
        });
        if (!r.is_surface) rows[rows.size() - stride + 1].w = -1;
    }
    return rows;
}

namespace {

std::optional<CameraHit> first_hit(const Scene& scene, const Camera& camera, const ivec2& image, const dvec2& at) {
    const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2);
    const double x = (2 * at.x / image.x - 1) * half * image.x / image.y, y = (1 - 2 * at.y / image.y) * half;
    const dmat3 turn(camera.camera_to_world);
    const dvec3 origin = dvec3(camera.camera_to_world[3]) + (camera.orthographic ? turn * dvec3(x, y, 0) : dvec3(0));
    const dvec3 along = turn * (camera.orthographic ? dvec3(0, 0, -1) : dvec3(x, y, -1));
    std::optional<CameraHit> nearest;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances[i].mesh)];
        const dmat4& m = scene.instances[i].object_to_world;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const uvec3 corner = mesh.triangles[t];
            const auto place = [&](std::uint32_t k) { return dvec3(m * dvec4(mesh.positions[k], 1)); };
            const dvec3 a = place(corner.x), e1 = place(corner.y) - a, e2 = place(corner.z) - a;
            const dvec3 face = glm::cross(e1, e2);
            const double depth = glm::dot(a - origin, face) / glm::dot(along, face);
            if (!(depth > camera.near_plane) || (nearest && nearest->depth <= depth)) continue;
            if (camera.far_plane > 0 && depth > camera.far_plane) continue;
            const dvec3 p = origin + depth * along - a;
            const double square = glm::dot(face, face);
            const double u = glm::dot(glm::cross(p, e2), face) / square;
            const double v = glm::dot(glm::cross(e1, p), face) / square;
            if (u < 0 || v < 0 || u + v > 1) continue;
            CameraHit s{i, t, depth, u, v, a + p, glm::normalize(face), {}, glm::normalize(along)};
            s.geometric_normal *= glm::dot(face, along) > 0 ? -1.0 : 1.0;
            const dmat3 carry = glm::transpose(glm::inverse(dmat3(m)));
            s.normal = glm::normalize(carry * ((1 - u - v) * dvec3(mesh.normals[corner.x]) +
                                               u * dvec3(mesh.normals[corner.y]) + v * dvec3(mesh.normals[corner.z])));
            s.normal *= glm::dot(s.normal, s.geometric_normal) < 0 ? -1.0 : 1.0;
            nearest = s;
        }
    }
    return nearest;
}

}  // namespace

CameraRayResult trace_camera_ray(const Scene& scene, const Camera& camera, const ivec2& image, const dvec2& at) {
    const std::optional<CameraHit> here = first_hit(scene, camera, image, at);
    CameraRayResult result;
    result.hit = here.has_value();
    if (here) result.surface = *here;
    for (const dvec2 step : {dvec2(1, 1), dvec2(1, -1), dvec2(-1, 1), dvec2(-1, -1)}) {
        const std::optional<CameraHit> there = first_hit(scene, camera, image, at + 0.01 * step);
        result.clear = result.clear && here.has_value() == there.has_value() &&
                       (!here || (here->instance == there->instance && here->triangle == there->triangle));
    }
    return result;
}

}  // namespace halflight::test
