// Provides a pass that runs alone with its inputs: a scene on the GPU, and the constants of one sample of one band.
#pragma once

#include <vector>

#include "engine/device/scene_view.h"
#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/rays/rays.h"
#include "renderer/frame_constants.h"
#include "shaders/shared/ray_structs.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {

/// Owns a scene on the GPU and its frame constants. The object must outlive the graphs that use it.
class Stage {
  public:
    /// Selects one band, the whole image, and sample 0 through the pixels' centres.
    Stage(gpu::ProgramCache& programs, const Scene& scene, const Camera& camera, const ivec2& image,
          LightChoice lights = LightChoice::automatic);

    void select_sample(const SampleView& sample);
    void look_through(const Camera& camera, const Camera& previous);
    /// Selects sample `index`, which has its own position in the pixel.
    void select_sample(std::uint32_t index, std::uint32_t seed = 1);

    SceneView view(graph::Graph& graph);
    const shared::Frame& frame() const { return frame_; }
    const Band& band() const { return sample_.band; }
    const TraceTables& trace_tables() const { return trace_tables_; }
    const SceneBuffers& buffers() const { return buffers_; }
    double reach() const { return reach_; }
    std::size_t paths() const { return sample_.band.paths(); }
    /// Returns the path of a pixel of the image; the pixel must be in the band.
    std::size_t path(int x, int y) const;

  private:
    void update();

    gpu::ProgramCache& programs_;
    TraceTables trace_tables_;
    ShadingTables shading_tables_;
    SceneBuffers buffers_;
    rays::TraceScene trace_;
    rays::Tracer tracer_{trace_};
    gpu::Buffer constants_{"frame constants", sizeof(shared::Frame)};
    Camera camera_, previous_;
    double reach_ = 0;
    SampleView sample_;
    shared::Frame frame_{};
};

/// A surface as rows of the G-buffer (shaders/shared/surface_rows.h); rows that the scene does not need stay 0.
struct SurfaceRecord {
    vec3 position{0};  // relative to TraceTables::origin
    float offset = 0;
    vec3 emission{0};
    float lift = 0;  // height of the position above the triangle; < 0: no surface
    bool is_surface = false;
    vec3 geometric_normal{0};
    float p_diffuse = 0;
    vec3 normal{0};
    float alpha = 0;
    vec3 diffuse{0};
    float p_transmission = 0;
    vec3 specular{0};
    float p_coat = 0;
    vec3 specular_edge{0};
    float coat_alpha = 0;
    vec3 transmission{0};
    vec3 coat_normal{0};
    float coat = 0;
    vec3 sheen{0};
    float sheen_alpha = 0;
    vec3 sheen_choice{0};  // x: p_sheen
    vec3 rough_direction{0};
    float alpha_across = 0;
    vec3 film_dielectric{0};
    float film_ior = 1;
    vec3 film_metal{0};
    float film_thickness = 0;
    vec3 film_dielectric_f0{0};
    vec3 film_metal_f0{0};
    vec3 solid_reflection{0};
    float eta = 0;
    vec3 absorption{0};
    float thickness = 0;
    vec3 coat_tint{1};
    float solid_gain = 0;
    vec3 diffuse_through{0};
    float p_through = 0;
};
std::vector<SurfaceRecord> unpack_surfaces(const std::vector<vec4>& rows, const SceneNeeds& needs);
/// Returns the rows of `records` as input of kernels.
std::vector<vec4> pack_surfaces(const std::vector<SurfaceRecord>& records, const SceneNeeds& needs);

/// Fixture that runs graphs with undefined memory poisoned.
class PassTest : public GpuTest {
  protected:
    PassTest() { executor.poison(true); }
    void run(const graph::Graph& graph) { executor.run(graph::compile(graph)); }

    gpu::ProgramCache programs;
    graph::Executor executor{programs};
};

/// Surface that a camera ray hits, found by testing every triangle in double precision.
struct CameraHit {
    std::uint32_t instance = 0;  // index in the scene
    std::uint32_t triangle = 0;  // index in the instance's mesh
    double depth = 0;            // distance along the camera's axis, world units
    double u = 0, v = 0;         // barycentric weights of the second and third corner
    dvec3 position{0};           // world units
    dvec3 geometric_normal{0};   // unit length, towards the camera
    dvec3 normal{0};             // interpolated, unit length, on the side of geometric_normal
    dvec3 direction{0};          // direction of the ray, unit length
};
struct CameraRayResult {
    bool hit = false;
    bool clear = true;  // all rays within 1/100 pixel agree on triangle or miss: no edge is near
    CameraHit surface;  // surface that is hit; valid for a hit
};
/// Returns the result of the camera ray through the point `at` of the image, in pixels.
CameraRayResult trace_camera_ray(const Scene& scene, const Camera& camera, const ivec2& image, const dvec2& at);

}  // namespace halflight::test
