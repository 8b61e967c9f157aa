#include "tools/measure/converge/fingerprint.h"

#include <vector>

#include "engine/core/hash.h"
#include "engine/scene/light_types.h"
#include "engine/scene/material_properties.h"

namespace halflight::converge {
namespace {

/// Hashes the members of Scene down to its numbers; the lengths of lists count, too.
class SceneHash {
  public:
    std::uint64_t of(const Scene& scene) {
        list(scene.images, [&](const TextureImage& i) {
            number(i.width), number(i.height);
            if (i.deep) number(i.deep);
            plain(i.rgba.get());
        });
        list(scene.materials, [&](const Material& m) { material(m); });
        list(scene.meshes, [&](const Mesh& m) { mesh(m); });
        list(scene.instances, [&](const Instance& i) {
            number(i.mesh);
            vector(i.object_to_world);
        });
        list(scene.lights, [&](const PunctualLight& l) {
            number(l.type), vector(l.intensity), vector(l.position), vector(l.direction);
            for (const LightProperty& p : light_properties()) number(l.*p.field);
            if (l.profile == kNone) return;
            const LightProfile& profile = scene.light_profiles[static_cast<std::size_t>(l.profile)];
            vector(l.right), vector(l.up);
            plain(profile.vertical), plain(profile.horizontal), plain(profile.shares);
        });
        vector(scene.environment.color);
        number(scene.environment.map.width), number(scene.environment.map.height);
        plain(scene.environment.map.pixels);
        return hash_.value();
    }

  private:
    template <class T>
    void number(const T& value) {
        hash_.add(value);
    }
    template <class V>
    void vector(const V& v) {
        hash_.add_bytes(&v, sizeof(v));  // GLM's vectors and matrices are packed
    }
    template <class T>
    void plain(const std::vector<T>& values) {
        number(values.size());
        hash_.add_bytes(values.data(), values.size() * sizeof(T));
    }
    template <class T, class F>
    void list(const std::vector<T>& values, const F& f) {
        number(values.size());
        for (const T& value : values) f(value);
    }

    void texture(const TextureRef& t) {
        number(t.image), number(t.uv_set), number(t.wrap_u), number(t.wrap_v), number(t.nearest);
        vector(t.uv_transform);
    }

    void material(const Material& m) {
        for (const MaterialProperty& property : material_properties())
            if (property.packing.row != kNone) vector(value_of(m, property.field));
        number(m.alpha_mode);
        for (const MaterialTexture& slot : material_textures()) texture(m.*slot.field);
    }

    void mesh(const Mesh& m) {
        plain(m.positions), plain(m.normals), plain(m.tangents), plain(m.uvs[0]), plain(m.uvs[1]);
        plain(m.colors), plain(m.triangles), plain(m.triangle_material);
    }

    Hash hash_;
};

}  // namespace

std::uint64_t scene_fingerprint(const Scene& scene) {
    return SceneHash().of(scene);
}

std::uint64_t reference_fingerprint(std::uint64_t scene, const View& view, std::string_view maker,
                                    const Picture& probe) {
    Hash hash;
    hash.add(scene);
    for (const int value : {view.width, view.height, view.bounces}) hash.add(value);
    const Camera& c = view.camera;
    hash.add_bytes(&c.camera_to_world, sizeof(c.camera_to_world));
    hash.add(c.orthographic);
    for (const double value : {c.vertical_fov, c.ortho_height, c.near_plane, c.far_plane}) hash.add(value);
    hash.add(c.optics.projection);
    hash.add(c.optics.stereo);
    for (const double value : {c.optics.fisheye_fov, c.optics.eye_distance, c.optics.convergence}) hash.add(value);
    if (const Lens& l = c.lens; l.blurs())
        for (const double value :
             {double{l.fstop}, l.aperture, l.sensor, l.focus.distance, double(l.blades), l.rotation})
            hash.add(value);
    hash.add(view.filter.shape);
    hash.add(view.filter.radius);
    hash.add_bytes(maker.data(), maker.size());
    for (const Image& image : probe.components)
        hash.add_bytes(image.pixels.data(), image.pixels.size() * sizeof(float));
    return hash.value();
}

}  // namespace halflight::converge
