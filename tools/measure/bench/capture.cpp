#include "tools/measure/bench/capture.h"

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <optional>

#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/tables/shading_tables.h"
#include "passes/light/continuation.h"
#include "passes/light/first_scatter.h"
#include "passes/light/shadow.h"
#include "renderer/frame.h"
#include "renderer/frame_constants.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/pixel_order.h"
#include "tools/measure/bench/appearance.h"
#include "tools/measure/bench/graph_run.h"

namespace halflight::bench {
namespace {

using graph::Access;
using shared::Ray;

constexpr std::uint32_t kConnectionsPerBlock = 16 * 16 * 16;  // groups x points x receivers

/// Data read back from one run.
struct Shot {
    graph::BufferHandle rays;
    PathList list;          // paths that have rays; null: all
    std::size_t count = 0;  // number of rays
    bool paths_are_pixels = true;
};

/// One appearance of a scene on the GPU, captured by a camera band by band.
class Studio {
  public:
    Studio(const gpu::Context& context, gpu::ProgramCache& programs, const Scene& scene, const TraceTables& tables,
           const rays::TraceScene& trace, const Camera& camera, const ivec2& size)
        : programs_(programs),
          tables_(tables),
          trace_(trace),
          seen_{{.camera = camera}},
          size_(size),
          buffers_(tables, build_shading_tables(scene, tables)) {
        const std::size_t row_of_blocks = (static_cast<std::size_t>(size.x) + 15) / 16 * 256;
        const std::size_t rows = context.limits().storage_block_bytes / widest_record_bytes(buffers_) / row_of_blocks;
        band_ = {size, 0, std::min(static_cast<int>(std::clamp<std::size_t>(rows, 1, 4096)) * 16, size.y)};
    }

    RaySet shoot(const std::function<Shot(graph::Graph&, const SceneView&)>& add) {
        RaySet set;
        for (Band where = band_; where.y < size_.y; where.y += band_.rows) {
            graph::Graph graph;
            const SceneView view{buffers_, trace_, tracer_, band_, graph.import_buffer("frame constants", frame_)};
            look_at(where);
            append(graph, add(graph, view), where, set);
        }
        return set;
    }

    const SceneBuffers& buffers() const { return buffers_; }
    const Band& band() const { return band_; }

  private:
    void look_at(const Band& where) {
        const shared::Frame constants =
            frame_constants(seen_, tables_, sample_view(seen_, where, 0, SamplePoints::sobol));
        frame_.write(0, sizeof(constants), &constants);
    }

    void append(graph::Graph& graph, const Shot& shot, const Band& where, RaySet& set) {
        if (shot.count == 0) return;
        graph.output(shot.rays);
        if (shot.list.list) {
            graph.output(shot.list.list);
            graph.output(shot.list.header);
        }
        graph::Executor executor(programs_);
        executor.run(graph::compile(graph));
        const auto base = static_cast<std::uint32_t>(set.rays.size());
        const std::vector<Ray> rays = executor.buffer(shot.rays).read<Ray>(0, shot.count);
        std::vector<std::uint32_t> order(rays.size());
        std::iota(order.begin(), order.end(), 0);
        if (shot.list.list) {
            set.listed = true;
            order = executor.buffer(shot.list.list)
                        .read<std::uint32_t>(
                            0, executor.buffer(shot.list.header).read<shared::ListHeader>(0, 1).front().count);
        }
        std::vector<std::uint32_t> scanline = order;
        if (shot.paths_are_pixels) {
            std::ranges::sort(scanline, {}, [tiles = where.tiles()](std::uint32_t path) {
                const uvec2 pixel = shared::pixel_of_path(path, tiles);
                return std::uint64_t{pixel.y} << 32 | pixel.x;
            });
        }
        set.rays.insert(set.rays.end(), rays.begin(), rays.end());
        for (const std::uint32_t path : order) set.order.push_back(base + path);
        for (const std::uint32_t path : scanline) set.scanline.push_back(base + path);
    }

    gpu::ProgramCache& programs_;
    const TraceTables& tables_;
    const rays::TraceScene& trace_;
    rays::Tracer tracer_{trace_};
    FrameSettings seen_;
    ivec2 size_;
    Band band_;
    SceneBuffers buffers_;
    gpu::Buffer frame_{"frame constants", sizeof(shared::Frame)};
};

// --- Kinds of one appearance
// ---------------------------------------------------------------------------------------------

RaySet primary_rays(Studio& studio) {
    return studio.shoot([](graph::Graph& graph, const SceneView& view) -> Shot {
        return {add_gbuffer(graph, view).rays, {}, view.band.paths()};
    });
}

RaySet shadow_rays(Studio& studio) {
    if (!studio.buffers().needs().lights()) return {};
    return studio.shoot([](graph::Graph& graph, const SceneView& view) -> Shot {
        add_shadow(graph, view, add_gbuffer(graph, view));
        return {named(graph, "shadow rays"), {}, view.band.paths()};
    });
}

template <class Add>
RaySet first_bounce(Studio& studio, Add add) {
    return studio.shoot([add](graph::Graph& graph, const SceneView& view) -> Shot {
        PathBuffers paths = create_path_buffers(graph, view);
        const PathList list = add(graph, view, add_gbuffer(graph, view), paths);
        return {paths.rays, list, view.band.paths()};
    });
}

RaySet second_bounce(Studio& studio) {
    const SceneNeeds& needs = studio.buffers().needs();
    if (!needs.diffuse && !needs.glossy) return {};
    return studio.shoot([&](graph::Graph& graph, const SceneView& view) -> Shot {
        const GBuffer gbuffer = add_gbuffer(graph, view);
        PathBuffers paths = create_path_buffers(graph, view);
        std::vector<PathList> batches;
        if (needs.diffuse) batches.push_back(add_diffuse(graph, view, gbuffer, paths));
        if (needs.glossy) batches.push_back(add_glossy(graph, view, gbuffer, paths));
        add_continuation(graph, view, batches, {.bounces = 2, .light_samples = needs.lights()}, paths);
        return {paths.rays,
                {named(graph, "continuation list"), named(graph, "continuation list header")},
                view.band.paths()};
    });
}

/// Returns connection rays of evenly spread blocks. The scene's materials must be purely diffuse.
RaySet connection_rays(Studio& studio, const ivec2& size) {
    const std::uint32_t across = (static_cast<std::uint32_t>(size.x) + 15) / 16;
    const std::uint32_t blocks = across * ((static_cast<std::uint32_t>(size.y) + 15) / 16);
    constexpr std::uint32_t kMost = kConnectionRays / kConnectionsPerBlock;
    const std::uint32_t stride = (blocks + kMost - 1) / kMost;
    std::uint32_t passed = 0;  // number of blocks in earlier bands
    return studio.shoot([&](graph::Graph& graph, const SceneView& view) -> Shot {
        const GBuffer g = add_gbuffer(graph, view);
        PathBuffers paths = create_path_buffers(graph, view);
        add_diffuse(graph, view, g, paths);
        const std::uint32_t in_band = view.band.paths() / 256;
        const std::uint32_t first = (stride - passed % stride) % stride;
        const std::uint32_t taken = first < in_band ? (in_band - first + stride - 1) / stride : 0;
        passed += in_band;
        const std::size_t count = std::size_t{taken} * kConnectionsPerBlock;
        graph::Pass pass = graph.add_pass("connections");
        pass.read(g.surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
        pass.read(paths.rays, Access::storage_read, "PathRays");
        pass.read(paths.hits, Access::storage_read, "Hits");
        pass.read(paths.states, Access::storage_read, "States");
        const graph::BufferHandle connections =
            pass.write(graph.create_buffer("connections", {count * sizeof(Ray)}), Access::storage_write, "Connections");
        pass.execute([=](graph::Resources& r) {
            view.scene.bind();
            const gpu::Program& program = r.kernel({"shaders/connection.comp", view.scene.defines()});
            program.set("first_block", first);
            program.set("block_stride", stride);
            program.dispatch(taken * kConnectionsPerBlock / 64);
        });
        return {connections, {}, count, false};
    });
}

struct Kind {
    const char* name;
    rays::RayKind ray_kind;
    bool any_hit;
    bool coherent;
};
constexpr std::array<Kind, 9> kKinds{{{"primary", rays::RayKind::primary, false, true},
                                      {"hard", rays::RayKind::shadow, true, true},
                                      {"soft", rays::RayKind::shadow, true, true},
                                      {"glossy", rays::RayKind::glossy, false, false},
                                      {"diffuse", rays::RayKind::diffuse, false, false},
                                      {"ao", rays::RayKind::occlusion, true, false},
                                      {"connection", rays::RayKind::connection, true, false},
                                      {"bounce2", rays::RayKind::continuation, false, false},
                                      {"mixed", rays::RayKind::shadow, true, false}}};

void complete(RaySet& set, const Kind& kind, float diagonal) {
    set.kind = kind.name;
    set.ray_kind = kind.ray_kind;
    set.any_hit = kind.any_hit;
    set.coherent = kind.coherent;
    set.tolerance = diagonal * 0x1p-20f;
    set.live = static_cast<std::size_t>(std::ranges::count_if(
        set.order, [&](std::uint32_t path) { return set.rays[path].t_max >= set.rays[path].t_min; }));
}

}  // namespace

const std::vector<std::string>& ray_kinds() {
    static const std::vector<std::string> names = names_of(kKinds);
    return names;
}

std::vector<RaySet> capture(const gpu::Context& context, gpu::ProgramCache& programs, Scene& scene,
                            const TraceTables& tables, const rays::TraceScene& trace, const Camera& camera,
                            const ivec2& size, const std::vector<std::string>& kinds) {
    const float diagonal = glm::length(tables.bounds.extent());
    const dvec3 above = dvec3(camera.camera_to_world[3]) + dvec3(0, 0.05 * diagonal, 0);
    const Appearance original = appearance_of(scene);
    const auto wanted = [&](const char* kind) { return std::ranges::find(kinds, kind) != kinds.end(); };
    std::vector<RaySet> sets(kKinds.size());
    const auto with_appearance = [&](const Appearance& appearance, const TraceTables& t, const rays::TraceScene& s,
                                     const auto& shoot) {
        set_appearance(scene, appearance);
        Studio studio(context, programs, scene, t, s, camera, size);
        shoot(studio);
        set_appearance(scene, original);
    };

    if (wanted("primary") || wanted("bounce2") || wanted("mixed")) {
        with_appearance(original, tables, trace, [&](Studio& studio) {
            if (wanted("primary")) sets[0] = primary_rays(studio);
            if (wanted("bounce2")) sets[7] = second_bounce(studio);
            if (wanted("mixed")) sets[8] = shadow_rays(studio);
        });
    }
    if (wanted("hard")) {
        with_appearance(lit_by_one_point(scene, above), tables, trace,
                        [&](Studio& studio) { sets[1] = shadow_rays(studio); });
    }
    if (wanted("soft")) {
        const auto shoot = [&](Studio& studio) { sets[2] = shadow_rays(studio); };
        if (std::ranges::any_of(scene.materials, has_emission)) {
            with_appearance(lit_by_areas(scene), tables, trace, shoot);
        } else {
            add_square(scene, above, 0.05 * diagonal);
            const TraceTables with_square = build_trace_tables(scene, kFlattenLimit);
            with_appearance(lit_by_areas(scene), with_square, rays::TraceScene(with_square), shoot);
            remove_square(scene);
        }
    }
    if (wanted("glossy")) {
        with_appearance(made_of_metal(scene), tables, trace,
                        [&](Studio& studio) { sets[3] = first_bounce(studio, add_glossy); });
    }
    if (wanted("diffuse") || wanted("ao") || wanted("connection")) {
        with_appearance(made_diffuse(scene), tables, trace, [&](Studio& studio) {
            if (wanted("diffuse") || wanted("ao")) sets[4] = first_bounce(studio, add_diffuse);
            if (wanted("connection")) sets[6] = connection_rays(studio, size);
        });
        sets[5] = sets[4];
        for (const std::uint32_t path : sets[5].order) sets[5].rays[path].t_max = 0.05f * diagonal;
    }
    for (std::size_t k = 0; k < sets.size(); ++k) complete(sets[k], kKinds[k], diagonal);
    std::erase_if(sets, [&](const RaySet& set) { return !wanted(set.kind.c_str()); });
    return sets;
}

}  // namespace halflight::bench
