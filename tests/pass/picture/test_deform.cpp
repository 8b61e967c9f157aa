// Tests morph targets and skins on the GPU bit by bit against the CPU, and the CPU against the formulas.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <thread>

#include "engine/device/deform.h"
#include "engine/io/gltf/gltf.h"
#include "tests/support/gpu_test.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {
namespace {

/// Features of a random shape, and the distance of its joints.
struct Kind {
    std::size_t vertices = 150;
    bool normals = true;
    bool tangents = true;
    std::size_t sets = 1;
    std::size_t targets = 0;
    std::size_t joints = 0;
    double distance = 0;  // distance of the joints from the origin
};

class RandomShape final : public RestShape {
  public:
    RandomShape(const Kind& kind, std::uint32_t seed) : kind_(kind), seed_(seed) {}

    std::size_t vertices() const override { return kind_.vertices; }
    VertexArrays read() const override {
        std::mt19937 random(seed_);
        VertexArrays v{vectors(random), {}, {}};
        if (kind_.normals) v.normals = vectors(random);
        if (!kind_.tangents) return v;
        for (const vec3& t : vectors(random)) v.tangents.emplace_back(t, random() % 2 == 0 ? 1 : -1);
        return v;
    }
    /// Returns weights with arbitrary sums; every tenth vertex has no weight.
    std::vector<JointSet> read_joints() const override {
        std::mt19937 random(seed_ + 1);
        std::vector<JointSet> sets(kind_.sets);
        for (JointSet& set : sets) {
            for (std::size_t i = 0; i < kind_.vertices; ++i) {
                vec4 weights(0);
                uvec4 joints(0);
                for (int k = 0; k < 4; ++k) {
                    joints[k] = static_cast<std::uint32_t>(random() % kind_.joints);
                    if (i % 10 != 0 && random() % 4 != 0) weights[k] = uniform_(random) + 1;
                }
                set.joints.push_back(joints);
                set.weights.push_back(weights);
            }
        }
        return sets;
    }
    std::size_t targets() const override { return kind_.targets; }
    Moved moved_by(std::size_t target) const override {
        return {target % 3 != 1, kind_.normals && target % 3 != 0, kind_.tangents && target % 3 == 2};
    }
    MorphTarget read_target(std::size_t target) const override {
        ++targets_read;
        std::mt19937 random(seed_ + 2 + static_cast<std::uint32_t>(target));
        const Moved moved = moved_by(target);
        const auto deltas = [&](bool wanted) { return wanted ? vectors(random) : std::vector<vec3>(); };
        return {deltas(moved.positions), deltas(moved.normals), deltas(moved.tangents)};
    }

    mutable int targets_read = 0;

  private:
    std::vector<vec3> vectors(std::mt19937& random) const {
        std::vector<vec3> all(kind_.vertices);
        for (vec3& v : all) v = vec3(uniform_(random), uniform_(random), uniform_(random));
        return all;
    }

    Kind kind_;
    std::uint32_t seed_;
    mutable std::uniform_real_distribution<float> uniform_{-1, 1};
};

/// Owns a random shape with poses; it must outlive the deformations that at() returns.
class Posable {
  public:
    Posable(const Kind& kind, std::uint32_t seed) : kind_(kind), shape(std::make_shared<RandomShape>(kind, seed)) {}

    static constexpr std::uint32_t kFlatPose = 4;  // all joints have a scale of 0
    /// Returns pose number `pose`. Its joints rotate, scale, mirror and translate.
    Deformation at(std::uint32_t pose) {
        std::mt19937 random(pose);
        std::uniform_real_distribution<double> uniform(-1, 1);
        Deformation deformation{shape, {}, {}};
        for (std::uint32_t i = 0; i < kind_.targets; ++i)
            if (random() % 3 != 0) deformation.targets.push_back({i, static_cast<float>(uniform(random))});
        std::vector<Joint>& joints = joints_.emplace_back();
        for (std::size_t i = 0; i < kind_.joints; ++i) {
            const dvec3 axis(uniform(random), uniform(random), 1.5);
            const dvec3 place = kind_.distance * dvec3(1, -2, 3) + dvec3(uniform(random), uniform(random), 0);
            dmat4 m = glm::rotate(glm::translate(dmat4(1), place), 3 * uniform(random), glm::normalize(axis));
            const bool mirrors = i % 3 == 2;
            const dvec3 scale(1 + 0.5 * uniform(random), mirrors ? -1 : 1, pose == kFlatPose ? 0 : 0.3);
            joints.push_back({glm::scale(m, scale), mirrors ? -1.0 : 1.0});
        }
        deformation.joints = joints;
        return deformation;
    }

  private:
    Kind kind_;
    std::deque<std::vector<Joint>> joints_;

  public:
    std::shared_ptr<RandomShape> shape;
};

const std::vector<std::pair<const char*, Kind>> kKinds = {
    {"still", {.sets = 0}},
    {"skin", {.joints = 7}},
    {"positions alone", {.normals = false, .tangents = false, .joints = 7}},
    {"morphed", {.sets = 0, .targets = 6}},
    {"morphed, no tangents", {.tangents = false, .sets = 0, .targets = 6}},
    {"morphed and skinned", {.targets = 5, .joints = 3}},
    {"three sets of joints", {.tangents = false, .sets = 3, .joints = 20}},
    {"flattened", {.sets = 0, .joints = 1}},
    {"far away", {.targets = 2, .joints = 9, .distance = 1e6}},
};

void expect_same(const VertexArrays& found, const VertexArrays& expected) {
    EXPECT_EQ(found.positions, expected.positions);
    EXPECT_EQ(found.normals, expected.normals);
    EXPECT_EQ(found.tangents, expected.tangents);
}

/// Returns the largest absolute difference of corresponding elements.
template <class V>
double difference(const std::vector<V>& a, const std::vector<V>& b) {
    EXPECT_EQ(a.size(), b.size());
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        for (int axis = 0; axis < V::length(); ++axis)
            largest = std::max(largest, std::abs(double(a[i][axis]) - double(b[i][axis])));
    return largest;
}

TEST(DeformOnTheCpu, FollowsTheFormulas) {
    for (const auto& [name, kind] : kKinds) {
        SCOPED_TRACE(name);
        Posable posable(kind, 1);
        const Deformation d = posable.at(2);
        const VertexArrays found = deform(d), rest = posable.shape->read();
        const std::vector<JointSet> sets = posable.shape->read_joints();
        std::vector<dvec3> positions(rest.positions.begin(), rest.positions.end());
        std::vector<dvec3> normals(rest.normals.begin(), rest.normals.end());
        for (const ActiveTarget& active : d.targets) {
            const MorphTarget target = posable.shape->read_target(active.target);
            for (std::size_t i = 0; i < target.positions.size(); ++i)
                positions[i] += double(active.weight) * dvec3(target.positions[i]);
            for (std::size_t i = 0; i < target.normals.size(); ++i)
                normals[i] += double(active.weight) * dvec3(target.normals[i]);
        }
        double error = 0, error_of_normals = 0;
        for (std::size_t i = 0; i < positions.size(); ++i) {
            dmat4 m(0);
            double total = 0;
            for (const JointSet& set : sets) {
                if (d.joints.empty()) break;
                for (int k = 0; k < 4; ++k) m += double(set.weights[i][k]) * d.joints[set.joints[i][k]].matrix;
                total += glm::dot(dvec4(set.weights[i]), dvec4(1));
            }
            if (d.joints.empty())
                m = dmat4(1);
            else if (total > 0)
                m /= total;
            else
                m = d.joints[sets.empty() ? 0 : sets[0].joints[i].x].matrix;
            error = std::max(error, glm::distance(dvec3(m * dvec4(positions[i], 1)), dvec3(found.positions[i])));
            if (normals.empty()) continue;
            const dvec3 normal = glm::normalize(glm::transpose(glm::inverse(dmat3(m))) * normals[i]);
            error_of_normals =
                std::max(error_of_normals, glm::distance(normal, glm::normalize(dvec3(found.normals[i]))));
        }
        EXPECT_LT(error, 1e-6 * (1 + 4 * kind.distance)) << "half an ulp of its position";
        EXPECT_LT(error_of_normals, 1e-5);
    }
}

class Deform : public GpuTest {
  protected:
    static void expect_as_on_cpu(GpuDeformer& deformer, std::span<const Deformation> all) {
        const std::vector<VertexArrays> moved = deformer.deform(all);
        ASSERT_EQ(moved.size(), all.size());
        for (std::size_t i = 0; i < all.size(); ++i) {
            SCOPED_TRACE(i);
            expect_same(moved[i], deform(all[i]));
        }
    }
};

/// Poses follow each other, two poses of a shape stand in one batch, and the order of shapes changes.
TEST_F(Deform, GivesTheBitsOfTheCpu) {
    GpuDeformer deformer(context);
    std::vector<Posable> shapes;
    for (const auto& [name, kind] : kKinds) shapes.emplace_back(kind, 5u);
    std::size_t vertices = 0;
    for (const std::uint32_t pose : {1u, 2u, 3u, 1u}) {
        std::vector<Deformation> all;
        for (Posable& shape : shapes) {
            all.push_back(shape.at(pose));
            if (pose == 2) all.push_back(shape.at(Posable::kFlatPose));
        }
        if (pose == 3) std::ranges::reverse(all);
        expect_as_on_cpu(deformer, all);
        for (const Deformation& d : all) vertices += d.rest->vertices();
    }
    const DeformStatistics statistics = deformer.take_statistics();
    EXPECT_EQ(statistics.vertices, vertices);
    EXPECT_EQ(statistics.vertices_on_cpu, 0u);
    EXPECT_GT(statistics.seconds, 0);
    EXPECT_EQ(deformer.take_statistics().vertices, 0u) << "they have been moved out";
}

TEST_F(Deform, UsesItsOwnContext) {
    const Kind kind{.targets = 5, .joints = 3};
    Posable posable(kind, 1);
    const Deformation d = posable.at(2);
    gpu::Context other = test_context();
    context.make_current();
    GpuDeformer deformer(context);
    {
        other.make_current();
        const gpu::Buffer numbers = gpu::Buffer::from("numbers", std::vector<std::uint32_t>(1000, 7));
        expect_as_on_cpu(deformer, std::span(&d, 1));
        EXPECT_EQ(deformer.take_statistics().vertices_on_cpu, 0u);
        EXPECT_EQ(numbers.read<std::uint32_t>(), std::vector<std::uint32_t>(1000, 7)) << "it is of the current context";
        EXPECT_NO_THROW(other.check("GL errors of the other context"));
    }
    context.make_current();
    VertexArrays found;
    std::thread([&] { found = deformer.deform(std::span(&d, 1)).at(0); }).join();
    expect_same(found, deform(d));
    EXPECT_EQ(deformer.take_statistics().vertices_on_cpu, kind.vertices) << "its context is current on this thread";
}

TEST_F(Deform, LimitsOfTheDriverChangeNothing) {
    gpu::Limits small = context.limits(), tiny = small, narrow = small;
    small.storage_block_bytes = 40 * 64;  // 64 vertices with normals and tangents fit
    tiny.storage_block_bytes = 8;         // less than one vertex fits
    narrow.texture_buffer_texels = 126;   // 18 joints fit, and one shape has more
    GpuDeformer in_pieces(context, small), on_cpu(context, tiny), part_on_cpu(context, narrow);
    std::vector<Posable> shapes;
    for (const auto& [name, kind] : kKinds) shapes.emplace_back(kind, 3u);
    for (const std::uint32_t pose : {1u, 2u}) {
        std::vector<Deformation> all;
        for (Posable& shape : shapes) all.push_back(shape.at(pose));
        for (GpuDeformer* deformer : {&in_pieces, &on_cpu, &part_on_cpu}) expect_as_on_cpu(*deformer, all);
    }
    const DeformStatistics pieces = in_pieces.take_statistics(), cpu = on_cpu.take_statistics(),
                           part = part_on_cpu.take_statistics();
    EXPECT_EQ(pieces.vertices_on_cpu, 0u);
    EXPECT_EQ(cpu.vertices_on_cpu, cpu.vertices);
    EXPECT_EQ(on_cpu.bytes(), 0u);
    EXPECT_GT(part.vertices_on_cpu, 0u);
    EXPECT_LT(part.vertices_on_cpu, part.vertices);
}

TEST_F(Deform, TargetsAreReadWhenTheyAreActive) {
    Posable posable({.sets = 0, .targets = 4}, 8);
    GpuDeformer deformer(context);
    const auto& shape = *posable.shape;
    Deformation d{posable.shape, {}, {}};
    deformer.deform(std::span(&d, 1));
    EXPECT_EQ(shape.targets_read, 0);
    d.targets = {{2, 0.5f}};
    for (int i = 0; i < 3; ++i) expect_as_on_cpu(deformer, std::span(&d, 1));
    EXPECT_EQ(shape.targets_read, 4) << "once for the GPU, three times for the CPU";
}

/// Returns a static mesh and one that moves between 0 s and 1 s: two of its three vertices follow two joints and a
/// morph target.
GltfBuilder animated() {
    GltfBuilder b;
    b.add_triangle();
    Json& primitive = b.add_triangle();
    primitive["attributes"]["NORMAL"] = b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
    primitive["attributes"]["JOINTS_0"] =
        b.accessor("VEC4", kU16, std::vector<std::uint16_t>{0, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0});
    primitive["attributes"]["WEIGHTS_0"] = b.floats("VEC4", {0.3f, 0.6f, 0, 0, 1, 0, 0, 0, NAN, -1, 0, 0});
    primitive["targets"] = {{{"POSITION", b.floats("VEC3", {0.1f, 2, 0, 0, 2, 0.7f, 0, 2, 0})}}};
    b.json["nodes"][1]["skin"] = 0;
    b.push("nodes", {{"translation", {1, 0, 0.1}}});
    b.push("nodes", {{"rotation", {0.1, 0.2, 0.3, 0.9}}});
    b.push("skins", {{"joints", {2, 3}}});
    const int times = b.floats("SCALAR", {0, 1});
    const auto channel = [&](int node, const char* path, int output) {
        Json& animation = b.json["animations"][0];
        const std::size_t sampler = animation["samplers"].size();
        animation["samplers"].push_back({{"input", times}, {"output", output}});
        animation["channels"].push_back({{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}});
    };
    channel(3, "translation", b.floats("VEC3", {0, 0, 0, 0.3f, 8, 0}));
    channel(1, "weights", b.floats("SCALAR", {0, 0.9f}));
    // Primitives without attributes cause a warning.
    for (Json& mesh : b.json["meshes"]) mesh["primitives"].push_back({{"attributes", Json::object()}});
    return b;
}

class DeformFiles : public GltfTest {
  protected:
    GltfScene open(const GltfBuilder& builder) const { return GltfScene(write("scene.glb", builder.glb())); }

    static constexpr std::size_t kAll[] = {0};
    gpu::Context context = test_context();
};

void expect_same(const Scene& found, const Scene& expected) {
    ASSERT_EQ(found.meshes.size(), expected.meshes.size());
    for (std::size_t i = 0; i < expected.meshes.size(); ++i) {
        SCOPED_TRACE(expected.meshes[i].name);
        EXPECT_EQ(found.meshes[i].positions, expected.meshes[i].positions);
        EXPECT_EQ(found.meshes[i].normals, expected.meshes[i].normals);
        EXPECT_EQ(found.meshes[i].tangents, expected.meshes[i].tangents);
    }
    EXPECT_EQ(found.report.warnings, expected.report.warnings);
    EXPECT_EQ(found.report.normals_generated, expected.report.normals_generated);
}

TEST_F(DeformFiles, AreEqualOnCpuAndGpu) {
    GltfScene cpu = open(animated()), gpu = open(animated());
    GpuDeformer deformer(context);
    gpu.deform_by(&deformer);
    Scene scene = gpu.at(0, kAll);
    EXPECT_EQ(deformer.take_statistics().vertices, 3u) << "static meshes are not deformed";
    expect_same(scene, cpu.at(0, kAll));
    for (const double seconds : {0.5, 1.0, 0.25, 0.5}) {
        gpu.pose(scene, seconds, kAll);
        expect_same(scene, cpu.at(seconds, kAll));
        expect_same(gpu.at(seconds, kAll), scene);
    }
    EXPECT_EQ(deformer.take_statistics().vertices, 3u * 8);
    expect_same(gpu.at_rest(), cpu.at_rest());
    expect_same(gpu.at(1, {}), cpu.at(1, {}));
    EXPECT_EQ(deformer.take_statistics().vertices, 0u) << "without animation nothing is deformed";
    gpu.deform_by(nullptr);
    expect_same(gpu.at(0.5, kAll), cpu.at(0.5, kAll));
    EXPECT_EQ(deformer.take_statistics().vertices, 0u);
}

TEST_F(DeformFiles, DamagedFilesGiveEqualErrors) {
    const auto primitive = [](GltfBuilder& b) -> Json& { return b.json["meshes"][1]["primitives"][0]; };
    const struct {
        const char* named;
        std::function<void(GltfBuilder&)> damage;
    } rows[] = {
        {"JOINTS_0", [](GltfBuilder& b) { b.json["skins"][0]["joints"] = {3}; }},
        {"WEIGHTS_0", [&](GltfBuilder& b) { primitive(b)["attributes"].erase("WEIGHTS_0"); }},
        {"WEIGHTS_0",
         [&](GltfBuilder& b) {
             primitive(b)["attributes"]["WEIGHTS_0"] = b.floats("VEC4", {1, 0, 0, 0});
         }},
        {"POSITION",
         [&](GltfBuilder& b) {
             primitive(b)["targets"][0]["POSITION"] = b.floats("VEC3", {1, 2, 3});
         }},
    };
    for (const auto& [named, damage] : rows) {
        GltfBuilder b = animated();
        damage(b);
        const auto refusal = [&](Deformer* deformer) {
            return without_name(error_message([&] {
                GltfScene scene = open(b);
                scene.deform_by(deformer);
                scene.at(0, kAll);
                scene.at(0.5, kAll);
            }));
        };
        GpuDeformer deformer(context);
        const std::string message = refusal(&deformer);
        EXPECT_TRUE(message.starts_with("meshes[1].primitives[0]: ") && message.find(named) != std::string::npos)
            << message;
        EXPECT_EQ(refusal(nullptr), message);
    }
}

}  // namespace
}  // namespace halflight::test
