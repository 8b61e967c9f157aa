#include "tools/scenes/assembly.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <memory>

#include "engine/core/error.h"
#include "engine/io/files.h"

namespace halflight::scenes {
namespace {

constexpr std::uint64_t kFileLimit = 0xFFFFFFFFULL;  // largest value of a .glb's length field
// JSON takes about 250 bytes for each accessor with its view, three for each of at most 32 materials.
constexpr std::uint64_t kGroupJson = 250 * 3 * 32, kFixedJson = 1 << 16;

/// A part of a model in float32, before it is moved to its place.
struct FlatPart {
    std::vector<vec3> positions, normals;
    std::vector<std::uint32_t> indices;
    Bounds bounds;
};
using FlatModel = std::vector<FlatPart>;  // by material; a model lacks most materials

/// The rotation of a placement. Signed permutations are exact, also for the signs of zeros.
class Turn {
  public:
    explicit Turn(const mat3& matrix) : matrix_(matrix) {
        for (int row = 0; row < 3; ++row)
            for (int axis = 0; axis < 3; ++axis) {
                const float value = matrix[axis][row];
                if (std::abs(value) == 1) axis_[row] = axis, sign_[row] = value;
                square_ = square_ && (value == 0 || std::abs(value) == 1);
            }
    }
    /// Returns whether the rotation maps boxes to boxes.
    bool square() const { return square_; }
    vec3 operator()(const vec3& v) const {
        return square_ ? sign_ * vec3(v[axis_.x], v[axis_.y], v[axis_.z]) : matrix_ * v;
    }

  private:
    mat3 matrix_;
    ivec3 axis_{0};
    vec3 sign_{1};
    bool square_ = true;
};

/// Models that are in memory: each from its first use to its last one.
class Store {
  public:
    Store(const Assembly& assembly, std::vector<Placed> places)
        : assembly_(assembly), places_(std::move(places)), last_(assembly.models.size()), flat_(last_.size()) {
        for (std::size_t i = 0; i < places_.size(); ++i) last_[places_[i].model] = i;
    }
    const std::vector<Placed>& places() const { return places_; }

    /// Starts to write the placements from number `begin` on; what only earlier ones use is dropped.
    void enter(std::size_t begin) {
        if (begin == begin_) return;
        begin_ = begin;
        for (std::size_t i = 0; i < flat_.size(); ++i)
            if (last_[i] < begin) flat_[i].reset();
    }
    const FlatModel& get(std::uint32_t model) {
        std::unique_ptr<FlatModel>& slot = flat_[model];
        if (!slot) slot = std::make_unique<FlatModel>(flat(assembly_.models[model].make()));
        return *slot;
    }

  private:
    FlatModel flat(const Mesh& mesh) const {
        FlatModel result(assembly_.materials.size());
        for (const Part& part : mesh.parts) {
            FlatPart& target = result[static_cast<std::size_t>(part.material)];
            target.positions.reserve(part.vertices.size()), target.normals.reserve(part.vertices.size());
            for (const Vertex& v : part.vertices) {
                target.positions.emplace_back(v.position);
                target.normals.emplace_back(v.normal);
                target.bounds.add(target.positions.back());
            }
            target.indices = part.indices;
        }
        return result;
    }

    const Assembly& assembly_;
    std::vector<Placed> places_;
    std::vector<std::size_t> last_;  // number of the last placement of each model
    std::vector<std::unique_ptr<FlatModel>> flat_;
    std::size_t begin_ = 0;
};

/// Sizes of the geometry that placements have of one material.
struct Share {
    std::uint64_t vertices = 0, indices = 0;
    Bounds bounds;
};

/// Placements [begin, end) that are written as one mesh.
struct Group {
    std::size_t begin = 0, end = 0;
    std::uint64_t triangles = 0, bytes = kGroupJson;
    std::vector<Share> shares;  // by material
    Bounds bounds;
};

Bounds placed_bounds(const FlatPart& part, const Placed& place) {
    const Turn turn(place.turn);
    Bounds bounds;
    if (turn.square()) {  // placing is monotonic in each coordinate, also after rounding
        bounds.add(turn(part.bounds.lower) + place.at), bounds.add(turn(part.bounds.upper) + place.at);
    } else {
        for (const vec3& v : part.positions) bounds.add(turn(v) + place.at);
    }
    return bounds;
}

/// Splits the placements into groups of at least `target` triangles each, but for the last one.
std::vector<Group> make_groups(Store& store, std::size_t materials, std::uint64_t target) {
    std::vector<Group> result;
    for (std::size_t i = 0; i < store.places().size(); ++i) {
        if (result.empty() || result.back().triangles >= target) {
            result.push_back({.begin = i, .shares = std::vector<Share>(materials), .bounds = {}});
            store.enter(i);
        }
        Group& group = result.back();
        group.end = i + 1;
        const Placed& place = store.places()[i];
        const FlatModel& model = store.get(place.model);
        for (std::size_t material = 0; material < materials; ++material) {
            const FlatPart& part = model[material];
            if (part.indices.empty()) continue;
            Share& share = group.shares[material];
            share.vertices += part.positions.size(), share.indices += part.indices.size();
            share.bounds.add(placed_bounds(part, place));
            group.triangles += part.indices.size() / 3;
            group.bytes += 24 * part.positions.size() + 4 * part.indices.size();
            group.bounds.add(share.bounds);
        }
    }
    return result;
}

/// Adds one mesh for a group, with one part per material, and returns its index. Its bytes are made when the file is
/// written.
int add_mesh(Document& document, const std::shared_ptr<Store>& store, const Group& group, const std::string& name) {
    std::vector<Document::StreamedPart> parts;
    for (std::size_t material = 0; material < group.shares.size(); ++material) {
        const Share& share = group.shares[material];
        if (share.indices == 0) continue;
        const auto each = [store, begin = group.begin, end = group.end, material](auto&& visit) {
            store->enter(begin);
            for (std::size_t i = begin; i < end; ++i) {
                const Placed& place = store->places()[i];
                const FlatPart& part = store->get(place.model)[material];
                if (!part.indices.empty()) visit(part, place);
            }
        };
        const auto vectors = [each](CheckedFile& file, std::vector<vec3> FlatPart::*values, bool moves) {
            std::vector<vec3> moved;
            each([&](const FlatPart& part, const Placed& place) {
                const Turn turn(place.turn);
                moved.clear();
                for (const vec3& v : part.*values) moved.push_back(moves ? turn(v) + place.at : turn(v));
                file.write(moved.data(), moved.size() * sizeof(vec3));
            });
        };
        Document::StreamedPart part;
        part.material = static_cast<int>(material);
        part.vertices = share.vertices, part.indices = share.indices;
        part.lower = share.bounds.lower, part.upper = share.bounds.upper;
        part.write_positions = [vectors](CheckedFile& file) { vectors(file, &FlatPart::positions, true); };
        part.write_normals = [vectors](CheckedFile& file) { vectors(file, &FlatPart::normals, false); };
        part.write_indices = [each](CheckedFile& file) {
            std::vector<std::uint32_t> moved;
            std::uint32_t base = 0;
            each([&](const FlatPart& flat, const Placed&) {
                moved.clear();
                for (const std::uint32_t index : flat.indices) moved.push_back(index + base);
                file.write(moved.data(), moved.size() * sizeof(std::uint32_t));
                base += static_cast<std::uint32_t>(flat.positions.size());
            });
        };
        parts.push_back(std::move(part));
    }
    return document.mesh(name, std::move(parts));
}

Document start(const Assembly& assembly) {
    Document document(assembly.name);
    for (const Material& material : assembly.materials) document.material(material);
    return document;
}

nlohmann::ordered_json triple(const vec3& v) {
    return nlohmann::ordered_json::array({v.x, v.y, v.z});
}

std::uint64_t write_parts(const std::filesystem::path& path, const Assembly& assembly,
                          const std::shared_ptr<Store>& store, const std::vector<Group>& groups,
                          std::uint64_t part_bytes, const Bounds& whole) {
    nlohmann::ordered_json index{{"triangles", 0}, {"parts", nlohmann::ordered_json::array()}};
    std::uint64_t total = 0;
    for (std::size_t next = 0; next < groups.size();) {
        const std::size_t number = index["parts"].size();
        Document document = start(assembly);
        if (number == 0) assembly.add_views(document, whole);
        Bounds bounds;
        const std::size_t first = next;
        std::uint64_t bytes = kFixedJson;
        for (; next < groups.size() && (next == first || bytes + groups[next].bytes <= part_bytes); ++next) {
            bytes += groups[next].bytes;
            const std::string name = assembly.group + " " + std::to_string(next);
            document.node(name, add_mesh(document, store, groups[next], name));
            bounds.add(groups[next].bounds);
        }
        const std::string name = fmt::format("{}.{:03}.glb", path.stem().string(), number);
        document.write(path.parent_path() / name);
        index["parts"].push_back({{"uri", name},
                                  {"triangles", document.triangles()},
                                  {"bytes", std::filesystem::file_size(path.parent_path() / name)},
                                  {"min", triple(bounds.lower)},
                                  {"max", triple(bounds.upper)}});
        total += document.triangles();
    }
    index["triangles"] = total;
    write_file(path.parent_path() / (path.stem().string() + ".parts.json"), index.dump(1) + "\n");
    return total;
}

Bounds bounds_of(const std::vector<Group>& groups) {
    Bounds bounds;
    for (const Group& group : groups) bounds.add(group.bounds);
    return bounds;
}

std::uint64_t write_instances(const std::filesystem::path& path, const Assembly& assembly, bool gpu_instancing) {
    // Each used model becomes a mesh at the origin, in the order of first use.
    std::vector<Placed> meshes;
    std::vector<int> mesh_of(assembly.models.size(), kNothing);
    for (const Placed& place : assembly.places) {
        if (mesh_of[place.model] != kNothing) continue;
        mesh_of[place.model] = static_cast<int>(meshes.size());
        meshes.push_back({.model = place.model});
    }
    const auto store = std::make_shared<Store>(assembly, meshes);
    const std::vector<Group> groups = make_groups(*store, assembly.materials.size(), 1);
    Document document = start(assembly);
    assembly.add_views(document, bounds_of(assembly));
    const int first = document.meshes();
    for (const Group& group : groups)
        add_mesh(document, store, group, assembly.models[store->places()[group.begin].model].name);
    const auto index = [&](std::uint32_t model) { return first + mesh_of[model]; };
    if (!gpu_instancing)
        for (const Placed& place : assembly.places) {
            dmat4 matrix(dmat3(place.turn));
            matrix[3] = dvec4(dvec3(place.at), 1);
            document.node(assembly.models[place.model].name, index(place.model), matrix);
        }
    for (const Placed& mesh : meshes) {
        if (!gpu_instancing) break;
        std::vector<vec3> translations;
        std::vector<vec4> rotations;
        for (const Placed& place : assembly.places) {
            if (place.model != mesh.model) continue;
            const glm::dquat q = glm::normalize(glm::quat_cast(dmat3(place.turn)));
            translations.push_back(place.at), rotations.emplace_back(q.x, q.y, q.z, q.w);
        }
        document.instances(assembly.models[mesh.model].name, index(mesh.model), std::move(translations),
                           std::move(rotations));
    }
    document.write(path);
    return document.triangles();
}

}  // namespace

std::uint32_t Assembly::add(std::string model_name, std::function<Mesh()> make) {
    models.push_back({std::move(model_name), std::move(make)});
    return static_cast<std::uint32_t>(models.size() - 1);
}

void Assembly::place(std::uint32_t model, const dmat4& matrix) {
    places.push_back({model, mat3(dmat3(matrix)), vec3(dvec3(matrix[3]))});
}

Bounds bounds_of(const Assembly& assembly) {
    constexpr std::uint64_t kTarget = 65536;  // triangles whose models are in memory together
    Store store(assembly, assembly.places);
    return bounds_of(make_groups(store, assembly.materials.size(), kTarget));
}

std::uint64_t write_assembly(const std::filesystem::path& path, const Assembly& assembly, const SceneOptions& options) {
    if (!options.flatten) return write_instances(path, assembly, options.gpu_instancing);
    const auto store = std::make_shared<Store>(assembly, assembly.places);
    // The target keeps the JSON small; at 60 bytes a triangle, a part holds several groups.
    const std::uint64_t target =
        std::min(std::max<std::uint64_t>(65536, options.triangles / 256), options.part_bytes / (4 * 60));
    const std::vector<Group> groups = make_groups(*store, assembly.materials.size(), target);
    if (options.parts) return write_parts(path, assembly, store, groups, options.part_bytes, bounds_of(groups));

    Document document = start(assembly);
    assembly.add_views(document, bounds_of(groups));
    std::uint64_t triangles = document.triangles(), bytes = kFixedJson;
    for (const Group& group : groups) triangles += group.triangles, bytes += group.bytes;
    if (bytes > kFileLimit)
        throw Error(path.string(), "{} triangles take {} bytes, more than the 4 GiB of one .glb: add --parts",
                    triangles, bytes);
    for (std::size_t i = 0; i < groups.size(); ++i) {
        const std::string name = assembly.group + " " + std::to_string(i);
        document.node(name, add_mesh(document, store, groups[i], name));
    }
    document.write(path);
    return document.triangles();
}

Assembly fitted(std::uint64_t triangles, const std::function<Assembly(double level)>& make) {
    constexpr double kLowest = 0x1p-10, kHighest = 0x1p10, kCloseEnough = 0.003;
    const auto count = [](const Assembly& assembly) {
        std::vector<std::uint64_t> uses(assembly.models.size());
        for (const Placed& place : assembly.places) ++uses[place.model];
        double sum = 0;
        for (std::size_t i = 0; i < uses.size(); ++i)
            if (uses[i] > 0)
                sum += static_cast<double>(uses[i]) * static_cast<double>(assembly.models[i].make().triangles());
        return sum;
    };
    const auto wanted = static_cast<double>(triangles);
    double low = kLowest, high = kHighest, level = 1, best = 1, best_count = kInfinity;
    for (int i = 0; i < 24 && std::abs(best_count / wanted - 1) > kCloseEnough; ++i) {
        const double found = count(make(level));
        if (std::abs(found - wanted) < std::abs(best_count - wanted)) best = level, best_count = found;
        (found < wanted ? low : high) = level;
        // Triangles grow with the square of the level; if that leaves the bracket, it is halved.
        level *= std::sqrt(wanted / found);
        if (level <= low || level >= high) level = std::sqrt(low * high);
        if (high / low < 1 + 1e-6) break;
    }
    Assembly result = make(best);
    if (low == kLowest && best_count > 1.05 * wanted)
        throw Error(result.name, "{} triangles are fewer than the {} of its coarsest form", triangles,
                    static_cast<std::uint64_t>(best_count));
    return result;
}

}  // namespace halflight::scenes
