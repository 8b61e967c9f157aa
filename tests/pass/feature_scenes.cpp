#include <cmath>
#include <random>

#include "tests/pass/scenes.h"

namespace halflight::test {
namespace {

/// Adds a texture of 8 x 6 noise texels between `lower` and `upper`; returns its index.
int add_texture(Scene& scene, const uvec4& lower, const uvec4& upper) {
    TextureImage& image = scene.images.emplace_back();
    image.width = 8, image.height = 6;
    std::mt19937 random(static_cast<unsigned>(scene.images.size()));
    for (int i = 0; i < image.width * image.height; ++i)
        for (int c = 0; c < 4; ++c)
            image.rgba.edit().push_back(
                static_cast<std::uint8_t>(std::uniform_int_distribution(lower[c], upper[c])(random)));
    return static_cast<int>(scene.images.size()) - 1;
}

TextureRef texture(int image, Wrap u = Wrap::repeat, Wrap v = Wrap::repeat) {
    TextureRef t;
    t.image = image;
    t.wrap_u = u, t.wrap_v = v;
    // The transform rotates, scales and translates, so that coordinates leave [0, 1] on all sides.
    t.uv_transform = {vec2(1.5f, 0.4f), vec2(-0.5f, 1.8f), vec2(-0.3f, -0.2f)};
    return t;
}

/// Gives a quad tangents along its first edge, a second set of texture coordinates, and vertex colours.
void dress(Mesh& mesh) {
    const vec3 tangent = glm::normalize(mesh.positions[1] - mesh.positions[0]);
    mesh.tangents.assign(4, vec4(tangent, 1));
    mesh.uvs[1] = {vec2(0.2f, 0.9f), vec2(1.4f, 0.7f), vec2(1.1f, -0.4f), vec2(-0.3f, 0.1f)};
    mesh.colors = {vec4(1), vec4(0.5f, 1, 0.7f, 1), vec4(1, 0.8f, 0.3f, 1), vec4(0.6f, 0.6f, 1, 1)};
}

}  // namespace

Scene textured_scene() {
    Scene scene;
    const uvec4 black(0, 0, 0, 255), white(255);
    const int color = add_texture(scene, uvec4(30, 30, 30, 255), white);
    const int data = add_texture(scene, uvec4(20, 90, 20, 40), white);
    const int normals = add_texture(scene, uvec4(70, 70, 170, 255), uvec4(185, 185, 255, 255));
    const int glow = add_texture(scene, black, white);

    Material base = diffuse_material(vec3(0.9f));
    base.base_color_texture = texture(color, Wrap::mirrored_repeat, Wrap::clamp_to_edge);

    Material glossy = metal_material(vec3(0.9f), 0.8f);
    glossy.metallic = 0.9f;
    glossy.base_color_texture = texture(color);
    glossy.base_color_texture.uv_set = 1;
    glossy.metallic_roughness_texture = texture(data, Wrap::clamp_to_edge, Wrap::mirrored_repeat);
    glossy.normal_texture = texture(normals);
    glossy.normal_scale = 0.7f;

    Material coated = metal_material({0.4f, 0.5f, 0.6f}, 0.6f);
    coated.metallic = 0;
    coated.specular = 0.8f;
    coated.specular_texture = texture(data);
    coated.specular_color = {1.2f, 1, 0.8f};
    coated.specular_color_texture = texture(color);
    coated.specular_color_texture.nearest = true;
    coated.clearcoat = 0.9f;
    coated.clearcoat_texture = texture(data);
    coated.clearcoat_roughness = 0.5f;
    coated.clearcoat_roughness_texture = texture(data);
    coated.clearcoat_normal_texture = texture(normals);
    coated.transmission = 0.7f;
    coated.transmission_texture = texture(data);

    Material cloth = diffuse_material({0.6f, 0.3f, 0.2f});
    cloth.sheen_color = {0.8f, 0.7f, 1};
    cloth.sheen_color_texture = texture(color);
    cloth.sheen_roughness = 0.6f;
    cloth.sheen_roughness_texture = texture(data);
    cloth.diffuse_transmission = 0.8f;
    cloth.diffuse_transmission_texture = texture(data);
    cloth.diffuse_transmission_color = {0.5f, 1, 0.7f};
    cloth.diffuse_transmission_color_texture = texture(color);

    Material brushed = metal_material({0.9f, 0.8f, 0.7f}, 0.4f);
    brushed.normal_texture = texture(normals);
    brushed.normal_scale = 0.4f;
    brushed.anisotropy_strength = 0.9f;
    brushed.anisotropy_rotation = 0.7f;
    brushed.anisotropy_texture = texture(data);
    brushed.iridescence = 0.9f;
    brushed.iridescence_texture = texture(data);
    brushed.iridescence_thickness_maximum = 700;
    brushed.iridescence_thickness_texture = texture(data);

    Material lamp = diffuse_material(vec3(0.3f));
    lamp.emission = {6, 5, 4};
    lamp.emission_texture = texture(glow);

    const auto add = [&](const Material& m, const vec3& p, const vec3& u, const vec3& v) {
        add_quad(scene, add_material(scene, m), p, u, v);
        dress(scene.meshes.back());
    };
    add(base, {-2, 0, -1}, {0, 0, 3}, {4, 0, 0});
    add(glossy, {-2, 0, -1}, {2, 0, 0.3f}, {0, 2, 0});
    add(coated, {0.2f, 0, -0.7f}, {1.8f, 0, -0.3f}, {0, 2, 0.3f});
    add(cloth, {-2, 0, 0.8f}, {1.2f, 0, 0}, {0, 0.6f, -0.5f});
    add(brushed, {0.7f, 0, 0.9f}, {1.2f, 0, 0}, {0, 0.6f, -0.5f});
    add(lamp, {-0.5f, 2.2f, 0}, {1, 0, 0}, {0, 0.3f, 0.6f});

    Environment& sky = scene.environment;
    sky.color = {0.4f, 0.5f, 0.6f};
    sky.map = Image(24, 12, 3);
    for (int y = 0; y < 12; ++y) {
        for (int x = 0; x < 24; ++x) {
            const bool sun = x == 5 && y == 3;
            for (int c = 0; c < 3; ++c)
                sky.map.at(x, y)[c] = sun     ? 60
                                      : y < 6 ? 0.5f + 0.1f * static_cast<float>((x * 7 + y * 5 + c) % 10)
                                              : 0.2f;
        }
    }
    scene.cameras = {look_at_camera({0.3, 1.6, 4.2}, {0, 0.9, 0}, {0, 1, 0}, 0.75)};
    return scene;
}

Scene curtain_scene() {
    Scene scene;
    const int holes = add_texture(scene, uvec4(120, 120, 120, 0), uvec4(255));
    Material masked = diffuse_material(vec3(0.8f, 0.5f, 0.4f));
    masked.base_color_texture = texture(holes);
    masked.alpha_mode = AlphaMode::mask;
    Material blended = masked;
    blended.alpha_mode = AlphaMode::blend;
    blended.base_color.a = 0.8f;
    Material glowing = blended;
    glowing.emission = {3, 4, 5};
    Material cutout = glowing;
    cutout.alpha_mode = AlphaMode::mask;
    cutout.alpha_cutoff = 0.4f;

    add_quad(scene, add_material(scene, diffuse_material(vec3(0.7f))), {-3, 0, -3}, {0, 0, 6}, {6, 0, 0});
    add_quad(scene, add_material(scene, masked), {-1.5f, 0.2f, 0.5f}, {1.2f, 0, 0.4f}, {0, 1.4f, 0});
    add_quad(scene, add_material(scene, blended), {0.2f, 0.2f, 0.5f}, {1.2f, 0, -0.4f}, {0, 1.4f, 0});
    add_quad(scene, add_material(scene, glowing), {-1.2f, 0.3f, -1}, {1, 0, 0.2f}, {0, 1.2f, 0});
    add_quad(scene, add_material(scene, cutout), {0.3f, 0.3f, -1.2f}, {1, 0, -0.2f}, {0, 1.2f, 0});
    add_quad(scene, add_material(scene, light_material({9, 8, 7})), {-0.4f, 3, 0.6f}, {0.8f, 0, 0}, {0, 0, 0.8f});
    scene.lights.emplace_back();
    scene.lights[0].intensity = {4, 5, 6};
    scene.lights[0].position = {1.5, 2, 2.5};
    scene.environment.color = {0.1f, 0.2f, 0.3f};
    scene.cameras = {look_at_camera({0.4, 1.8, 4.5}, {0, 0.6, 0}, {0, 1, 0}, 0.7)};
    return scene;
}

Scene instanced_scene() {
    Scene scene = pyramids();
    scene.materials[0] = metal_material({0.8f, 0.6f, 0.5f}, 0.5f);
    scene.materials[0].metallic = 0.3f;
    Mesh& mesh = scene.meshes[0];
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        mesh.colors.emplace_back(0.4f + 0.15f * static_cast<float>(i), 0.9f - 0.1f * static_cast<float>(i), 0.7f, 1);
    // This second shared mesh is emissive and has instances of three sizes.
    Mesh lamp = mesh;
    lamp.triangle_material.assign(6, static_cast<std::uint32_t>(add_material(scene, light_material({5, 6, 8}))));
    scene.meshes.push_back(lamp);
    for (const dvec4& place : {dvec4(-2, 3.2, 0.5, 0.25), dvec4(1, 1, 2, 0.1), dvec4(1.2, 3.4, 0, -0.15)}) {
        Instance& i = scene.instances.emplace_back();
        i.mesh = 1;
        i.object_to_world = dmat4(place.w);
        i.object_to_world[3] = dvec4(dvec3(place), 1);
    }
    add_quad(scene, add_material(scene, diffuse_material({0.5f, 0.6f, 0.5f})), {-6, -0.2f, -4}, {0, 0, 8}, {12, 0, 0});

    PunctualLight point;
    point.intensity = {8, 4, 2};
    point.position = {-1, 2.13, 3};  // the point is in no plane of a face
    PunctualLight spot = point;
    spot.type = LightType::spot;
    spot.intensity = {20, 40, 30};
    spot.position = {3, 5, 2};
    spot.direction = glm::normalize(vec3(-0.4f, -1, -0.4f));
    spot.inner_cone = 0.2f;
    spot.outer_cone = 0.5f;
    PunctualLight sun = point;
    sun.type = LightType::directional;
    sun.intensity = vec3(0.8f);
    sun.direction = glm::normalize(vec3(0.5f, -1, -0.6f));
    point.radius = 0.3f;  // the spot stays without a size
    sun.angle = 0.1f;
    scene.lights = {point, spot, sun};
    scene.cameras = {camera_on_pyramids()};
    scene.cameras.push_back(scene.cameras[0]);
    scene.cameras[1].orthographic = true;
    scene.cameras[1].ortho_height = 6.5;
    return scene;
}

}  // namespace halflight::test
