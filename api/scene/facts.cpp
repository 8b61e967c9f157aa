#include "api/scene/facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <nlohmann/json.hpp>

#include "api/halflight/scene_edits.h"
#include "api/scene/added_surfaces.h"
#include "engine/core/error.h"
#include "engine/core/memory_ledger.h"
#include "engine/device/scene_view.h"
#include "engine/scene/light_types.h"
#include "engine/scene/material_properties.h"
#include "engine/scene/scene_size.h"
#include "engine/tables/shading_tables.h"
#include "renderer/render.h"

namespace halflight {
namespace {

using Json = nlohmann::ordered_json;

std::size_t instanced_triangles(const Scene& scene, const std::function<bool(const Material&)>& wanted) {
    std::vector<std::size_t> of_mesh;
    for (const Mesh& mesh : scene.meshes)
        of_mesh.push_back(static_cast<std::size_t>(std::ranges::count_if(
            mesh.triangle_material, [&](std::uint32_t material) { return wanted(scene.materials[material]); })));
    std::size_t count = 0;
    for (const Instance& instance : scene.instances) count += of_mesh[static_cast<std::size_t>(instance.mesh)];
    return count;
}

Json triple(const dvec3& v) {
    return {v.x, v.y, v.z};
}

Json bounds(const Scene& scene) {
    const WorldBounds box = world_bounds(scene);
    if (box.empty()) return nullptr;
    return {{"lower", triple(box.lower)}, {"upper", triple(box.upper)}, {"size", triple(box.upper - box.lower)}};
}

Json memory_facts(const Scene& scene, const RenderSettings& settings, const MemoryEstimate& m) {
    const SceneSize size = size_of(scene);
    Json parts{{"program", m.program}, {"scene", m.scene}, {"band", m.band},       {"visibility", m.visibility},
               {"reading", m.reading}, {"film", m.film},   {"preview", m.preview}, {"writing", m.writing}};
    return {{"geometry_bytes", size.geometry_bytes},
            {"texture_bytes", size.texture_bytes},
            {"texture_bytes_beyond_8_bits", size.deep_bytes},
            {"render_bytes", m.total()},
            {"limit_bytes", MemoryLedger::process().limit()},
            {"render_size", {settings.width, settings.height}},
            {"render_parts", parts}};
}

Json cameras(const Scene& scene) {
    Json list = Json::array();
    for (const Camera& camera : scene.cameras) {
        Json one{{"name", camera.name}, {"type", camera.orthographic ? "orthographic" : "perspective"}};
        if (camera.orthographic)
            one["height"] = camera.ortho_height;
        else
            one["vertical_fov_degrees"] = glm::degrees(camera.vertical_fov);
        if (camera.aspect > 0) one["aspect"] = camera.aspect;
        list.push_back(one);
    }
    return list;
}

Json lights(const Scene& scene) {
    Json punctual = Json::array();
    for (const PunctualLight& light : scene.lights) {
        punctual.push_back({{"name", light.name},
                            {"type", row_of(light.type).name},
                            {"intensity", triple(light.intensity)},
                            {"unit", row_of(light.type).unit}});
        if (light.profile != kNone)
            punctual.back()["profile"] = scene.light_profiles[static_cast<std::size_t>(light.profile)].name;
        if (light.radius > 0) punctual.back()["radius"] = light.radius;  // metres
        if (light.angle > 0) punctual.back()["angle_degrees"] = glm::degrees(light.angle);
    }
    for (const AreaLamp& lamp : area_lamps_of(scene))
        punctual.push_back({{"name", lamp.light.name},
                            {"type", name(lamp.disc ? LampKind::disc : LampKind::rectangle)},
                            {"intensity", triple(lamp.light.intensity)},
                            {"unit", "nits"},
                            {"size", {lamp.size.x, lamp.size.y}}});  // metres
    return {{"emissive_triangles", instanced_triangles(scene, has_emission)},
            {"punctual", punctual},
            {"environment", scene.environment.black() ? Json(nullptr) : triple(scene.environment.color)}};
}

Json features(const Scene& scene) {
    Json counts = Json::object();
    const auto add = [&](const std::string& name, const auto& has) {
        if (const auto count = std::ranges::count_if(scene.materials, has)) counts[name] = count;
    };
    add("alpha_mask", [](const Material& m) { return m.alpha_mode == AlphaMode::mask; });
    add("alpha_blend", [](const Material& m) { return m.alpha_mode == AlphaMode::blend; });
    add("normal_map", [](const Material& m) { return static_cast<bool>(m.normal_texture); });
    for (const MaterialLobe& lobe : material_lobes()) {
        std::string name = lobe.define;
        std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
        add(name, lobe.present);
    }
    return counts;
}

Json repaired(const SceneReport& report) {
    const std::pair<const char*, std::size_t> kCounts[] = {
        {"non_finite_triangles_dropped", report.non_finite_triangles_dropped},
        {"degenerate_triangles_dropped", report.degenerate_triangles_dropped},
        {"normals_generated", report.normals_generated},
        {"tangents_generated", report.tangents_generated},
        {"point_primitives_skipped", report.point_primitives_skipped},
        {"line_primitives_skipped", report.line_primitives_skipped},
        {"points_drawn", report.points_drawn},
        {"line_segments_drawn", report.line_segments_drawn},
    };
    Json counts = Json::object();
    for (const auto& [name, count] : kCounts)
        if (count > 0) counts[name] = count;
    return counts;
}

FrameOptions usual_options() {
    const RenderSettings usual;
    return {.bounces = bounces_of(usual),
            .group_size = static_cast<int>(usual.estimator.reuse),
            .camera_rays = static_cast<int>(usual.estimator.camera),
            .shadow_rays = static_cast<int>(usual.estimator.shadow)};
}

SceneNeeds usual_needs(const Scene& scene, const TraceTables& tables) {
    const Estimator usual;
    return shading_needs(scene, tables, usual.lights, usual.sun);
}

/// Returns the passes that light of the scene needs with the default number of bounces.
Json passes(const Scene& scene, const TraceTables& tables) {
    Json names = {"gbuffer"};
    const FrameNeeds frame = frame_needs(usual_needs(scene, tables), usual_options());
    for (const FramePart& pass :
         {frame.seen, frame.shadow, frame.diffuse, frame.glossy, frame.continuation, frame.reuse})
        if (pass) names.push_back(pass.name);
    return names;
}

}  // namespace

Json scene_counts(const Scene& scene, const SceneSize& size) {
    return {{"meshes", scene.meshes.size()},
            {"instances", scene.instances.size()},
            {"vertices", size.vertices},
            {"triangles", size.stored},
            {"triangles_with_instances", size.drawn},
            {"materials", scene.materials.size()},
            {"textures", scene.images.size()}};
}

MemoryEstimate scene_memory(const Scene& scene, const TraceTables& tables, bool moves, const RenderSettings& settings,
                            const PictureUse& use) {
    SceneSize size = size_of(scene);
    size.moves = moves;
    const Estimator& e = settings.estimator;
    return estimate_memory(shading_needs(scene, tables, e.lights, e.sun), size, settings, use);
}

Json scene_facts(const Scene& scene, const TraceTables& tables, const RenderSettings& settings,
                 const MemoryEstimate& memory) {
    return {{"counts", scene_counts(scene, size_of(scene))},
            {"bounds", bounds(scene)},
            {"memory", memory_facts(scene, settings, memory)},
            {"cameras", cameras(scene)},
            {"lights", lights(scene)},
            {"material_features", features(scene)},
            {"passes", passes(scene, tables)},
            {"repaired", repaired(scene.report)},
            {"warnings", scene.report.warnings}};
}

Json motion_facts(GltfScene& scene, std::vector<std::string>& warnings) {
    Json animations = Json::array(), skins = Json::array(), morphed = Json::array();
    try {
        for (const Animation& a : scene.animations()) {
            if (a.damage)
                warnings.push_back(a.damage->what());
            else
                animations.push_back({{"name", a.name}, {"seconds", a.end}, {"channels", a.channels.size()}});
        }
        const auto& left_out = scene.animation_warnings();
        warnings.insert(warnings.end(), left_out.begin(), left_out.end());
    } catch (const Error& error) {
        warnings.push_back(error.what());
    }
    const GltfDeformers deformers = scene.deformers();
    for (const auto& skin : deformers.skins) skins.push_back({{"name", skin.name}, {"joints", skin.joints}});
    for (const auto& mesh : deformers.morphed_meshes)
        morphed.push_back({{"mesh", mesh.name}, {"targets", mesh.targets}});
    const std::optional<FrameRate>& rate = scene.frame_rate();
    return {{"frames_per_second", rate ? Json(double(rate->numerator) / rate->denominator) : Json()},
            {"animations", animations},
            {"skins", skins},
            {"morph_targets", morphed}};
}

Json left_out_json(const std::vector<LeftOut>& left_out) {
    const std::vector<std::string> keepable = keepable_names();
    Json list = Json::array();
    for (const LeftOut& l : left_out)
        list.push_back({{"what", l.what},
                        {"fact", l.fact},
                        {"bytes", l.bytes},
                        {"can_be_kept", std::ranges::find(keepable, l.what) != keepable.end()}});
    return list;
}

std::vector<LeftOut> scene_left_out(const Scene& scene, const TraceTables& tables) {
    const RenderSettings usual;
    return left_out(usual_needs(scene, tables), usual_options(),
                    {.vertices = tables.positions.size(),
                     .triangles = tables.triangles.size(),
                     .paths = Band{{usual.width, usual.height}, 0, usual.height}.paths(),
                     .pixels = std::size_t(usual.width) * std::size_t(usual.height)});
}

}  // namespace halflight
