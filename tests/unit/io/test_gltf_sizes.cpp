// Tests that what a glTF file takes in memory is known before it is read.
#include <fstream>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/parts.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using GltfSizes = GltfTest;

TEST_F(GltfSizes, InstancesHaveNames) {
    GltfBuilder b;
    b.add_triangle();
    constexpr std::size_t kCount = 1000, kName = 5000;
    const int translation = b.floats("VEC3", std::vector<float>(3 * kCount));
    b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = translation;
    const std::size_t without = open(b).size().instance_bytes;
    for (const char* list : {"meshes", "nodes"}) {
        b.json[list][0]["name"] = std::string(kName, 'n');
        EXPECT_EQ(open(b).size().instance_bytes, without + kCount * kName) << list;
        EXPECT_EQ(load(b).instances.at(kCount - 1).name.size(), kName) << list;
    }
}

TEST_F(GltfSizes, FlatInstancesHaveMeshesOfTheirOwn) {
    constexpr std::size_t kFlat = 40, kAll = 50;
    std::vector<float> scales;
    for (std::size_t i = 0; i < kAll; ++i) scales.insert(scales.end(), {1, 1, i < kFlat ? 0.0f : 1.0f});
    GltfBuilder instanced;
    instanced.add_triangle();
    const SceneSize one = open(instanced).size();
    GltfBuilder nodes = instanced;
    instanced.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
        instanced.floats("VEC3", scales);
    nodes.json["nodes"].clear();
    for (std::size_t i = 0; i < kAll; ++i)
        nodes.push("nodes", {{"mesh", 0}, {"scale", {scales[3 * i], scales[3 * i + 1], scales[3 * i + 2]}}});
    for (const GltfBuilder& b : {instanced, nodes}) {
        EXPECT_EQ(load(b).meshes.size(), kFlat + 1);
        const SceneSize size = open(b).size();
        EXPECT_EQ(size.stored, kFlat + 1);
        EXPECT_EQ(size.geometry_bytes, (kFlat + 1) * one.geometry_bytes);
        EXPECT_EQ(size.drawn, kAll);
        EXPECT_GE(size.instance_bytes, kAll * one.instance_bytes + kFlat * sizeof(Mesh));
    }
}

/// Sets the memory that is left, bytes, until it is destroyed.
class MemoryLeft {
  public:
    explicit MemoryLeft(std::size_t bytes) { memory_.set_limit(limit_ - memory_.free() + bytes); }
    ~MemoryLeft() { memory_.set_limit(limit_); }
    MemoryLeft(const MemoryLeft&) = delete;
    MemoryLeft& operator=(const MemoryLeft&) = delete;

  private:
    MemoryLedger& memory_ = MemoryLedger::process();
    const std::size_t limit_ = memory_.limit();
};

TEST_F(GltfSizes, KeyframesOfManySamplersThatShareAccessors) {
    constexpr std::size_t kKeys = 1000, kSamplers = 100, kBytes = kKeys * 4 * sizeof(float);
    GltfBuilder b;
    b.add_triangle();
    std::vector<float> times(kKeys);
    for (std::size_t i = 0; i < kKeys; ++i) times[i] = static_cast<float>(i);
    const int input = b.floats("SCALAR", times), output = b.floats("VEC3", std::vector<float>(3 * kKeys));
    Json animation;
    for (std::size_t i = 0; i < kSamplers; ++i) {
        animation["samplers"].push_back({{"input", input}, {"output", output}});
        animation["channels"].push_back({{"sampler", i}, {"target", {{"node", 0}, {"path", "translation"}}}});
    }
    b.push("animations", animation);
    GltfScene refused(write("refused.glb", b.glb())), read(write("read.glb", b.glb()));
    const std::size_t before = MemoryLedger::process().bytes(MemoryPart::scene);
    {
        const MemoryLeft half(kSamplers * kBytes / 2);
        const std::string message = error_message([&] { refused.animations(); });
        EXPECT_NE(message.find("animations[0].samplers[49]"), std::string::npos) << message;
    }
    const MemoryLeft enough((kSamplers + 1) * kBytes);
    EXPECT_EQ(read.animations().at(0).keyframes.size(), kSamplers);
    EXPECT_GE(MemoryLedger::process().bytes(MemoryPart::scene), before + kSamplers * kBytes);
}

TEST_F(GltfSizes, JsonOfManySmallValues) {
    constexpr std::size_t kCount = 100000;
    const auto refused = [&](const std::string& name, const std::string& value, std::size_t bytes_left) {
        std::string json = R"({"asset": {"version": "2.0"}, "x": [)";
        for (std::size_t i = 0; i < kCount; ++i) json += value + ',';
        json += "0]}";
        const std::filesystem::path file = write(name, json);
        const MemoryLeft left(bytes_left);
        const std::string message =
            error_message([&] { is_part_list(file) ? open_files(file).clear() : void(GltfScene(file)); });
        return message.find("objects and arrays of JSON") != std::string::npos;
    };
    // Each number takes 16 bytes, and each string 64 with its place in the array.
    for (const char* name : {"scene.gltf", "list.parts.json"}) {
        EXPECT_TRUE(refused(name, "0", kCount * 16)) << name;
        EXPECT_TRUE(refused(name, R"("")", kCount * 64)) << name;
        EXPECT_TRUE(refused(name, R"(",:[")", kCount * 64)) << name;
        EXPECT_FALSE(refused(name, R"(",:[{,:[{,")", kCount * 160)) << name << ": text of a string is no structure";
    }
}

}  // namespace
}  // namespace halflight
