#include "engine/device/deform.h"

#include <algorithm>
#include <iterator>
#include <limits>

namespace halflight {
namespace {

constexpr std::size_t kGroup = 64;  // vertices per work group of deform.comp

struct TargetTexel {
    std::uint32_t slot;
    float weight;
};

template <class T>
std::span<const T> part_of(const std::vector<T>& values, std::size_t first, std::size_t count) {
    return values.empty() ? std::span<const T>() : std::span(values).subspan(first, count);
}

}  // namespace

/// A range of a shape's vertices.
struct GpuDeformer::Piece {
    std::size_t first;
    std::size_t count;
    gpu::Buffer positions;
    gpu::Buffer normals;
    gpu::Buffer tangents;
    gpu::Buffer joints;  // joint indices, set after set, like `weights`
    gpu::Buffer weights;
    gpu::Buffer deltas;  // displacements, slot after slot
};

struct GpuDeformer::Resident {
    struct Target {
        int positions = -1, normals = -1, tangents = -1;  // slots in Piece::deltas; -1: none
        bool uploaded = false;
    };
    bool has_normals = false;
    bool has_tangents = false;
    std::size_t sets = 0;
    std::vector<Target> targets;
    std::vector<Piece> pieces;  // all vertices in pieces; empty: deformed on the CPU

    std::size_t result_bytes() const {  // Returns the bytes per vertex.
        return sizeof(vec3) + (has_normals ? sizeof(vec3) : 0) + (has_tangents ? sizeof(vec4) : 0);
    }
};

struct GpuDeformer::Job {
    const Deformation& deformation;
    const Resident* shape;  // shape on the device; null: deformed on the CPU
    int first_matrix;
    ivec4 targets;             // value of active_targets in deform.comp
    std::size_t first_result;  // index of the first result of the shape's pieces
};

GpuDeformer::GpuDeformer(const gpu::Context& context, const gpu::Limits& limits)
    : context_(context),
      limits_(limits),
      programs_(context.binaries()),
      matrices_("joint matrices", 0),
      targets_("active targets", 0) {
    constexpr std::size_t kMostTexels = std::numeric_limits<int>::max();  // GLSL counts texels in int
    limits_.texture_buffer_texels = std::min(limits_.texture_buffer_texels, kMostTexels);
}

GpuDeformer::~GpuDeformer() = default;

std::size_t GpuDeformer::bytes() const {
    std::size_t sum = matrices_.bytes() + targets_.bytes();
    for (const gpu::Buffer& b : results_) sum += b.bytes();
    for (const auto& [shape, resident] : shapes_)
        for (const Piece& p : resident->pieces)
            for (const gpu::Buffer* b : {&p.positions, &p.normals, &p.tangents, &p.joints, &p.weights, &p.deltas})
                sum += b->bytes();
    return sum;
}

GpuDeformer::Resident& GpuDeformer::resident(const std::shared_ptr<const RestShape>& shape) {
    if (const auto known = shapes_.find(shape); known != shapes_.end()) return *known->second;
    const VertexArrays vertices = shape->read();
    const std::vector<JointSet> sets = shape->read_joints();
    auto made = std::make_unique<Resident>();
    made->has_normals = !vertices.normals.empty();
    made->has_tangents = !vertices.tangents.empty();
    made->sets = sets.size();
    int slots = 0;
    for (std::size_t i = 0; i < shape->targets(); ++i) {
        const RestShape::Moved moved = shape->moved_by(i);
        const auto slot = [&](bool wanted) { return wanted ? slots++ : -1; };
        made->targets.push_back({slot(moved.positions), slot(moved.normals), slot(moved.tangents)});
    }

    const std::size_t texels = std::max({std::size_t{1}, sets.size(), static_cast<std::size_t>(slots)});
    const std::size_t most =
        std::min({limits_.texture_buffer_texels / texels, limits_.storage_block_bytes / made->result_bytes(),
                  static_cast<std::size_t>(limits_.workgroup_count) * kGroup});
    for (std::size_t first = 0; most > 0 && first < shape->vertices(); first += most) {
        const std::size_t count = std::min(most, shape->vertices() - first);
        std::vector<uvec4> joints;
        std::vector<vec4> weights;
        for (const JointSet& set : sets) {
            const auto which = part_of(set.joints, first, count);
            const auto how_much = part_of(set.weights, first, count);
            joints.insert(joints.end(), which.begin(), which.end());
            weights.insert(weights.end(), how_much.begin(), how_much.end());
        }
        made->pieces.push_back({first, count,
                                gpu::Buffer::from("rest positions", part_of(vertices.positions, first, count)),
                                gpu::Buffer::from("rest normals", part_of(vertices.normals, first, count)),
                                gpu::Buffer::from("rest tangents", part_of(vertices.tangents, first, count)),
                                gpu::Buffer::from("joints", joints), gpu::Buffer::from("joint weights", weights),
                                gpu::Buffer("morph targets", static_cast<std::size_t>(slots) * count * sizeof(vec3))});
    }
    return *shapes_.emplace(shape, std::move(made)).first->second;
}

void GpuDeformer::upload_targets(Resident& shape, const Deformation& deformation) {
    for (const ActiveTarget& active : deformation.targets) {
        Resident::Target& target = shape.targets[active.target];
        if (target.uploaded) continue;
        const MorphTarget deltas = deformation.rest->read_target(active.target);
        for (Piece& piece : shape.pieces) {
            const auto write = [&](int slot, const std::vector<vec3>& values) {
                if (slot >= 0)
                    piece.deltas.write(part_of(values, piece.first, piece.count),
                                       static_cast<std::size_t>(slot) * piece.count);
            };
            write(target.positions, deltas.positions);
            write(target.normals, deltas.normals);
            write(target.tangents, deltas.tangents);
        }
        target.uploaded = true;
    }
}

std::vector<VertexArrays> GpuDeformer::deform(std::span<const Deformation> deformations) {
    std::vector<VertexArrays> moved;
    const gpu::KeepCurrent keep;
    try {
        context_.make_current();
    } catch (const Error&) {  // another thread uses the context
        for (const Deformation& d : deformations) {
            moved.push_back(halflight::deform(d));
            statistics_.vertices += moved.back().positions.size();
            statistics_.vertices_on_cpu += moved.back().positions.size();
        }
        return moved;
    }
    while (!deformations.empty()) {
        const std::size_t count = first_batch(deformations);
        std::ranges::move(deform_batch(deformations.first(count)), std::back_inserter(moved));
        deformations = deformations.subspan(count);
    }
    return moved;
}

/// Returns how many deformations fit into the tables together. One that exceeds them is a batch by itself.
std::size_t GpuDeformer::first_batch(std::span<const Deformation> deformations) const {
    std::size_t joints = 0, targets = 0, count = 0;
    for (const Deformation& d : deformations) {
        joints += d.joints.size(), targets += 3 * d.targets.size();
        if (count > 0 && !fit(joints, targets)) break;
        ++count;
    }
    return count;
}

bool GpuDeformer::fit(std::size_t joints, std::size_t targets) const {
    return joints * shared::kJointTexels <= limits_.texture_buffer_texels && targets <= limits_.texture_buffer_texels;
}

std::vector<VertexArrays> GpuDeformer::deform_batch(std::span<const Deformation> deformations) {
    const gpu::Stopwatch watch;
    std::vector<Job> jobs;
    std::vector<shared::JointMatrix> matrices;
    std::vector<TargetTexel> targets;
    std::size_t pieces = 0, most_targets = 0;
    for (const Deformation& d : deformations) {
        Resident& shape = resident(d.rest);
        if (!shape.pieces.empty()) most_targets += 3 * shape.targets.size();
        const std::vector<shared::JointMatrix> own = joint_matrices(d.joints);
        if (shape.pieces.empty() || !fit(own.size(), 3 * d.targets.size())) {
            jobs.push_back({d, nullptr, 0, {}, 0});
            continue;
        }
        upload_targets(shape, d);
        const auto add_targets = [&](int Resident::Target::*slot) {
            const auto first = static_cast<int>(targets.size());
            for (const ActiveTarget& active : d.targets) {
                const int place = shape.targets[active.target].*slot;
                if (place >= 0) targets.push_back({static_cast<std::uint32_t>(place), active.weight});
            }
            return first;
        };
        const int positions = add_targets(&Resident::Target::positions);
        const int normals = add_targets(&Resident::Target::normals);
        const int tangents = add_targets(&Resident::Target::tangents);
        jobs.push_back({d, &shape, static_cast<int>(matrices.size()),
                        ivec4(positions, normals, tangents, static_cast<int>(targets.size())), pieces});
        matrices.insert(matrices.end(), own.begin(), own.end());
        pieces += shape.pieces.size();
    }
    // The buffer's size does not depend on the active targets, because Mesa recompiles for another size.
    targets.resize(std::min(std::max(targets.size(), most_targets), limits_.texture_buffer_texels));
    gpu::replace(matrices_, matrices);
    gpu::replace(targets_, targets);
    for (const Job& job : jobs)
        if (job.shape) start(job);

    std::vector<VertexArrays> moved;
    for (const Job& job : jobs) {
        moved.push_back(job.shape ? read(job) : halflight::deform(job.deformation));
        statistics_.vertices += moved.back().positions.size();
        if (!job.shape) statistics_.vertices_on_cpu += moved.back().positions.size();
    }
    statistics_.seconds += watch.seconds();
    return moved;
}

void GpuDeformer::start(const Job& job) {
    const Resident& shape = *job.shape;
    gpu::Defines defines;
    if (shape.has_normals) defines.set("HALFLIGHT_NORMALS");
    if (shape.has_tangents) defines.set("HALFLIGHT_TANGENTS");
    if (!job.deformation.joints.empty()) defines.set("HALFLIGHT_JOINTS");
    const gpu::Program& program = programs_.compute("shaders/deform.comp", defines);
    program.set("sets", static_cast<int>(shape.sets));
    program.set("first_matrix", job.first_matrix);
    program.set("active_targets", job.targets);
    for (std::size_t i = 0; i < shape.pieces.size(); ++i) {
        const Piece& piece = shape.pieces[i];
        const std::size_t place = job.first_result + i, bytes = piece.count * shape.result_bytes();
        if (place == results_.size()) results_.emplace_back("deformed vertices", bytes);
        if (results_[place].bytes() != bytes) results_[place] = gpu::Buffer("deformed vertices", bytes);
        program.bind_texture("positions", piece.positions, GL_RGB32F);
        program.bind_texture("normals", piece.normals, GL_RGB32F);
        program.bind_texture("tangents", piece.tangents, GL_RGBA32F);
        program.bind_texture("joints", piece.joints, GL_RGBA32UI);
        program.bind_texture("weights", piece.weights, GL_RGBA32F);
        program.bind_texture("deltas", piece.deltas, GL_RGB32F);
        program.bind_texture("targets", targets_, GL_RG32UI);
        program.bind_texture("matrices", matrices_, GL_RGBA32UI);
        program.bind_storage("Moved", results_[place]);
        program.set("vertices", static_cast<int>(piece.count));
        program.dispatch(static_cast<std::uint32_t>((piece.count + kGroup - 1) / kGroup));
    }
}

VertexArrays GpuDeformer::read(const Job& job) const {
    const Resident& shape = *job.shape;
    const std::size_t vertices = job.deformation.rest->vertices();
    VertexArrays moved;
    moved.positions.resize(vertices);
    if (shape.has_normals) moved.normals.resize(vertices);
    if (shape.has_tangents) moved.tangents.resize(vertices);
    for (std::size_t i = 0; i < shape.pieces.size(); ++i) {
        const Piece& piece = shape.pieces[i];
        std::size_t offset = 0;
        const auto take = [&](auto& values) {
            if (values.empty()) return;
            const std::size_t bytes = piece.count * sizeof(values[0]);
            results_[job.first_result + i].read_bytes(offset, bytes, &values[piece.first]);
            offset += bytes;
        };
        take(moved.positions);
        take(moved.normals);
        take(moved.tangents);
    }
    return moved;
}

}  // namespace halflight
