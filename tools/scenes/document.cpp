#include "tools/scenes/document.h"

#include <algorithm>
#include <cassert>
#include <glm/gtc/quaternion.hpp>

#include "engine/core/error.h"
#include "engine/io/files.h"

namespace halflight::scenes {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;                                // glTF 2.0, 5.11.5
constexpr int kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;  // glTF 2.0, 5.1.3
constexpr int kLinear = 9729, kLinearMipmapLinear = 9987, kRepeat = 10497;                      // glTF 2.0, 5.26
constexpr std::uint32_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBin = 0x4E4942;               // glTF 2.0, 4.4

Json triple(const dvec3& v) {
    return Json::array({v.x, v.y, v.z});
}

std::uint64_t padded(std::uint64_t bytes) {
    return (bytes + 3) / 4 * 4;
}

/// Returns a quaternion with w >= 0: q and -q are the same rotation.
Json rotation(const dmat3& matrix) {
    glm::dquat q = glm::normalize(glm::quat_cast(matrix));
    if (q.w < 0) q = -q;
    return Json::array({q.x + 0.0, q.y + 0.0, q.z + 0.0, q.w});  // + 0.0 turns -0.0 into 0.0
}

}  // namespace

Material matte(std::string name, const dvec3& color) {
    Material m;
    m.name = std::move(name), m.color = color, m.specular = 0;
    return m;
}

Material metal(std::string name, const dvec3& color, double roughness) {
    Material m;
    m.name = std::move(name), m.color = color, m.metallic = 1, m.roughness = roughness;
    return m;
}

Material glossy(std::string name, const dvec3& color, double roughness) {
    Material m;
    m.name = std::move(name), m.color = color, m.roughness = roughness;
    return m;
}

Material light(std::string name, const dvec3& radiance) {
    Material m = matte(std::move(name), dvec3(0));
    m.emission = radiance;
    return m;
}

Document::Document(const std::string& name) {
    json_["asset"] = {{"version", "2.0"}, {"generator", "halflight-scenes"}};
    json_["extensionsUsed"] = Json::array();
    json_["scene"] = 0;
    json_["scenes"] = Json::array({{{"name", name}, {"nodes", Json::array()}}});
}

void Document::use(const char* extension) {
    Json& used = json_["extensionsUsed"];
    if (std::find(used.begin(), used.end(), extension) == used.end()) used.push_back(extension);
}

int Document::append(const char* list, Json value) {
    Json& target = json_[list];
    target.push_back(std::move(value));
    return static_cast<int>(target.size()) - 1;
}

int Document::root_node(Json value) {
    const int index = append("nodes", std::move(value));
    json_["scenes"][0]["nodes"].push_back(index);
    return index;
}

int Document::view(std::uint64_t bytes, int target, Producer write) {
    Json view{{"buffer", 0}, {"byteOffset", bytes_}, {"byteLength", bytes}};
    if (target != 0) view["target"] = target;
    chunks_.push_back({bytes, std::move(write)});
    bytes_ += padded(bytes);
    return append("bufferViews", std::move(view));
}

template <class T>
int Document::stored(std::vector<T> values, int target) {
    const std::uint64_t bytes = values.size() * sizeof(T);
    return view(bytes, target, [values = std::move(values)](CheckedFile& file) {
        file.write(values.data(), values.size() * sizeof(T));
    });
}

int Document::accessor(int view, int component_type, const char* type, std::uint64_t count) {
    return append("accessors",
                  {{"bufferView", view}, {"componentType", component_type}, {"count", count}, {"type", type}});
}

void Document::add_sampler() {
    if (!json_.contains("samplers"))
        append("samplers",
               {{"magFilter", kLinear}, {"minFilter", kLinearMipmapLinear}, {"wrapS", kRepeat}, {"wrapT", kRepeat}});
}

int Document::add_texture(nlohmann::ordered_json image) {
    add_sampler();
    const int source = append("images", std::move(image));
    return append("textures", {{"sampler", 0}, {"source", source}});
}

int Document::texture_file(const std::string& name, const std::string& uri) {
    return add_texture({{"name", name}, {"uri", uri}});
}

int Document::texture(const std::string& name, std::string png) {
    add_sampler();  // adds the sampler here, which decides its place in the file
    const std::uint64_t bytes = png.size();
    const int bytes_view =
        view(bytes, 0, [png = std::move(png)](CheckedFile& file) { file.write(png.data(), png.size()); });
    return add_texture({{"name", name}, {"mimeType", "image/png"}, {"bufferView", bytes_view}});
}

int Document::material(const Material& m) {
    Json pbr{{"baseColorFactor", {m.color.x, m.color.y, m.color.z, 1.0}},
             {"metallicFactor", m.metallic},
             {"roughnessFactor", m.roughness}};
    if (m.color_texture != kNothing) pbr["baseColorTexture"] = {{"index", m.color_texture}};
    if (m.roughness_texture != kNothing) pbr["metallicRoughnessTexture"] = {{"index", m.roughness_texture}};
    Json json{{"name", m.name}, {"pbrMetallicRoughness", std::move(pbr)}};
    if (m.normal_texture != kNothing) json["normalTexture"] = {{"index", m.normal_texture}, {"scale", m.normal_scale}};
    if (m.alpha_cutoff > 0) json["alphaMode"] = "MASK", json["alphaCutoff"] = m.alpha_cutoff;
    if (m.double_sided) json["doubleSided"] = true;
    const auto extend = [&](const char* extension, Json value) {
        use(extension);
        json["extensions"][extension] = std::move(value);
    };
    const double strength = std::max({m.emission.x, m.emission.y, m.emission.z});
    if (strength > 0) {
        json["emissiveFactor"] = triple(m.emission / strength);
        extend("KHR_materials_emissive_strength", {{"emissiveStrength", strength}});
    }
    if (m.specular != 1) extend("KHR_materials_specular", {{"specularFactor", m.specular}});
    if (m.ior != 1.5) extend("KHR_materials_ior", {{"ior", m.ior}});
    if (m.clearcoat > 0)
        extend("KHR_materials_clearcoat",
               {{"clearcoatFactor", m.clearcoat}, {"clearcoatRoughnessFactor", m.clearcoat_roughness}});
    if (m.transmission > 0) extend("KHR_materials_transmission", {{"transmissionFactor", m.transmission}});
    return append("materials", std::move(json));
}

int Document::mesh(const std::string& name, std::vector<StreamedPart> parts) {
    Json primitives = Json::array();
    std::uint64_t triangles = 0;
    for (StreamedPart& part : parts) {
        const int positions = accessor(view(12 * part.vertices, kArrayBuffer, std::move(part.write_positions)), kFloat,
                                       "VEC3", part.vertices);
        json_["accessors"].back()["min"] = triple(part.lower);
        json_["accessors"].back()["max"] = triple(part.upper);
        const int normals = accessor(view(12 * part.vertices, kArrayBuffer, std::move(part.write_normals)), kFloat,
                                     "VEC3", part.vertices);
        const int indices = accessor(view(4 * part.indices, kElementArrayBuffer, std::move(part.write_indices)),
                                     kUnsignedInt, "SCALAR", part.indices);
        primitives.push_back({{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}},
                              {"indices", indices},
                              {"material", part.material}});
        triangles += part.indices / 3;
    }
    mesh_triangles_.push_back(triangles);
    return append("meshes", {{"name", name}, {"primitives", std::move(primitives)}});
}

int Document::mesh(const Mesh& mesh) {
    Json primitives = Json::array();
    for (const Part& part : mesh.parts) {
        const std::vector<Vertex>& vertices = part.vertices;
        const std::uint64_t count = vertices.size();
        Bounds bounds;
        for (const Vertex& v : vertices) bounds.add(vec3(v.position));
        const auto attribute = [&]<class T>(auto get, const char* type) {
            std::vector<T> data(count);
            std::transform(vertices.begin(), vertices.end(), data.begin(), get);
            return accessor(stored(std::move(data), kArrayBuffer), kFloat, type, count);
        };
        Json attributes;
        attributes["POSITION"] =
            attribute.template operator()<vec3>([](const Vertex& v) { return vec3(v.position); }, "VEC3");
        json_["accessors"].back()["min"] = triple(bounds.lower);
        json_["accessors"].back()["max"] = triple(bounds.upper);
        attributes["NORMAL"] =
            attribute.template operator()<vec3>([](const Vertex& v) { return vec3(v.normal); }, "VEC3");
        const Json& material = json_["materials"][static_cast<std::size_t>(part.material)];
        if (material.dump().find("Texture") != std::string::npos)
            attributes["TEXCOORD_0"] =
                attribute.template operator()<vec2>([](const Vertex& v) { return vec2(v.uv); }, "VEC2");
        if (!part.influences.empty()) {
            assert(part.influences.size() == count);
            std::vector<glm::u8vec4> joints;
            std::vector<vec4> weights;
            for (const Influence& i : part.influences) joints.emplace_back(i.joints), weights.push_back(i.weights);
            attributes["JOINTS_0"] = accessor(stored(std::move(joints), kArrayBuffer), kUnsignedByte, "VEC4", count);
            attributes["WEIGHTS_0"] = accessor(stored(std::move(weights), kArrayBuffer), kFloat, "VEC4", count);
        }
        const bool narrow = count < 65535;  // 65535 itself is the primitive restart value
        const std::uint64_t index_count = part.indices.size();
        const int indices_view =
            narrow ? stored(std::vector<std::uint16_t>(part.indices.begin(), part.indices.end()), kElementArrayBuffer)
                   : stored(part.indices, kElementArrayBuffer);
        const int indices = accessor(indices_view, narrow ? kUnsignedShort : kUnsignedInt, "SCALAR", index_count);
        primitives.push_back(
            {{"attributes", std::move(attributes)}, {"indices", indices}, {"material", part.material}});
    }
    mesh_triangles_.push_back(mesh.triangles());
    return append("meshes", {{"name", mesh.name}, {"primitives", std::move(primitives)}});
}

int Document::node(const std::string& name, int mesh, const dmat4& matrix) {
    Json node{{"name", name}, {"mesh", mesh}};
    dvec3 scale(glm::length(dvec3(matrix[0])), glm::length(dvec3(matrix[1])), glm::length(dvec3(matrix[2])));
    if (glm::determinant(dmat3(matrix)) < 0) scale.x = -scale.x;
    const dmat3 turn = dmat3(dvec3(matrix[0]) / scale.x, dvec3(matrix[1]) / scale.y, dvec3(matrix[2]) / scale.z);
    if (dvec3(matrix[3]) != dvec3(0)) node["translation"] = triple(dvec3(matrix[3]));
    if (turn != dmat3(1)) node["rotation"] = rotation(turn);
    if (scale != dvec3(1)) node["scale"] = triple(scale);
    triangles_ += mesh_triangles_[static_cast<std::size_t>(mesh)];
    return root_node(std::move(node));
}

int Document::node(const std::string& name, int mesh, const Skeleton& skeleton, const dmat4& matrix) {
    const std::size_t count = skeleton.joints.size(), keys = skeleton.seconds.size();
    assert(count > 0 && count <= 256 && keys > 0);
    const int times = accessor(stored(skeleton.seconds, 0), kFloat, "SCALAR", keys);
    json_["accessors"].back()["min"] = Json::array({skeleton.seconds.front()});
    json_["accessors"].back()["max"] = Json::array({skeleton.seconds.back()});
    Json joints = Json::array(), channels = Json::array(), samplers = Json::array();
    std::vector<mat4> bind;  // inverse bind matrices
    dvec3 at(0);
    // The root comes after its joints, because parents name the indices of their children.
    const std::size_t first = json_.contains("nodes") ? json_["nodes"].size() : 0;
    for (std::size_t j = 0; j < count; ++j) {
        const Joint& joint = skeleton.joints[j];
        assert(joint.turns.size() == keys);
        at += joint.offset;
        bind.emplace_back(move(-at.x, -at.y, -at.z));
        Json node{{"name", skeleton.name + " " + std::to_string(j)}, {"translation", triple(joint.offset)}};
        if (j + 1 < count) node["children"] = Json::array({first + j + 1});
        joints.push_back(append("nodes", std::move(node)));
        const int turns = accessor(stored(joint.turns, 0), kFloat, "VEC4", keys);
        samplers.push_back({{"input", times}, {"output", turns}});
        channels.push_back({{"sampler", j}, {"target", {{"node", first + j}, {"path", "rotation"}}}});
    }
    root_node({{"name", skeleton.name}, {"translation", triple(dvec3(matrix[3]))}, {"children", Json::array({first})}});
    append("animations",
           {{"name", skeleton.animation}, {"channels", std::move(channels)}, {"samplers", std::move(samplers)}});
    const int inverse = accessor(stored(std::move(bind), 0), kFloat, "MAT4", count);
    const int skin = append("skins", {{"name", skeleton.name}, {"inverseBindMatrices", inverse}, {"joints", joints}});
    triangles_ += mesh_triangles_[static_cast<std::size_t>(mesh)];
    return root_node({{"name", name}, {"mesh", mesh}, {"skin", skin}});
}

void Document::instances(const std::string& name, int mesh, std::vector<vec3> translations,
                         std::vector<vec4> rotations) {
    const char* const extension = "EXT_mesh_gpu_instancing";
    use(extension);
    json_["extensionsRequired"] = Json::array({extension});
    const std::uint64_t count = translations.size();
    triangles_ += count * mesh_triangles_[static_cast<std::size_t>(mesh)];
    const int t = accessor(stored(std::move(translations), 0), kFloat, "VEC3", count);
    const int r = accessor(stored(std::move(rotations), 0), kFloat, "VEC4", count);
    root_node({{"name", name},
               {"mesh", mesh},
               {"extensions", {{extension, {{"attributes", {{"TRANSLATION", t}, {"ROTATION", r}}}}}}}});
}

void Document::camera(const std::string& name, const dvec3& from, const dvec3& at, double vertical_fov, double aspect) {
    Json perspective{{"yfov", vertical_fov * kPi / 180}, {"znear", 0.01}};
    if (aspect > 0) perspective["aspectRatio"] = aspect;
    const int camera = append("cameras", {{"name", name}, {"type", "perspective"}, {"perspective", perspective}});
    const dvec3 back = glm::normalize(from - at), right = glm::normalize(glm::cross(dvec3(0, 1, 0), back));
    const dmat3 turn(right, glm::cross(back, right), back);
    root_node({{"name", name}, {"translation", triple(from)}, {"rotation", rotation(turn)}, {"camera", camera}});
}

void Document::sun(const std::string& name, const dvec3& toward, const dvec3& color, double lux) {
    use("KHR_lights_punctual");
    Json& lights = json_["extensions"]["KHR_lights_punctual"]["lights"];
    lights.push_back({{"name", name}, {"type", "directional"}, {"color", triple(color)}, {"intensity", lux}});
    const dvec3 back = glm::normalize(toward), right = glm::normalize(glm::cross(dvec3(0, 1, 0), back));
    const dmat3 turn(right, glm::cross(back, right), back);
    root_node({{"name", name},
               {"rotation", rotation(turn)},
               {"extensions", {{"KHR_lights_punctual", {{"light", lights.size() - 1}}}}}});
}

void Document::lamp(const std::string& name, const dvec3& at, const dvec3& color, double candela, double cone) {
    use("KHR_lights_punctual");
    Json& lights = json_["extensions"]["KHR_lights_punctual"]["lights"];
    Json lamp{{"name", name}, {"type", cone < 90 ? "spot" : "point"}, {"color", triple(color)}, {"intensity", candela}};
    if (cone < 90) lamp["spot"] = {{"innerConeAngle", 0.5 * cone * kPi / 180}, {"outerConeAngle", cone * kPi / 180}};
    lights.push_back(std::move(lamp));
    root_node({{"name", name},
               {"translation", triple(at)},
               {"rotation", rotation(dmat3(turn_x(-90)))},
               {"extensions", {{"KHR_lights_punctual", {{"light", lights.size() - 1}}}}}});
}

void Document::sky(const dvec3& radiance) {
    use("HALFLIGHT_environment");
    json_["extensions"]["HALFLIGHT_environment"]["color"] = triple(radiance);
}

std::uint64_t Document::triangles() const {
    return triangles_;
}

std::uint64_t Document::bytes() const {
    return bytes_;
}

void Document::write(const std::filesystem::path& path) const {
    Json complete = json_;
    if (complete["extensionsUsed"].empty()) complete.erase("extensionsUsed");
    complete["buffers"] = Json::array({{{"byteLength", bytes_}}});
    std::string text = complete.dump();
    text.resize(padded(text.size()), ' ');
    const std::uint64_t total = 12 + 8 + text.size() + 8 + bytes_;
    if (total > 0xFFFFFFFFULL) throw Error(path.string(), "needs {} bytes, more than the 4 GiB of one .glb", total);

    write_atomically(path, [&](const std::filesystem::path& temporary) {
        CheckedFile file(temporary, path.string());
        const auto words = [&](std::initializer_list<std::uint64_t> list) {
            for (const std::uint64_t value : list) {
                const auto word = static_cast<std::uint32_t>(value);
                file.write(&word, sizeof word);
            }
        };
        words({kMagic, 2, total, text.size(), kJson});
        file.write(text.data(), text.size());
        words({bytes_, kBin});
        for (const Chunk& chunk : chunks_) {
            [[maybe_unused]] const std::uint64_t start = file.tell();
            chunk.write(file);
            assert(file.tell() - start == chunk.bytes);
            const char zeros[4] = {};
            file.write(zeros, padded(chunk.bytes) - chunk.bytes);
        }
        file.close();
    });
}

}  // namespace halflight::scenes
