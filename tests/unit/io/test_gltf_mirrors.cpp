// Tests that normals and tangents keep their side where joints and scales of 0 mirror a mesh.
#include <utility>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

/// A corner of a triangle in world space.
struct WorldCorner {
    dvec3 position, normal, tangent;
    double handedness;  // cross(normal, tangent) times it is the bitangent
};

std::vector<WorldCorner> world_corners(const Scene& scene) {
    std::vector<WorldCorner> corners;
    for (const Instance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes.at(static_cast<std::size_t>(instance.mesh));
        const dmat3 m(instance.object_to_world);
        for (const uvec3& t : mesh.triangles)
            for (int k = 0; k < 3; ++k) {
                const vec4 tangent = mesh.tangents.at(t[k]);
                corners.push_back({dvec3(instance.object_to_world * dvec4(dvec3(mesh.positions[t[k]]), 1)),
                                   glm::normalize(glm::transpose(glm::inverse(m)) * dvec3(mesh.normals[t[k]])),
                                   glm::normalize(m * dvec3(tangent)),
                                   glm::determinant(m) < 0 ? -double(tangent.w) : double(tangent.w)});
            }
    }
    return corners;
}

/// Returns the corner at the same place in the same triangle. Joints that mirror exchange two corners of a triangle, so
/// that its front stays in front.
const WorldCorner& same_corner(const std::vector<WorldCorner>& corners, std::size_t i, const dvec3& position) {
    const auto first = corners.begin() + std::ptrdiff_t(i / 3 * 3);
    return *std::min_element(first, first + 3, [&](const WorldCorner& x, const WorldCorner& y) {
        return glm::distance(x.position, position) < glm::distance(y.position, position);
    });
}

void expect_same_surfaces(const Scene& found, const Scene& expected) {
    const std::vector<WorldCorner> a = world_corners(found), b = world_corners(expected);
    ASSERT_EQ(a.size(), b.size());
    ASSERT_FALSE(a.empty());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const WorldCorner& same = same_corner(b, i, a[i].position);
        EXPECT_LT(glm::distance(a[i].position, same.position), 1e-5) << i;
        EXPECT_LT(glm::distance(a[i].normal, same.normal), 1e-5) << i;
        EXPECT_LT(glm::distance(a[i].tangent, same.tangent), 1e-5) << i;
        EXPECT_EQ(a[i].handedness, same.handedness) << i;
    }
}

enum class Normals { given, missing, zero };

class GltfMirrors : public GltfTest {
  protected:
    /// Returns a mesh of 3 x 3 quads, bumpy or in the plane z = 0, that needs generated tangents. It has no node.
    static GltfBuilder patch(Normals normals, bool bumpy = true) {
        constexpr int kSide = 4;
        GltfBuilder b;
        std::vector<float> positions, directions, uvs;
        std::vector<std::uint8_t> indices;
        for (int i = 0; i < kSide * kSide; ++i) {
            const float x = float(i % kSide) / 3, y = float(i / kSide) / 3;
            positions.insert(positions.end(), {x, y, bumpy ? 0.3f * x * x - 0.2f * x * y : 0});
            const vec3 n = bumpy ? glm::normalize(vec3(0.2f * y - 0.6f * x, 0.2f * x, 1)) : vec3(0, 0, 1);
            for (int k = 0; k < 3; ++k) directions.push_back(normals == Normals::given ? n[k] : 0);
            uvs.insert(uvs.end(), {x + 0.2f * y, 1 - y});
            const auto at = [&](int right, int up) { return std::uint8_t(i + right + kSide * up); };
            if (i % kSide < kSide - 1 && i / kSide < kSide - 1)
                indices.insert(indices.end(), {at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1)});
        }
        Json attributes = {{"POSITION", b.floats("VEC3", positions)}, {"TEXCOORD_0", b.floats("VEC2", uvs)}};
        if (normals != Normals::missing) attributes["NORMAL"] = b.floats("VEC3", directions);
        b.push("textures", {{"source", b.push("images", {{"uri", kPng16}})}});
        b.push("materials", {{"normalTexture", {{"index", 0}}}});
        b.add_mesh(attributes).update({{"indices", b.accessor("SCALAR", kU8, indices)}, {"material", 0}});
        b.json["nodes"] = Json::array();
        return b;
    }
    /// Makes the mesh follow its first joint, or two of them: joint 0 has the weight `first` in the first half of the
    /// vertices, and joint 1 in the others.
    static void add_weights(GltfBuilder& b, float first = 1, bool two = false) {
        std::vector<std::uint8_t> joints;
        std::vector<float> weights;
        for (int i = 0; i < 16; ++i) {
            joints.insert(joints.end(), {0, std::uint8_t(two), 0, 0});
            const float of_joint_0 = two && i >= 8 ? 1 - first : first;
            weights.insert(weights.end(), {of_joint_0, 1 - of_joint_0, 0, 0});
        }
        b.attributes()["JOINTS_0"] = b.accessor("VEC4", kU8, joints);
        b.attributes()["WEIGHTS_0"] = b.floats("VEC4", weights);
    }
    /// Adds nodes below each other; returns the last one.
    static int add_chain(GltfBuilder& b, const std::vector<Json>& nodes) {
        for (const Json& node : nodes) {
            const int index = b.push("nodes", node.is_null() ? Json::object() : node);
            if (&node != &nodes.front()) b.json["nodes"][std::size_t(index) - 1]["children"] = {index};
        }
        return int(b.json["nodes"].size()) - 1;
    }
    static Json& last_node(GltfBuilder& b) { return b.json["nodes"].back(); }
    static Json matrix(const dmat3& m) {
        return {
            {"matrix", {m[0].x, m[0].y, m[0].z, 0, m[1].x, m[1].y, m[1].z, 0, m[2].x, m[2].y, m[2].z, 0, 1, 2, 3, 1}}};
    }
};

const Json kTurned = {{"rotation", {0.1, -0.3, 0.2, 0.9}}, {"translation", {1, 2, 3}}};

/// Joints and nodes of the same transforms show the same surfaces, whether normals are those of the file, flat or
/// repaired.
TEST_F(GltfMirrors, JointsShowWhatNodesShow) {
    const std::vector<std::vector<Json>> chains = {{{{"scale", {1, 1, 1}}}},
                                                   {{{"scale", {-1, 1, 1}}}},
                                                   {{{"scale", {1, 1, -1}}}},
                                                   {{{"scale", {-1, -1, 1}}}},
                                                   {{{"scale", {-2, -2, -2}}}},
                                                   {{{"scale", {1, -1, 1}}}, kTurned, {{"scale", {-1, 1, 1}}}},
                                                   {kTurned, {{"scale", {1, -1, 1}}}, kTurned},
                                                   {kTurned, matrix(dmat3(-1, 0, 0, 0, 1, 0, 0, 0, 1)), {}}};
    for (const Normals normals : {Normals::given, Normals::missing, Normals::zero})
        for (const std::vector<Json>& chain : chains) {
            SCOPED_TRACE(fmt::format("normals {}, {}", int(normals), Json(chain).dump()));
            GltfBuilder nodes = patch(normals), joints = nodes;
            add_chain(nodes, chain);
            last_node(nodes)["mesh"] = 0;
            add_weights(joints);
            const int joint = add_chain(joints, chain);
            joints.push("skins", {{"joints", {joint}}});
            joints.push("nodes", {{"mesh", 0}, {"skin", 0}, {"scale", {-3, 1, 1}}});
            const Scene expected = load(nodes);
            expect_same_surfaces(load(joints), expected);
            // An inverse bind matrix mirrors it back.
            joints.json["skins"][0]["inverseBindMatrices"] =
                joints.floats("MAT4", {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
            const int mirrored = joints.push("nodes", {{"scale", {-1, 1, 1}}});
            joints.json["nodes"][std::size_t(joint)]["children"] = {mirrored};
            joints.json["skins"][0]["joints"] = {mirrored};
            expect_same_surfaces(load(joints), expected);
        }
}

/// Only the second joint mirrors. Blends mirror if their mean does.
TEST_F(GltfMirrors, OneJointOfTwo) {
    for (const Normals normals : {Normals::given, Normals::missing, Normals::zero})
        for (const float weight : {1.0f, 0.75f}) {
            SCOPED_TRACE(fmt::format("normals {}, weight {}", int(normals), weight));
            GltfBuilder skinned = patch(normals), nodes = skinned;
            // The triangles between the two halves are left out.
            const std::vector<std::uint8_t> low{0, 1, 5, 0, 5, 4, 2, 3, 7}, high{8, 9, 13, 8, 13, 12, 10, 11, 15};
            std::vector<std::uint8_t> both = low;
            both.insert(both.end(), high.begin(), high.end());
            add_weights(skinned, weight, true);
            skinned.primitive()["indices"] = skinned.accessor("SCALAR", kU8, both);
            const Json plain = {{"scale", {2, 2, 2}}}, mirror = {{"scale", {-2, 2, 2}}};
            skinned.push("nodes", plain), skinned.push("nodes", mirror);
            skinned.push("skins", {{"joints", {0, 1}}});
            skinned.push("nodes", {{"mesh", 0}, {"skin", 0}});

            nodes.json["meshes"].push_back(nodes.json["meshes"][0]);
            nodes.primitive(0)["indices"] = nodes.accessor("SCALAR", kU8, low);
            nodes.primitive(1)["indices"] = nodes.accessor("SCALAR", kU8, high);
            const double x = 2 * (2 * weight - 1);
            nodes.push("nodes", {{"mesh", 0}, {"scale", {x, 2, 2}}});
            nodes.push("nodes", {{"mesh", 1}, {"scale", {-x, 2, 2}}});
            const std::vector<WorldCorner> a = world_corners(load(skinned)), b = world_corners(load(nodes));
            ASSERT_EQ(a.size(), b.size());
            for (std::size_t i = 0; i < a.size(); ++i) {
                const WorldCorner& same = same_corner(b, i, a[i].position);
                EXPECT_LT(glm::distance(a[i].position, same.position), 1e-5) << i;
                EXPECT_LT(glm::distance(a[i].normal, same.normal), 1e-5) << i;
                // Tangents are those of the pose, which stretches x if weights blend.
                EXPECT_GT(glm::dot(a[i].tangent, same.tangent), weight == 1 ? 0.99999 : 0.9) << i;
                EXPECT_EQ(a[i].handedness, same.handedness) << i;
            }
        }
}

/// Neither joint mirrors, but their mean does.
TEST_F(GltfMirrors, MeansOfTurns) {
    for (const Normals normals : {Normals::given, Normals::missing, Normals::zero}) {
        SCOPED_TRACE(int(normals));
        GltfBuilder skinned = patch(normals, false), node = skinned;
        for (GltfBuilder* b : {&skinned, &node})
            b->primitive()["indices"] =
                b->accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 1, 5, 0, 5, 4, 2, 3, 7});
        add_weights(skinned, 0.6f, true);
        skinned.push("nodes", Json::object());
        skinned.push("nodes", {{"rotation", {0, 0, 1, 0}}, {"scale", {2, 1, 1}}});
        skinned.push("skins", {{"joints", {0, 1}}});
        skinned.push("nodes", {{"mesh", 0}, {"skin", 0}});
        node.push("nodes", {{"mesh", 0}, {"scale", {-0.2, 0.2, 1}}});
        expect_same_surfaces(load(skinned), load(node));
    }
}

TEST_F(GltfMirrors, AnimatedScales) {
    for (const Normals normals : {Normals::given, Normals::missing}) {
        GltfBuilder b = patch(normals), expected = b;
        add_weights(b);
        b.push("nodes", Json::object());
        b.push("skins", {{"joints", {0}}});
        b.push("nodes", {{"mesh", 0}, {"skin", 0}});
        b.animate(0, "scale", b.floats("SCALAR", {0, 2}), b.floats("VEC3", {1, 1, 1, -1, 1, 1}));
        expected.push("nodes", {{"mesh", 0}});
        GltfScene scene = open(b);
        for (const double x : {1, -1, 1}) {
            expected.json["nodes"][0]["scale"] = {x, 1, 1};
            expect_same_surfaces(scene.at(1 - x, kFirst), load_gltf(write("still.glb", expected.glb())));
        }
    }
}

/// A scale of 0 has the side of a scale of 1, with any rotation above it.
TEST_F(GltfMirrors, ScalesOfZeroCountAsPositive) {
    for (const Normals normals : {Normals::given, Normals::missing, Normals::zero})
        for (const Json& above : {Json::object(), kTurned})
            for (const auto& [x, y] : {std::pair{1, 1}, {-1, 1}, {1, -1}, {-1, -1}}) {
                SCOPED_TRACE(fmt::format("normals {}, scale {} {}, below {}", int(normals), x, y, above.dump()));
                const auto below = [&](int z, const char* kind) {
                    GltfBuilder b = patch(normals, false);
                    const Json scale = {x, y, z};
                    const std::string how = kind;
                    if (how == "instance") {
                        b.require({"EXT_mesh_gpu_instancing"});
                        add_chain(b, {above, Json::object()});
                        last_node(b)["mesh"] = 0;
                        last_node(b)["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
                            b.floats("VEC3", {float(x), float(y), float(z)});
                        return b;
                    }
                    const int node = add_chain(b, {above, how == "matrix" ? matrix(dmat3(x, 0, 0, 0, y, 0, 0, 0, z))
                                                                          : Json{{"scale", scale}}});
                    if (how != "joint") {
                        last_node(b)["mesh"] = 0;
                        return b;
                    }
                    add_weights(b, 0.5f, true);
                    b.push("skins", {{"joints", {node, node}}});
                    b.push("nodes", {{"mesh", 0}, {"skin", 0}});
                    return b;
                };
                for (const char* kind : {"scale", "matrix", "instance", "joint"}) {
                    if (kind == std::string("matrix") && x * y < 0) continue;  // it may as well be a half turn
                    SCOPED_TRACE(kind);
                    expect_same_surfaces(load(below(0, kind)), load(below(1, kind)));
                }
            }
}

/// A column of zeros in the matrix of a node is a scale of 0.
TEST_F(GltfMirrors, MatricesWithColumnsOfZeros) {
    GltfBuilder b;
    b.add_perspective_camera();
    const double c = 0.8, s = 0.6;  // rotation about Y
    b.push("nodes", matrix(dmat3(c, 0, -s, 0, 1, 0, 0, 0, 0)));
    b.json["nodes"][0]["camera"] = 0;
    const Scene scene = load(b);
    EXPECT_LT(glm::distance(dvec3(scene.cameras.at(0).camera_to_world[2]), dvec3(s, 0, c)), 1e-9);
    EXPECT_TRUE(scene.report.warnings.empty());

    GltfBuilder turned = patch(Normals::given, false), same = turned;
    turned.push("nodes", matrix(dmat3(-1, 0, 0, 0, 1, 0, 0, 0, 0)));
    same.push("nodes", {{"rotation", {0, 1, 0, 0}}, {"translation", {1, 2, 3}}, {"scale", {1, 1, 0}}});
    last_node(turned)["mesh"] = last_node(same)["mesh"] = 0;
    expect_same_surfaces(load(turned), load(same));
}

}  // namespace
}  // namespace halflight
