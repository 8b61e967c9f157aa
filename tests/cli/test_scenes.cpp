// Tests halflight-scenes: it reproduces the committed scenes byte by byte, they are valid, and large scenes have
// the requested features.
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "engine/io/gltf/gltf.h"
#include "tests/cli/command_test.h"

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
};

/// Counts the triangles of all instances.
std::uint64_t triangles_of(const Scene& scene) {
    std::uint64_t count = 0;
    for (const Instance& instance : scene.instances) count += scene.meshes[std::size_t(instance.mesh)].triangles.size();
    return count;
}

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

/// Runs halflight-scenes; the name of the output comes after the kind of scene.
Outcome make(Strings command, const fs::path& output) {
    command.insert(command.begin() + 1, output.string());
    return run(words(std::string(HALFLIGHT_SCENES), command));
}
void expect_made(const Outcome& outcome) {
    ASSERT_EQ(outcome.status, 0) << outcome.err;
}

TEST(Scenes, AreReproducedByteByByteSoundAndSelfContained) {
    const TemporaryFolder folder;
    std::set<std::string> committed, reproduced;
    for (const fs::directory_entry& entry : fs::directory_iterator(kScenes))
        if (entry.path().extension() == ".glb") committed.insert(entry.path().filename());
    std::uintmax_t bytes = 0;
    for (const auto& [name, command] : kCommands) {
        SCOPED_TRACE(name);
        reproduced.insert(name);
        expect_made(make(command, folder / name));
        EXPECT_TRUE(read_text(folder / name) == read_text(kScenes / name));
        bytes += fs::file_size(kScenes / name);
        const Glb glb(kScenes / name);
        EXPECT_FALSE(glb.json["buffers"][0].contains("uri"));
        EXPECT_FALSE(glb.json["cameras"].empty());
        for (const Json& image : glb.json.value("images", Json::array())) EXPECT_FALSE(image.contains("uri"));
        expect_sound(glb, name);
    }
    EXPECT_EQ(committed, reproduced) << "every committed scene has a command";
    EXPECT_LT(bytes, 12U << 20);
}

/// A kind of scene that consists of placed models.
struct Kind {
    std::string name;
    std::vector<int> triangles;         // some counts; the first one is the cheapest that has all models
    double tolerance;                   // relative tolerance of the counts
    std::vector<std::string> in_parts;  // options of a scene in several parts
    int in_all_parts;                   // triangles of all its parts
    std::uintmax_t part_bytes;          // limit of a part, bytes
    std::vector<std::string> cameras;
};

std::ostream& operator<<(std::ostream& out, const Kind& kind) {
    return out << kind.name;
}

class Assemblies : public CommandTest, public ::testing::WithParamInterface<Kind> {
  protected:
    /// Makes and loads a scene.
    template <class... Parts>
    Scene scene(const Parts&... options) const {
        expect_made(make(words(GetParam().name, options...), folder / "scene.glb"));
        return load_gltf(folder / "scene.glb");
    }
    static void expect_about(std::uint64_t triangles, int wanted) {
        EXPECT_NEAR(static_cast<double>(triangles), wanted, GetParam().tolerance * wanted);
    }
};

TEST_P(Assemblies, HaveTheRequestedNumberOfTriangles) {
    for (const int triangles : GetParam().triangles) {
        const std::string count = std::to_string(triangles);
        const std::uint64_t instanced = triangles_of(scene("--triangles", count));
        expect_about(instanced, triangles);
        for (const char* form : {"--flatten", "--gpu-instancing"})
            EXPECT_EQ(triangles_of(scene("--triangles", count, form)), instanced) << form;
    }
}

TEST_P(Assemblies, AreValidAndEqualInEveryForm) {
    const auto sum_of_corners = [](const Scene& of) {
        dvec3 sum(0);
        for (const Instance& instance : of.instances)
            for (const vec3& p : of.meshes[std::size_t(instance.mesh)].positions)
                sum += dvec3(instance.object_to_world * dvec4(p, 1));
        return sum;
    };
    scene("--triangles", std::to_string(GetParam().triangles.back()));
    expect_sound(Glb(folder / "scene.glb"), "detailed");
    const std::string count = std::to_string(GetParam().triangles.front());
    const dvec3 shared = sum_of_corners(scene("--triangles", count));
    expect_sound(Glb(folder / "scene.glb"), "instanced");
    const auto bytes = fs::file_size(folder / "scene.glb");
    const Scene flat = scene("--triangles", count, "--flatten");
    expect_sound(Glb(folder / "scene.glb"), "flattened");
    EXPECT_LT(bytes, fs::file_size(folder / "scene.glb"));
    EXPECT_EQ(flat.instances.size(), flat.meshes.size()) << "a shared mesh";
    Strings cameras;
    for (const Camera& camera : flat.cameras) cameras.push_back(camera.name);
    EXPECT_EQ(cameras, GetParam().cameras);
    const dvec3 flattened = sum_of_corners(flat);
    const double most = std::max({std::abs(shared.x), std::abs(shared.y), std::abs(shared.z)});
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(shared[axis], flattened[axis], 1e-6 * most);
}

TEST_P(Assemblies, AreSplitIntoPartsBelowTheLimit) {
    const int wanted = GetParam().in_all_parts;
    const bool flat = std::ranges::count(GetParam().in_parts, "--flatten") > 0;
    for (const char* run : {"a", "b"}) {
        fs::create_directory(folder / run);
        RunOptions options;
#ifndef HALFLIGHT_SANITIZED
        if (!flat) options.wrapper = {"prlimit", "--data=100000000"};  // parts are made one after the other
#endif
        expect_made(halflight::test::run(
            words(std::string(HALFLIGHT_SCENES), GetParam().name, fs::path(folder / run) / "big.glb",
                  "--parts --triangles", std::to_string(wanted), GetParam().in_parts),
            options));
    }
    EXPECT_TRUE(read_text(file("b/big.parts.json")) == read_text(file("a/big.parts.json")));
    const Json index = json_file(file("a/big.parts.json"));
    EXPECT_GT(index["parts"].size(), 1U);
    EXPECT_EQ(std::size_t(std::distance(fs::directory_iterator(folder / "a"), {})), index["parts"].size() + 1);
    std::uint64_t triangles = 0;
    for (const Json& part : index["parts"]) {
        const std::string name = part["uri"], bytes = read_text(fs::path(folder / "a") / name);
        EXPECT_TRUE(bytes == read_text(fs::path(folder / "b") / name)) << name;
        const std::uint64_t own = triangles_of(load_gltf(fs::path(folder / "a") / name));
        EXPECT_LE(bytes.size(), GetParam().part_bytes);
        EXPECT_EQ(part["bytes"], bytes.size());
        EXPECT_EQ(part["triangles"], own);
        EXPECT_EQ(Glb(fs::path(folder / "a") / name).json.contains("cameras"), part == index["parts"][0]);
        triangles += own;
    }
    EXPECT_EQ(index["triangles"], triangles);
    expect_about(triangles, wanted);
}

const Kind kKinds[] = {
    {"city",
     {20'000, 1000, 300'000},
     0.01,
     words("--flatten --part-size 16"),
     800'000,
     16U << 20,
     words("street aerial")},
    {"airliner", {250'000, 1'000'000}, 0.03, words("--part-size 32"), 3'000'000, 32U << 20, words("inside air")},
    {"powerplants", {250'000, 1'000'000}, 0.03, words("--part-size 32"), 3'000'000, 32U << 20, words("inside air")}};

INSTANTIATE_TEST_SUITE_P(Large, Assemblies, ::testing::ValuesIn(kKinds),
                         [](const auto& one) { return one.param.name; });

class Generated : public CommandTest {
  protected:
    template <class... Parts>
    Glb made(const Parts&... command) const {
        expect_made(make(words(command...), folder / "a.glb"));
        return Glb(folder / "a.glb");
    }
    void expect_refused(int status, const Strings& command, const char* output, const char* element) const {
        const Outcome outcome = make(command, folder / output);
        EXPECT_EQ(outcome.status, status) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with("halflight-scenes: ")) << outcome.err;
        expect_has(outcome.err, element);
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        EXPECT_TRUE(folder.entries().empty());
    }
};

TEST_F(Generated, RefusalsAreOneLine) {
    expect_refused(1, words("city --triangles 50"), "a.glb", "city: ");
    expect_refused(1, words("city --triangles 200000000 --flatten"), "a.glb", "--parts");
    expect_refused(2, words("cornell --bogus"), "a.glb", "--bogus");
    expect_refused(1, words("cornell"), "missing/cornell.glb", "missing/cornell.glb");
    for (const char* kind : {"airliner", "powerplants"})
        expect_refused(1, words(kind, "--triangles 5000"), "a.glb", "5000 triangles are fewer than");
    expect_refused(1, words("emitters --lights 100 --triangles 211"), "a.glb", "212 triangles");
    expect_refused(2, words("emitters --lights 0"), "a.glb", "--lights");
    for (const char* triangles : {"0", "-3", "99999999999"})
        expect_refused(2, words("emitters --triangles", triangles), "a.glb", "--triangles");
    expect_refused(1, words("emitters"), "hall.png", "hall.png");
    EXPECT_EQ(run({HALFLIGHT_SCENES}).status, 2);
    EXPECT_EQ(run({HALFLIGHT_SCENES, "city"}).status, 2);
    EXPECT_EQ(
        run(words(std::string(HALFLIGHT_SCENES), "path", kScenes / "cornell.glb", file("a.glb"), "--camera nobody"))
            .status,
        1);
}

TEST_F(Generated, EmittersHaveTheRequestedLights) {
    const auto lamps = [](const Glb& glb) {
        std::size_t triangles = 0;
        for (const Json& mesh : glb.json["meshes"])
            for (const Json& primitive : mesh["primitives"]) {
                const Json& material = glb.json["materials"][primitive["material"].get<std::size_t>()];
                if (material.contains("emissiveFactor")) triangles += glb.indices(primitive).size() / 3;
            }
        return triangles / 2;
    };
    for (const auto& [lights, triangles] : {std::pair(1u, 4012u), {10u, 12345u}, {2000u, 12345u}}) {
        const Glb glb = made("emitters --lights", std::to_string(lights), "--triangles", std::to_string(triangles));
        EXPECT_EQ(triangles_of(load_gltf(folder / "a.glb")), triangles);
        EXPECT_EQ(lamps(glb), lights);
    }
    expect_sound(made("emitters --lights 500"), "hall");
    const std::string once = read_text(file("a.glb"));
    made("emitters --lights 500");
    EXPECT_TRUE(read_text(file("a.glb")) == once);
}

TEST_F(Generated, HallsHaveTheRequestedTextures) {
    for (const int textures : {1, 7, 70}) {
        SCOPED_TRACE(textures);
        const auto files = [&] {
            const Glb glb = made("hall --texture-size 20 --textures", std::to_string(textures));
            std::vector<std::string> all{read_text(file("a.glb"))};
            for (const Json& image : glb.json["images"]) all.push_back(read_text(folder / image["uri"]));
            return all;
        };
        const auto all = files();
        EXPECT_EQ(all.size(), static_cast<std::size_t>(textures) + 1);
        EXPECT_EQ(std::set<std::string>(all.begin(), all.end()).size(), all.size());
        EXPECT_TRUE(files() == all);
        const Glb glb(folder / "a.glb");
        expect_sound(glb, "hall");
        std::set<std::size_t> used;
        for (const Json& mesh : glb.json["meshes"])
            for (const Json& primitive : mesh["primitives"]) used.insert(primitive["material"].get<std::size_t>());
        EXPECT_EQ(used.size(), glb.json["materials"].size());
    }
}

TEST_F(Generated, EelsRestAsTheModel) {
    for (const char* triangles : {"100", "5000", "70000"}) {
        made("eel --triangles", triangles);
        const auto count = static_cast<double>(triangles_of(load_gltf(folder / "a.glb")));
        EXPECT_NEAR(count, std::stod(triangles), 0.05 * count);
    }
    const Glb glb = made("eel --triangles 3000");
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

TEST_F(Generated, PathsFlyACameraThroughAScene) {
    const std::string out = file("path.glb");
    expect_made(run(
        words(std::string(HALFLIGHT_SCENES), "path", kScenes / "cornell.glb", out, "--frames 5 --fps 2 --degrees 90")));
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
}

}  // namespace
}  // namespace halflight::test
