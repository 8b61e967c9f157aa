// Tests halflight-scenes: it reproduces the committed scenes byte by byte, they are valid, and large scenes have
// the requested features.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/core/math.h"
#include "tests/support/process.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path kScenes = fs::path(HALFLIGHT_SOURCE_DIR) / "scenes";

const std::map<std::string, std::vector<std::string>> kCommands{
    {"cornell.glb", {"cornell"}}, {"cornell-metal.glb", {"cornell", "--metal"}},
    {"furnace.glb", {"furnace"}}, {"furnace-half.glb", {"furnace", "--albedo", "0.5"}},
    {"atrium.glb", {"atrium"}},   {"still-life.glb", {"still-life"}},
    {"room.glb", {"room"}},
};

/// A .glb file as JSON and binary chunk. Loading checks the sizes that the file states.
struct Glb {
    Json json;
    std::string bytes;

    explicit Glb(const fs::path& path) {
        const std::string file = read_text(path);
        const auto word = [&](std::size_t at) {
            std::uint32_t value = 0;
            std::memcpy(&value, file.data() + at, 4);
            return value;
        };
        EXPECT_EQ(word(0), 0x46546C67U);
        EXPECT_EQ(word(8), file.size());
        const std::size_t text = word(12);
        json = Json::parse(file.substr(20, text));
        EXPECT_EQ(word(20 + text), file.size() - text - 28);
        EXPECT_EQ(json["buffers"][0]["byteLength"], file.size() - text - 28);
        bytes = file.substr(28 + text);
    }

    /// Returns the elements of an accessor; T must have the size of its type.
    template <class T>
    std::vector<T> values(const Json& accessor) const {
        const Json& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
        const std::size_t count = accessor["count"];
        EXPECT_EQ(view["byteLength"], count * sizeof(T));
        EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0U);
        std::vector<T> result(count);
        std::memcpy(result.data(), bytes.data() + view["byteOffset"].get<std::size_t>(), count * sizeof(T));
        return result;
    }
    const Json& accessor(const Json& index) const { return json["accessors"][index.get<std::size_t>()]; }

    std::vector<std::uint32_t> indices(const Json& primitive) const {
        const Json& source = accessor(primitive["indices"]);
        if (source["componentType"] == 5125) return values<std::uint32_t>(source);
        const auto narrow = values<std::uint16_t>(source);
        return {narrow.begin(), narrow.end()};
    }

    std::uint64_t triangles_of_mesh(std::size_t mesh) const {
        std::uint64_t count = 0;
        for (const Json& primitive : json["meshes"][mesh]["primitives"])
            count += accessor(primitive["indices"])["count"].get<std::uint64_t>() / 3;
        return count;
    }

    std::uint64_t triangles() const {
        std::uint64_t count = 0;
        for (const Json& node : json["nodes"]) {
            if (!node.contains("mesh")) continue;
            const std::uint64_t mesh = triangles_of_mesh(node["mesh"]);
            const Json::json_pointer many("/extensions/EXT_mesh_gpu_instancing/attributes/TRANSLATION");
            count += mesh * (node.contains(many) ? accessor(node.at(many))["count"].get<std::uint64_t>() : 1);
        }
        return count;
    }
};

vec3 triple(const Json& json) {
    return {json[0].get<float>(), json[1].get<float>(), json[2].get<float>()};
}

/// Expects for every mesh: exact bounds, indices in range, unit normals on the side that the winding defines, no
/// degenerate and no duplicate triangles.
void expect_sound(const Glb& glb, const std::string& name) {
    for (const Json& mesh : glb.json["meshes"]) {
        std::set<std::array<std::array<float, 3>, 3>> seen;
        for (const Json& primitive : mesh["primitives"]) {
            SCOPED_TRACE(name + ": " + mesh["name"].get<std::string>() + ", material " + primitive["material"].dump());
            const Json& source = glb.accessor(primitive["attributes"]["POSITION"]);
            const auto positions = glb.values<vec3>(source);
            const auto normals = glb.values<vec3>(glb.accessor(primitive["attributes"]["NORMAL"]));
            const std::vector<std::uint32_t> indices = glb.indices(primitive);
            ASSERT_EQ(positions.size(), normals.size());
            ASSERT_LT(*std::max_element(indices.begin(), indices.end()), positions.size());
            Bounds bounds;
            for (const vec3& p : positions) bounds.add(p);
            EXPECT_EQ(bounds.lower, triple(source["min"]));
            EXPECT_EQ(bounds.upper, triple(source["max"]));
            for (const vec3& n : normals) ASSERT_NEAR(glm::length(n), 1, 1e-6);
            std::size_t flat = 0, turned = 0, twice = 0;
            for (std::size_t i = 0; i < indices.size(); i += 3) {
                const vec3 &a = positions[indices[i]], &b = positions[indices[i + 1]], &c = positions[indices[i + 2]];
                const dvec3 area = glm::cross(dvec3(b) - dvec3(a), dvec3(c) - dvec3(a));
                const vec3 shading = normals[indices[i]] + normals[indices[i + 1]] + normals[indices[i + 2]];
                flat += area == dvec3(0);
                turned += glm::dot(area, dvec3(shading)) < 0;
                std::array<std::array<float, 3>, 3> corners{{{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}}};
                std::sort(corners.begin(), corners.end());
                twice += !seen.insert(corners).second;
            }
            EXPECT_EQ(flat, 0U);
            EXPECT_EQ(turned, 0U);
            EXPECT_EQ(twice, 0U);
        }
    }
}

Outcome make(const std::vector<std::string>& command, const fs::path& output) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.begin() + 1, output.string());
    return run_program(arguments);
}

TEST(Scenes, AreReproducedByteByByte) {
    const TemporaryFolder folder;
    for (const auto& [name, command] : kCommands) {
        const Outcome outcome = make(command, folder / name);
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_TRUE(read_text(folder / name) == read_text(kScenes / name)) << name;
    }
}

TEST(Scenes, EveryCommittedSceneHasACommand) {
    std::set<std::string> committed, made;
    for (const fs::directory_entry& entry : fs::directory_iterator(kScenes))
        if (entry.path().extension() == ".glb") committed.insert(entry.path().filename());
    for (const auto& [name, command] : kCommands) made.insert(name);
    EXPECT_EQ(committed, made);
}

TEST(Scenes, AreSmallAndSelfContained) {
    std::uintmax_t bytes = 0;
    for (const auto& [name, command] : kCommands) {
        const Glb glb(kScenes / name);
        bytes += fs::file_size(kScenes / name);
        EXPECT_FALSE(glb.json["buffers"][0].contains("uri")) << name;
        EXPECT_FALSE(glb.json["cameras"].empty()) << name;
        for (const Json& image : glb.json.value("images", Json::array())) EXPECT_FALSE(image.contains("uri")) << name;
    }
    EXPECT_LT(bytes, 12U << 20);
}

TEST(Scenes, HaveSoundGeometry) {
    for (const auto& [name, command] : kCommands) expect_sound(Glb(kScenes / name), name);
}

TEST(Scenes, AtriumHasThePromisedSizeAndViews) {
    const Glb glb(kScenes / "atrium.glb");
    EXPECT_GE(glb.triangles(), 50'000U);
    EXPECT_LE(glb.triangles(), 100'000U);
    std::vector<std::string> cameras;
    for (const Json& camera : glb.json["cameras"]) cameras.push_back(camera["name"]);
    EXPECT_EQ(cameras, (std::vector<std::string>{"nave", "balcony", "detail"}));
    EXPECT_EQ(glb.json["extensions"]["HALFLIGHT_environment"]["color"].size(), 3U);
}

class City : public ::testing::Test {
  protected:
    Glb city(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "city");
        const Outcome outcome = make(arguments, folder / "city.glb");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return Glb(folder / "city.glb");
    }

    TemporaryFolder folder;
};

TEST_F(City, HasTheRequestedNumberOfTriangles) {
    for (const int triangles : {1000, 20'000, 300'000}) {
        const auto within = [&](std::uint64_t count) {
            EXPECT_NEAR(static_cast<double>(count), triangles, 0.01 * triangles);
        };
        const std::vector<std::string> arguments{"--triangles", std::to_string(triangles)};
        const auto with = [&](const char* option) {
            std::vector<std::string> more = arguments;
            more.emplace_back(option);
            return more;
        };
        const std::uint64_t instanced = city(arguments).triangles();
        within(instanced);
        EXPECT_EQ(city(with("--flatten")).triangles(), instanced);
        EXPECT_EQ(city(with("--gpu-instancing")).triangles(), instanced);
    }
}

TEST_F(City, IsValidInEveryForm) {
    expect_sound(city({"--triangles", "20000"}), "instanced");
    const Glb flat = city({"--triangles", "20000", "--flatten"});
    expect_sound(flat, "flattened");
    std::set<int> meshes;
    for (const Json& node : flat.json["nodes"])
        EXPECT_TRUE(!node.contains("mesh") || meshes.insert(node["mesh"].get<int>()).second) << "shared mesh";
    EXPECT_GT(meshes.size(), 1U);
    EXPECT_EQ(flat.json["cameras"].size(), 2U);
}

TEST_F(City, FlattenedEqualsInstanced) {
    // Sums all corners in world space; transforms are rotations about +y and translations.
    const auto sum_of = [](const Glb& glb) {
        dvec3 sum(0);
        for (const Json& node : glb.json["nodes"]) {
            if (!node.contains("mesh")) continue;
            const dvec3 move = node.contains("translation") ? dvec3(triple(node["translation"])) : dvec3(0);
            const double y = node.contains("rotation") ? node["rotation"][1].get<double>() : 0;
            const double w = node.contains("rotation") ? node["rotation"][3].get<double>() : 1;
            const double cosine = 1 - 2 * y * y, sine = 2 * y * w;
            for (const Json& primitive : glb.json["meshes"][node["mesh"].get<std::size_t>()]["primitives"])
                for (const vec3& p : glb.values<vec3>(glb.accessor(primitive["attributes"]["POSITION"])))
                    sum += dvec3(cosine * p.x + sine * p.z, p.y, cosine * p.z - sine * p.x) + move;
        }
        return sum;
    };
    const dvec3 instanced = sum_of(city({"--triangles", "50000"}));
    const dvec3 flattened = sum_of(city({"--triangles", "50000", "--flatten"}));
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(instanced[axis] / flattened[axis], 1, 1e-6);
}

TEST_F(City, IsSplitIntoPartsBelowTheLimit) {
    constexpr std::uintmax_t kLimit = 16U << 20;
    const Outcome outcome =
        make({"city", "--triangles", "800000", "--flatten", "--parts", "--part-size", "16"}, folder / "big.glb");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json index = Json::parse(read_text(folder / "big.parts.json"));
    EXPECT_GT(index["parts"].size(), 2U);
    EXPECT_EQ(folder.entries().size(), index["parts"].size() + 1);
    std::uint64_t triangles = 0;
    for (const Json& part : index["parts"]) {
        const fs::path path = folder / part["uri"].get<std::string>();
        const Glb glb(path);
        EXPECT_LE(fs::file_size(path), kLimit);
        EXPECT_EQ(part["bytes"], fs::file_size(path));
        EXPECT_EQ(part["triangles"], glb.triangles());
        EXPECT_EQ(glb.json.contains("cameras"), part == index["parts"][0]);
        triangles += glb.triangles();
    }
    EXPECT_EQ(index["triangles"], triangles);
    EXPECT_NEAR(static_cast<double>(triangles), 800'000, 8'000);
}

TEST_F(City, RefusesInOneLine) {
    const auto refused = [&](std::vector<std::string> arguments, const char* why) {
        const Outcome outcome = make(arguments, folder / "city.glb");
        EXPECT_NE(outcome.status, 0);
        EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
        EXPECT_TRUE(folder.entries().empty());
    };
    refused({"city", "--triangles", "50"}, "fewer than");
    refused({"city", "--triangles", "200000000", "--flatten"}, "--parts");
    for (const auto& arguments : {std::vector<std::string>{}, {"city"}, {"cornell", "--bogus", "a.glb"}}) {
        const Outcome usage = run_program(arguments);
        EXPECT_EQ(usage.status, 2);
        EXPECT_TRUE(usage.err.starts_with("halflight-scenes: ")) << usage.err;
        EXPECT_EQ(std::count(usage.err.begin(), usage.err.end(), '\n'), 1) << usage.err;
    }
    const Outcome unwritable = make({"cornell"}, folder / "missing" / "cornell.glb");
    EXPECT_NE(unwritable.status, 0);
    EXPECT_NE(unwritable.err.find("missing/cornell.glb"), std::string::npos) << unwritable.err;
}

/// Scenes that consist of placed models.
class Assemblies : public ::testing::TestWithParam<const char*> {
  protected:
    Glb scene(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), GetParam());
        const Outcome outcome = make(arguments, folder / "scene.glb");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return Glb(folder / "scene.glb");
    }

    TemporaryFolder folder;
};

TEST_P(Assemblies, HaveTheRequestedNumberOfTriangles) {
    for (const int triangles : {250'000, 500'000, 1'000'000}) {
        const std::string count = std::to_string(triangles);
        const std::uint64_t instanced = scene({"--triangles", count}).triangles();
        EXPECT_NEAR(static_cast<double>(instanced), triangles, 0.03 * triangles);
        EXPECT_EQ(scene({"--triangles", count, "--flatten"}).triangles(), instanced);
        EXPECT_EQ(scene({"--triangles", count, "--gpu-instancing"}).triangles(), instanced);
    }
}

TEST_P(Assemblies, AreValidInEveryForm) {
    for (const char* triangles : {"250000", "1000000"}) {
        expect_sound(scene({"--triangles", triangles}), "instanced");
        const Glb flat = scene({"--triangles", triangles, "--flatten"});
        expect_sound(flat, "flattened");
        std::vector<std::string> cameras;
        for (const Json& camera : flat.json["cameras"]) cameras.push_back(camera["name"]);
        EXPECT_EQ(cameras, (std::vector<std::string>{"inside", "air"}));
    }
}

TEST_P(Assemblies, FlattenedEqualInstanced) {
    const auto sum_of = [](const Glb& glb) {  // sums all corners in world space
        dvec3 sum(0);
        for (const Json& node : glb.json["nodes"]) {
            if (!node.contains("mesh")) continue;
            const dvec3 move = node.contains("translation") ? dvec3(triple(node["translation"])) : dvec3(0);
            const Json turn = node.value("rotation", Json{0, 0, 0, 1});
            const dvec3 axis(turn[0], turn[1], turn[2]);
            for (const Json& primitive : glb.json["meshes"][node["mesh"].get<std::size_t>()]["primitives"])
                for (const vec3& p : glb.values<vec3>(glb.accessor(primitive["attributes"]["POSITION"]))) {
                    const dvec3 t = 2.0 * glm::cross(axis, dvec3(p));
                    sum += dvec3(p) + turn[3].get<double>() * t + glm::cross(axis, t) + move;
                }
        }
        return sum;
    };
    const Glb shared = scene({"--triangles", "250000"});
    const dvec3 instanced = sum_of(shared);
    const Glb flat = scene({"--triangles", "250000", "--flatten"});
    const dvec3 flattened = sum_of(flat);
    const double most = std::max({std::abs(instanced.x), std::abs(instanced.y), std::abs(instanced.z)});
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(instanced[axis], flattened[axis], 1e-6 * most);
    EXPECT_LT(shared.bytes.size(), flat.bytes.size() / 2);
}

TEST_P(Assemblies, AreDeterministicAndNeedLittleMemory) {
    for (const char* run : {"a", "b"}) {
        fs::create_directory(folder / run);
        RunOptions options;
#ifndef HALFLIGHT_SANITIZED
        options.wrapper = {"prlimit", "--data=100000000"};
#endif
        const Outcome outcome = run_program(
            {GetParam(), fs::path(folder / run) / "big.glb", "--triangles", "3000000", "--parts", "--part-size", "32"},
            options);
        ASSERT_EQ(outcome.status, 0) << outcome.err;
    }
    const Json index = Json::parse(read_text(fs::path(folder / "a") / "big.parts.json"));
    EXPECT_TRUE(read_text(fs::path(folder / "b") / "big.parts.json") ==
                read_text(fs::path(folder / "a") / "big.parts.json"));
    EXPECT_GT(index["parts"].size(), 1U);
    std::uint64_t triangles = 0;
    for (const Json& part : index["parts"]) {
        const std::string name = part["uri"];
        EXPECT_TRUE(read_text(fs::path(folder / "a") / name) == read_text(fs::path(folder / "b") / name)) << name;
        triangles += Glb(fs::path(folder / "a") / name).triangles();
    }
    EXPECT_EQ(index["triangles"], triangles);
    EXPECT_NEAR(static_cast<double>(triangles), 3e6, 0.03 * 3e6);
}

TEST_P(Assemblies, RefuseTooFewTriangles) {
    const Outcome outcome = make({GetParam(), "--triangles", "5000"}, folder / "few.glb");
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("5000 triangles are fewer than the "), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_TRUE(folder.entries().empty());
}

INSTANTIATE_TEST_SUITE_P(Large, Assemblies, ::testing::Values("airliner", "powerplants"),
                         [](const auto& one) { return std::string(one.param); });

TEST(Emitters, HasTheRequestedLights) {
    const TemporaryFolder folder;
    const auto hall = [&](const std::vector<std::string>& arguments) {
        std::vector<std::string> command{"emitters"};
        command.insert(command.end(), arguments.begin(), arguments.end());
        const Outcome outcome = make(command, folder / "hall.glb");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return Glb(folder / "hall.glb");
    };
    const auto lamps = [](const Glb& glb) {
        std::size_t triangles = 0;
        for (const Json& mesh : glb.json["meshes"]) {
            for (const Json& primitive : mesh["primitives"]) {
                const Json& material = glb.json["materials"][primitive["material"].get<std::size_t>()];
                if (material.contains("emissiveFactor")) triangles += glb.indices(primitive).size() / 3;
            }
        }
        return triangles / 2;
    };
    for (const int lights : {1, 10, 2000}) {
        for (const int triangles : {4012, 12345}) {
            const Glb glb = hall({"--lights", std::to_string(lights), "--triangles", std::to_string(triangles)});
            EXPECT_EQ(glb.triangles(), static_cast<std::uint64_t>(triangles));
            EXPECT_EQ(lamps(glb), static_cast<std::size_t>(lights));
        }
    }
    expect_sound(hall({"--lights", "500"}), "hall");
    const std::string once = read_text(folder / "hall.glb");
    hall({"--lights", "500"});
    EXPECT_TRUE(read_text(folder / "hall.glb") == once);

    const auto refused = [&](const std::vector<std::string>& command, const char* file, const char* why) {
        const Outcome outcome = make(command, folder / file);
        EXPECT_NE(outcome.status, 0);
        EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
        EXPECT_FALSE(fs::exists(folder / file));
    };
    refused({"emitters", "--lights", "100", "--triangles", "211"}, "few.glb", "100 lights in a hall are 212 triangles");
    refused({"emitters", "--lights", "0"}, "none.glb", "--lights");
    for (const char* triangles : {"0", "-3", "99999999999"})
        refused({"emitters", "--triangles", triangles}, "none.glb", "--triangles: Value");
    refused({"emitters"}, "hall.png", "hall.png: is not the name of a .glb");
}

TEST(Hall, HasTheRequestedTextures) {
    const TemporaryFolder folder;
    for (const int textures : {1, 7, 70}) {
        SCOPED_TRACE(textures);
        const auto hall = [&] {
            const Outcome outcome =
                make({"hall", "--textures", std::to_string(textures), "--texture-size", "20"}, folder / "hall.glb");
            EXPECT_EQ(outcome.status, 0) << outcome.err;
            return Glb(folder / "hall.glb");
        };
        const Glb glb = hall();
        expect_sound(glb, "hall");
        ASSERT_EQ(glb.json["images"].size(), static_cast<std::size_t>(textures));
        std::vector<std::string> files{read_text(folder / "hall.glb")};
        for (const Json& image : glb.json["images"]) files.push_back(read_text(folder / image["uri"]));
        const std::set<std::string> different(files.begin(), files.end());
        EXPECT_EQ(different.size(), files.size());
        std::set<std::size_t> used;
        for (const Json& mesh : glb.json["meshes"])
            for (const Json& primitive : mesh["primitives"]) used.insert(primitive["material"].get<std::size_t>());
        EXPECT_EQ(used.size(), glb.json["materials"].size());
        hall();
        std::vector<std::string> again{read_text(folder / "hall.glb")};
        for (const Json& image : glb.json["images"]) again.push_back(read_text(folder / image["uri"]));
        EXPECT_TRUE(again == files);
    }
}

TEST(Eel, RestPoseEqualsTheModel) {
    const TemporaryFolder folder;
    const auto eel = [&](const char* triangles) {
        const Outcome outcome = make({"eel", "--triangles", triangles}, folder / "eel.glb");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return Glb(folder / "eel.glb");
    };
    for (const char* triangles : {"100", "5000", "70000"})
        EXPECT_NEAR(static_cast<double>(eel(triangles).triangles()), std::stod(triangles), 0.05 * std::stod(triangles));
    const Glb glb = eel("3000");
    expect_sound(glb, "eel");
    const auto values = [&]<class T>(const Json& accessor) {
        return glb.values<T>(glb.json["accessors"][accessor.get<std::size_t>()]);
    };
    const Json& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
    const auto joints = values.operator()<glm::u8vec4>(attributes["JOINTS_0"]);
    const auto weights = values.operator()<vec4>(attributes["WEIGHTS_0"]);
    const Json& skin = glb.json["skins"][0];
    const std::size_t count = skin["joints"].size();
    for (std::size_t v = 0; v < weights.size(); ++v) {
        EXPECT_NEAR(weights[v].x + weights[v].y, 1, 1e-6);
        EXPECT_EQ(vec2(weights[v].z, weights[v].w), vec2(0));
        EXPECT_LT(std::max(joints[v].x, joints[v].y), count);
    }
    // Joints without rotation, and inverse bind matrices of their positions, leave the mesh unchanged.
    const auto inverse = values.operator()<mat4>(skin["inverseBindMatrices"]);
    dvec3 at(0);
    for (std::size_t j = 0; j < count; ++j) {
        const Json& offset = glb.json["nodes"][skin["joints"][j].get<std::size_t>()]["translation"];
        at += dvec3(offset[0], offset[1], offset[2]);
        EXPECT_LT(glm::length(at + dvec3(inverse[j][3])), 1e-6) << "joint " << j;
    }
    const Json& animation = glb.json["animations"][0];
    ASSERT_EQ(animation["channels"].size(), count);
    for (const Json& sampler : animation["samplers"])
        for (const vec4& turn : values.operator()<vec4>(sampler["output"])) EXPECT_NEAR(glm::length(turn), 1, 1e-6);
}

TEST(Path, FliesACameraThroughAScene) {
    const TemporaryFolder folder;
    const std::string out = folder / "path.glb";
    const Outcome outcome =
        run_program({"path", kScenes / "cornell.glb", out, "--frames", "5", "--fps", "2", "--degrees", "90"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Glb before(kScenes / "cornell.glb"), after(out);
    EXPECT_EQ(after.bytes.substr(0, before.bytes.size()), before.bytes) << "the rest stays as it is";
    const Json& animation = after.json["animations"].at(0);
    EXPECT_EQ(animation["name"], "path");
    const Json& samplers = animation["samplers"];
    const auto values = [&]<class T>(std::size_t sampler, const char* which) {
        return after.values<T>(after.json["accessors"][samplers[sampler][which].get<std::size_t>()]);
    };
    EXPECT_EQ(values.operator()<float>(0, "input"), (std::vector<float>{0, 0.5f, 1, 1.5f, 2}));
    const auto places = values.operator()<vec3>(0, "output");
    ASSERT_EQ(places.size(), 5u);
    const Json& node = after.json["nodes"].back();
    EXPECT_EQ(after.json["scenes"][0]["nodes"].back(), after.json["nodes"].size() - 1);
    EXPECT_EQ(after.json["cameras"][node["camera"].get<std::size_t>()]["name"], "path");
    // The chord of a right angle on a circle is sqrt(2) times the radius. All steps are equal.
    const float step = glm::distance(places[0], places[1]);
    for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(glm::distance(places[i], places[i + 1]), step, 1e-4f * step);
    EXPECT_NEAR(glm::distance(places[0], places[4]) / step, std::sqrt(0.5) / std::sin(kPi / 16), 1e-3);
    EXPECT_EQ(run_program({"path", kScenes / "cornell.glb", out, "--camera", "nobody"}).status, 1);
}

}  // namespace
}  // namespace halflight::test
