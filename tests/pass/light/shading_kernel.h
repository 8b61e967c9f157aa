// Runs small kernels that use a scene's shading tables.
#pragma once

#include <epoxy/gl.h>

#include <string>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/context.h"
#include "engine/gpu/program.h"
#include "engine/gpu/texture.h"
#include "engine/tables/albedo.h"
#include "engine/tables/instance_rows.h"
#include "engine/tables/shading_tables.h"
#include "shaders/shared/texture_units.h"
#include "tests/support/texels.h"

namespace halflight {

/// Owns the tables of a scene, bound to their units, without passes and tracer.
class ShadingScene {
  public:
    explicit ShadingScene(const Scene& scene, LightChoice choice = LightChoice::tree)
        : trace(build_trace_tables(scene)), tables(build_shading_tables(scene, trace, {}, choice)) {
        for (const auto& [name, value] : shader_defines(tables.needs)) defines.set(name, value);
        add(shared::kUnitInstances, GL_RGBA32F, instance_rows(trace));
        add(shared::kUnitTriangles, GL_RGBA32UI, trace.triangles);
        add(shared::kUnitPositions, GL_RGB32F, trace.positions);
        add(shared::kUnitVertices, GL_RGBA32F, tables.vertices);
        add(shared::kUnitMaterials, GL_RGBA32F, tables.materials);
        add(shared::kUnitTextures, GL_RGBA32UI, tables.textures);
        add(shared::kUnitColorTexels, GL_RGBA16F, texels_of(tables.color_texels));
        add(shared::kUnitDataTexels, GL_RGBA8, texels_of(tables.data_texels));
        add(shared::kUnitLights, GL_RGBA32F, tables.lights);
        add(shared::kUnitLightAlias, GL_RG32F, tables.light_alias);
        add(shared::kUnitLightTree, GL_RGBA32UI, tables.light_tree);
        add(shared::kUnitLightOfTriangle, GL_R32UI, tables.light_of_triangle);
        add(shared::kUnitEnvironmentWarp, GL_RGBA32F, tables.environment_warp);
        add(shared::kUnitEnvironment, GL_RGB32F, tables.environment.pixels);
        add(shared::kUnitAlbedo, GL_RG32F, tables.albedo.pixels);
    }

    /// Runs a kernel for each i in [0, count); returns `rows` vec4 per i, which `main_body` writes to
    /// result[0..rows-1]. `main_body` can use `uint i` and vec4 inputs[]; `library` is placed before it.
    std::vector<vec4> run(const std::string& library, const std::string& main_body, std::uint32_t count,
                          std::uint32_t rows = 1, const std::vector<vec4>& inputs = {}) const {
        const std::string text =
            "#include \"shaders/geometry_tables.glsl\"\n"
            "#include \"shaders/scene_tables.glsl\"\n"
            "layout(local_size_x = 64) in;\n"
            "layout(std430) writeonly buffer Results { vec4 results[]; };\n"
            "layout(std430) readonly buffer Inputs { vec4 inputs[]; };\n" +
            library +
            "\nuniform uint count;"
            "\nvoid main() {\nuint i = gl_GlobalInvocationID.x;\nif (i >= count) return;\nvec4 result[ROWS];\n" +
            main_body + "\nfor (int r = 0; r < ROWS; ++r) results[i * ROWS + r] = result[r];\n}\n";
        gpu::Defines all = defines;
        all.set("ROWS", static_cast<long long>(rows));
        const gpu::Program program = gpu::Program::compute({"shading test", text}, all);
        gpu::Buffer results("results", std::size_t{count} * rows * sizeof(vec4));
        const gpu::Buffer in = gpu::Buffer::from("inputs", inputs);
        bind();
        program.bind_storage("Results", results);
        program.bind_storage("Inputs", in);
        program.set("count", count);
        program.dispatch((count + 63) / 64);
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        return results.read<vec4>();
    }

    void bind() const {
        for (const View& view : views_) view.buffer.bind_texture(view.unit, view.format);
    }

    TraceTables trace;
    ShadingTables tables;
    gpu::Defines defines;

  private:
    struct View {
        GLuint unit;
        GLenum format;
        gpu::Buffer buffer;
    };

    template <class T>
    void add(GLuint unit, GLenum format, const std::vector<T>& values) {
        views_.push_back({unit, format, gpu::Buffer::from("table", values)});
    }
    std::vector<View> views_;
};

/// GLSL that intersects triangles one by one.
inline constexpr const char* kMeetLibrary = R"(
#include "shaders/lib/intersect.glsl"
vec3 to_block(uint instance, vec3 v, float w) {
    if (!kInstances) return v;
    precise vec3 result;
    for (int r = 0; r < 3; ++r) {
        vec4 row = instance_row(instance, kInstanceWorldToBlock, r);
        result[r] = row.x * v.x + row.y * v.y + row.z * v.z + row.w * w;
    }
    return result;
}
// Finds the nearest of triangles [first, end) of one instance in (t_min, best.t).
void meet(Ray ray, uint instance, uint first, uint end, inout Hit best) {
    TriangleRay r = triangle_ray(to_block(instance, ray.origin, 1.0), to_block(instance, ray.direction, 0.0));
    for (uint t = first; t < end; ++t) {
        uvec3 corner = triangle_corners(t);
        vec3 a = corner_position(corner.x), b = corner_position(corner.y), c = corner_position(corner.z);
        mat3 m = transpose(mat3(a, b, c));
        PairEdges edges = intersect_pair(r, m[r.axes.x].xyzy, m[r.axes.y].xyzy, m[r.axes.z].xyzy);
        TrianglePoint p = pair_point(r, edges, false);  // weights: of a, c, b
        if (edges.met.x && p.t > ray.t_min && p.t < best.t) best = Hit(p.t, p.weights.z, p.weights.y, t, instance);
    }
}
)";

/// Returns one triangle (0,0,0), (1,0,0), (0,1,0) with normal +z and the given material.
inline Scene triangle_scene(const Material& material) {
    Scene scene;
    scene.name = "triangle";
    scene.materials = {material};
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.normals.assign(3, vec3(0, 0, 1));
    mesh.tangents.assign(3, vec4(1, 0, 0, 1));
    mesh.uvs[0] = {{0, 0}, {1, 0}, {0, 1}};
    mesh.uvs[1] = {{1, 1}, {0, 1}, {1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.triangle_material = {0};
    scene.meshes = {mesh};
    Instance instance;
    instance.mesh = 0;
    scene.instances = {instance};
    return scene;
}

}  // namespace halflight
