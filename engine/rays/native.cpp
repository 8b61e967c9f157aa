#include "engine/rays/native.h"

#include <epoxy/gl.h>
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/gpu/mapping.h"
#include "engine/graph/execute.h"
#include "engine/rays/native_trace.h"
#include "shaders/shared/ray_structs.h"

namespace halflight::rays {
namespace {

using gpu::Mapping;

constexpr std::size_t kGrain = 1024;     // entries of a task: sixteen tiles
constexpr std::size_t kCompared = 4096;  // most rays of a batch that the plain kernel traces, too
// The comparison of closest or any hits ends after so many hits, or so many rays if hits are rare.
constexpr std::size_t kComparedHits = 1024, kComparedRays = 65536;

std::size_t result_bytes(bool any_hit) {
    return any_hit ? sizeof(std::uint32_t) : sizeof(shared::Hit);
}

/// Traces listed paths of a batch by the plain kernel, in a pass that has declared the batch.
void trace_paths(graph::Resources& r, const TraceScene& scene, const RayBatch& batch,
                 const std::vector<std::uint32_t>& paths, const gpu::Buffer& results, bool any_hit) {
    const graph::Kernel kernel = plain_kernel(scene, batch, any_hit, true);
    const gpu::Program& program = r.programs().compute(kernel.source, kernel.defines);
    kernel.bind(r, program);
    const auto count = static_cast<std::uint32_t>(paths.size());
    const shared::ListHeader head{(count + 63) / 64, 1, 1, count};
    const gpu::Buffer list = gpu::Buffer::from("list of rays", paths), header("header", sizeof(head), &head);
    program.bind_storage("List", list);
    program.bind_storage("Header", header);
    program.bind_storage(any_hit ? "Occluded" : "Hits", results);
    program.dispatch(head.groups_x);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

}  // namespace

int native_threads() {
    const int most = tbb::this_task_arena::max_concurrency();
    const char* const text = std::getenv("LP_NUM_THREADS");
    if (text == nullptr) return most;
    int asked = 0;
    const auto [end, error] = std::from_chars(text, text + std::strlen(text), asked);
    return error == std::errc() && *end == '\0' ? std::clamp(asked, 1, most) : most;
}

/// Times of the tasks of similar batches. They select the faster of two methods: rays in turns, or 64 together.
class Pace {
  public:
    /// Returns whether a task of the next run traces rays together. The slower method gets a task now and then, so that
    /// its time stays up to date.
    bool together(std::size_t task) const {
        const std::size_t turn = task + 7 * runs_;
        if (per_ray_[0] == 0 || per_ray_[1] == 0) return turn % 2 == 1;
        const bool faster = per_ray_[1] < per_ray_[0];
        const double ratio = per_ray_[faster ? 0 : 1] / per_ray_[faster ? 1 : 0];
        const std::size_t period = ratio > 1.5 ? 256 : 32;
        return turn % period == 0 ? !faster : faster;
    }
    struct Task {
        bool together = false;
        double seconds = 0;
        std::size_t rays = 0;
    };
    /// Records the end of a run.
    void ran(const std::vector<Task>& tasks) {
        for (const bool together : {false, true}) {
            std::vector<double> times;  // seconds per ray of the tasks
            for (const Task& task : tasks) {
                if (task.together != together) continue;
                BatchStatistics::NativeTasks& sum = sums_[together ? 1 : 0];
                sum.rays += static_cast<double>(task.rays), sum.seconds += task.seconds;
                times.push_back(task.seconds / static_cast<double>(task.rays));
            }
            if (times.empty()) continue;
            // The median leaves out tasks that other programs have interrupted.
            const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
            std::nth_element(times.begin(), middle, times.end());
            double& mean = per_ray_[together ? 1 : 0];
            mean = mean == 0 ? *middle : 0.7 * mean + 0.3 * *middle;
        }
        ++runs_;
    }

    const BatchStatistics::NativeTasks& sum(bool together) const { return sums_[together ? 1 : 0]; }
    void reset_statistics() { sums_[0] = sums_[1] = {}; }

  private:
    BatchStatistics::NativeTasks sums_[2];
    double per_ray_[2] = {0, 0};  // seconds per ray in turns and together; 0: unknown
    std::size_t runs_ = 0;
};

struct NativeServer::Parts {
    NativeTree tree;
    bool slivers = false, alpha_tested = false;
    Counts counts;
    std::map<std::pair<BatchKey, bool>, Pace> paces;          // by key and any_hit
    std::map<BatchKey, std::vector<std::uint32_t>> blockers;  // NativeJob::blockers, of any hits
    struct Compared {
        std::size_t rays = 0, hits = 0;
        bool enough() const { return hits >= kComparedHits || rays >= kComparedRays; }
    } compared[2];  // closest and any hits
    tbb::task_arena arena{native_threads()};

    void take(const TraceTables& tables, const TraceScene& scene) {
        const TraceStatistics& s = scene.statistics();
        // Each combination of node format, instances and slivers has code of its own.
        if (s.node_format != tree.format || s.two_level != tree.two_level || tables.slivers != slivers)
            compared[0] = compared[1] = {};
        tree = build_native_tree(tables, s.node_format, s.two_level, scene.nodes().read<uvec4>(),
                                 scene.heads().read<std::uint32_t>());
        slivers = tables.slivers, alpha_tested = tables.alpha_tested;
    }

    /// Traces the batch; returns the paths that are left to the plain kernel.
    std::vector<std::uint32_t> trace(graph::Resources& r, const TraceScene& scene, const RayBatch& batch,
                                     const gpu::Buffer& results, bool any_hit) {
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        std::size_t count = batch.capacity;
        if (batch.list) {
            const Mapping header(r.buffer(batch.list_header), Mapping::Access::read);
            count = std::min<std::size_t>(count, header.as<shared::ListHeader>()->count);
        }
        counts.rays += count;
        if (count == 0) return {};
        const Mapping rays(r.buffer(batch.rays), Mapping::Access::read), pairs(scene.pairs(), Mapping::Access::read);
        std::optional<Mapping> list;
        if (batch.list) list.emplace(r.buffer(batch.list), Mapping::Access::read);
        const Mapping to(results, Mapping::Access::write);
        std::uint32_t* kept = nullptr;
        if (any_hit) {
            std::vector<std::uint32_t>& leaves = blockers[key_of(batch)];
            leaves.resize(blockers_of(batch.capacity), std::numeric_limits<std::uint32_t>::max());
            kept = leaves.data();
        }
        const NativeJob job{.tree = &tree,
                            .pairs = pairs.as<vec4>(),
                            .alpha_tested = alpha_tested,
                            .slivers = slivers,
                            .backfaces = scene.one_sided() ? static_cast<int>(batch.backfaces) : 0,
                            .passes_panes = batch.passes_panes,
                            .any_hit = any_hit,
                            .rays = rays.as<shared::Ray>(),
                            .list = list ? list->as<std::uint32_t>() : nullptr,
                            .blockers = kept,
                            .results = to.as<void>()};
        const std::size_t tasks = (count + kGrain - 1) / kGrain;
        std::vector<std::vector<std::uint32_t>> left(tasks);
        Pace& pace = paces[{key_of(batch), any_hit}];
        std::vector<Pace::Task> times(tasks);
        const auto work = [&](const tbb::blocked_range<std::size_t>& range) {
            for (std::size_t i = range.begin(); i != range.end(); ++i) {
                using Clock = std::chrono::steady_clock;
                const Clock::time_point start = Clock::now();
                const std::size_t end = std::min(count, (i + 1) * kGrain);
                NativeJob task = job;
                task.together = pace.together(i);
                trace_native(task, i * kGrain, end, left[i]);
                times[i] = {task.together, std::chrono::duration<double>(Clock::now() - start).count(),
                            end - i * kGrain};
            }
        };
        arena.execute([&] { tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks), work); });
        pace.ran(times);
        std::vector<std::uint32_t> all;
        for (const auto& some : left) all.insert(all.end(), some.begin(), some.end());
        counts.delegated += all.size();
        return all;
    }

    /// Traces rays of the batch by the plain kernel, too, and compares the bits. Returns the number of differences.
    /// Leaves out dead rays and those in `left`, sorted, which the plain kernel has traced.
    std::size_t compare(graph::Resources& r, const TraceScene& scene, const RayBatch& batch, const gpu::Buffer& results,
                        bool any_hit, const std::vector<std::uint32_t>& left) {
        std::vector<std::uint32_t> paths(batch.capacity);
        if (batch.list) {
            const std::size_t count = r.buffer(batch.list_header).read<shared::ListHeader>().front().count;
            paths = r.buffer(batch.list).read<std::uint32_t>(0, std::min<std::size_t>(count, batch.capacity));
        } else {
            std::iota(paths.begin(), paths.end(), 0u);
        }
        {
            const Mapping rays(r.buffer(batch.rays), Mapping::Access::read);
            std::erase_if(paths, [&](std::uint32_t path) {
                const shared::Ray& ray = rays.as<shared::Ray>()[path];
                return ray.t_max < ray.t_min || std::ranges::binary_search(left, path);
            });
        }
        const std::size_t step = std::max<std::size_t>(paths.size() / kCompared, 1);
        std::vector<std::uint32_t> some;
        for (std::size_t i = 0; i < paths.size(); i += step) some.push_back(paths[i]);
        if (some.empty()) return 0;
        const std::size_t bytes = result_bytes(any_hit);
        const gpu::Buffer plain("hits of the plain kernel", batch.capacity * bytes);
        trace_paths(r, scene, batch, some, plain, any_hit);
        const Mapping a(results, Mapping::Access::read), b(plain, Mapping::Access::read);
        Compared& all = compared[any_hit ? 1 : 0];
        all.rays += some.size();
        std::size_t differences = 0;
        for (const std::uint32_t path : some) {
            differences += std::memcmp(a.as<char>() + path * bytes, b.as<char>() + path * bytes, bytes) != 0;
            all.hits += any_hit ? b.as<std::uint32_t>()[path] != shared::kFree
                                : b.as<shared::Hit>()[path].triangle != shared::kMiss;
        }
        return differences;
    }
};

std::string NativeServer::reason_against(const TraceScene& scene) {
    if (!gpu::renders_on_processor()) return "the renderer is not the processor";
    if (!can_trace_natively()) return "the processor has no vectors of eight floats";
    if (scene.paged()) return "the scene is loaded in pages";
    return "";
}

NativeServer::NativeServer(const TraceTables& tables, const TraceScene& scene) {
    if (const std::string reason = reason_against(scene); !reason.empty())
        throw Error("render settings", "no native tracing: {}", reason);
    parts_ = std::make_unique<Parts>();
    parts_->take(tables, scene);
}
NativeServer::~NativeServer() = default;

void NativeServer::follow(const ServedScene& scene) {
    parts_->take(scene.tables, scene.trace);
}

void NativeServer::invalidate() {
    parts_->blockers.clear();
}

std::size_t NativeServer::state_bytes(const RayBatch& batch) const {
    return blockers_of(batch.capacity) * sizeof(std::uint32_t);  // closest hits have none
}

void NativeServer::reset_statistics() {
    for (auto& [key, pace] : parts_->paces) pace.reset_statistics();
}

void NativeServer::add_tasks(const BatchKey& key, BatchStatistics& to) const {
    for (const bool any_hit : {false, true}) {
        const auto found = parts_->paces.find({key, any_hit});
        if (found == parts_->paces.end()) continue;
        BatchStatistics tasks;
        tasks.native_alone = found->second.sum(false), tasks.native_together = found->second.sum(true);
        rays::add(to, tasks);
    }
}

const NativeServer::Counts& NativeServer::counts() const {
    return parts_->counts;
}

std::size_t NativeServer::bytes() const {
    return parts_->tree.bytes();
}

graph::BufferHandle NativeServer::add(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                                      graph::BufferHandle results, bool any_hit) {
    graph::Pass pass =
        graph.add_pass(fmt::format("{} rays: {}, native", name(batch.kind), any_hit ? "any hit" : "closest hit"));
    read_batch(pass, scene, batch);
    results = write_results(pass, batch, results);
    if (!parts_->compared[any_hit ? 1 : 0].enough()) pass.kernel(plain_kernel(scene, batch, any_hit, true));
    pass.execute([=, this, &scene](graph::Resources& r) { trace(r, scene, batch, results, any_hit); });
    return results;
}

void NativeServer::trace(graph::Resources& r, const TraceScene& scene, const RayBatch& batch,
                         graph::BufferHandle results, bool any_hit) {
    interruption_point();  // a driver on the processor has finished the passes before
    Parts& parts = *parts_;
    if (parts.counts.disabled) return trace_plain(r, scene, batch, results, any_hit);
    const gpu::Buffer& to = r.buffer(results);
    std::vector<std::uint32_t> left = parts.trace(r, scene, batch, to, any_hit);
    if (!left.empty()) trace_paths(r, scene, batch, left, to, any_hit);
    if (parts.compared[any_hit ? 1 : 0].enough()) return;
    std::ranges::sort(left);
    const std::size_t differ = parts.compare(r, scene, batch, to, any_hit, left);
    if (differ == 0) return;
    parts.counts.disabled = true;
    parts.counts.note = fmt::format("native tracing is off: {} hits differ from the plain kernel's", differ);
    trace_plain(r, scene, batch, results, any_hit);
}

std::unique_ptr<BatchServer> make_native_server(const ServedScene& scene) {
    return std::make_unique<NativeServer>(scene.tables, scene.trace);
}

std::unique_ptr<NativeServer> offered_native_server(const ServedScene& scene) {
    if (!NativeServer::reason_against(scene.trace).empty()) return nullptr;
    return std::make_unique<NativeServer>(scene.tables, scene.trace);
}

}  // namespace halflight::rays
