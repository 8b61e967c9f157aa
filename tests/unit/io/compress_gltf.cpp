#include "tests/unit/io/compress_gltf.h"

#include <draco/compression/expert_encode.h>
#include <meshoptimizer.h>

#include <cmath>
#include <map>

#include "engine/core/memory_ledger.h"

namespace halflight {
namespace {

std::size_t component_size(int type) {
    return type <= kU8 ? 1 : type <= kU16 ? 2 : 4;
}

int components(const Json& accessor) {
    return accessor["type"] == "SCALAR" ? 1 : accessor["type"].get<std::string>()[3] - '0';
}

/// Returns the elements of an accessor of its own buffer view, and their stride in bytes.
std::pair<std::string, std::size_t> elements(const GltfBuilder& b, int accessor) {
    const Json& a = b.json["accessors"][accessor];
    const Json& view = b.json["bufferViews"][a["bufferView"].get<int>()];
    const std::size_t packed = component_size(a["componentType"]) * static_cast<std::size_t>(components(a));
    return {b.bytes().substr(view["byteOffset"], view["byteLength"]), view.value("byteStride", packed)};
}

std::vector<std::uint32_t> indices(const GltfBuilder& b, int accessor) {
    const auto [bytes, size] = elements(b, accessor);
    std::vector<std::uint32_t> values(bytes.size() / size);
    for (std::size_t i = 0; i < values.size(); ++i) std::memcpy(&values[i], &bytes[i * size], size);
    return values;
}

draco::DataType data_type(int component_type) {
    static const std::map<int, draco::DataType> types = {{kI8, draco::DT_INT8},    {kU8, draco::DT_UINT8},
                                                         {kI16, draco::DT_INT16},  {kU16, draco::DT_UINT16},
                                                         {kU32, draco::DT_UINT32}, {kF32, draco::DT_FLOAT32}};
    return types.at(component_type);
}

draco::GeometryAttribute::Type attribute_type(const std::string& name) {
    if (name == "POSITION") return draco::GeometryAttribute::POSITION;
    if (name == "NORMAL") return draco::GeometryAttribute::NORMAL;
    if (name == "COLOR_0") return draco::GeometryAttribute::COLOR;
    return name.starts_with("TEXCOORD") ? draco::GeometryAttribute::TEX_COORD : draco::GeometryAttribute::GENERIC;
}

}  // namespace

Json& add_grid(GltfBuilder& b, int n) {
    std::vector<float> positions, normals, uvs;
    std::vector<std::uint16_t> corners;
    for (int y = 0; y <= n; ++y)
        for (int x = 0; x <= n; ++x) {
            const auto u = static_cast<float>(x), v = static_cast<float>(y);
            const vec3 normal = glm::normalize(vec3(-std::cos(u), 0, 1));
            positions.insert(positions.end(), {u, v, std::sin(u)});
            normals.insert(normals.end(), {normal.x, normal.y, normal.z});
            uvs.insert(uvs.end(), {u / static_cast<float>(n), v / static_cast<float>(n)});
            const auto corner = static_cast<std::uint16_t>(y * (n + 1) + x), above = static_cast<std::uint16_t>(n + 1);
            if (x == n || y == n) continue;
            for (const int i : {0, 1, above + 1, 0, above + 1, static_cast<int>(above)})
                corners.push_back(static_cast<std::uint16_t>(corner + i));
        }
    Json& primitive = b.add_mesh({{"POSITION", b.floats("VEC3", positions)},
                                  {"NORMAL", b.floats("VEC3", normals)},
                                  {"TEXCOORD_0", b.floats("VEC2", uvs)}});
    primitive["indices"] = b.accessor("SCALAR", kU16, corners);
    return primitive;
}

Json& compress_by_meshopt(GltfBuilder& b, int accessor, const char* mode, const std::string& data,
                          const char* extension) {
    const std::string kind = mode;
    auto [bytes, stride] = elements(b, accessor);
    if (!data.empty()) bytes = data;
    const std::size_t count = bytes.size() / stride;
    std::vector<unsigned char> to;
    if (kind == "ATTRIBUTES") {
        to.resize(meshopt_encodeVertexBufferBound(count, stride));
        to.resize(meshopt_encodeVertexBuffer(to.data(), to.size(), bytes.data(), count, stride));
    } else {
        const std::vector<std::uint32_t> from = indices(b, accessor);
        const bool triangles = kind == "TRIANGLES";
        to.resize(triangles ? meshopt_encodeIndexBufferBound(count, 1 << 16)
                            : meshopt_encodeIndexSequenceBound(count, 1 << 16));
        to.resize(triangles ? meshopt_encodeIndexBuffer(to.data(), to.size(), from.data(), count)
                            : meshopt_encodeIndexSequence(to.data(), to.size(), from.data(), count));
    }
    const Json encoded = b.json["bufferViews"][b.view(to)];
    b.json["bufferViews"].erase(b.json["bufferViews"].size() - 1);
    Json& view = b.json["bufferViews"][b.json["accessors"][accessor]["bufferView"].get<int>()];
    view.update({{"buffer", 1}, {"byteLength", bytes.size()}});
    Json& object = view["extensions"][extension];
    object = encoded;
    object.update({{"mode", mode}, {"byteStride", stride}, {"count", count}});
    return object;
}

void add_meshopt_buffers(GltfBuilder& b) {
    b.add_buffer();
    b.push("buffers",
           {{"byteLength", b.bytes().size()}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
    b.require({"EXT_meshopt_compression"});
}

void compress_by_draco(GltfBuilder& b, Json& primitive, const DracoEncoding& encoding) {
    draco::Mesh mesh;
    const std::vector<std::uint32_t> corners = indices(b, primitive["indices"]);
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
        mesh.AddFace(
            {draco::PointIndex(corners[i]), draco::PointIndex(corners[i + 1]), draco::PointIndex(corners[i + 2])});
    Json ids = Json::object();
    for (const auto& [name, index] : primitive["attributes"].items()) {
        const Json& accessor = b.json["accessors"][index.get<int>()];
        const auto [bytes, stride] = elements(b, index);
        const auto count = static_cast<std::uint32_t>(bytes.size() / stride);
        draco::GeometryAttribute attribute;
        attribute.Init(attribute_type(name), nullptr, static_cast<std::uint8_t>(components(accessor)),
                       data_type(accessor["componentType"]), accessor.value("normalized", false),
                       static_cast<std::int64_t>(stride), 0);
        mesh.set_num_points(count);
        const int place = mesh.AddAttribute(attribute, true, count);
        for (std::uint32_t i = 0; i < count; ++i)
            mesh.attribute(place)->SetAttributeValue(draco::AttributeValueIndex(i), &bytes[i * stride]);
        mesh.attribute(place)->set_unique_id(7 - static_cast<std::uint32_t>(place));
        ids[name] = 7 - place;
    }
    for (int i = 0; i < encoding.unused; ++i) {
        draco::GeometryAttribute attribute;
        attribute.Init(draco::GeometryAttribute::GENERIC, nullptr, 4, draco::DT_INT32, false, 16, 0);
        const int place = mesh.AddAttribute(attribute, true, mesh.num_points());
        mesh.attribute(place)->set_unique_id(100 + static_cast<std::uint32_t>(i));
    }
    ASSERT_TRUE(!encoding.share || mesh.DeduplicateAttributeValues());
    if (encoding.metadata) {
        auto metadata = std::make_unique<draco::GeometryMetadata>();
        metadata->AddEntryString("name", "grid");
        auto child = std::make_unique<draco::Metadata>();
        child->AddEntryInt("number", 3);
        metadata->AddSubMetadata("child", std::move(child));
        mesh.AddMetadata(std::move(metadata));
        auto own = std::make_unique<draco::AttributeMetadata>();
        own->AddEntryString("of", "an attribute");
        mesh.AddAttributeMetadata(0, std::move(own));
    }
    draco::ExpertEncoder encoder(mesh);
    encoder.SetSpeedOptions(encoding.speed, encoding.speed);
    encoder.SetTrackEncodedProperties(true);
    encoder.SetEncodingMethod(encoding.edgebreaker ? draco::MESH_EDGEBREAKER_ENCODING
                                                   : draco::MESH_SEQUENTIAL_ENCODING);
    for (int i = 0; i < mesh.num_attributes(); ++i)
        if (encoding.bits > 0 && mesh.attribute(i)->data_type() == draco::DT_FLOAT32)
            encoder.SetAttributeQuantization(i, encoding.bits);
    draco::EncoderBuffer encoded;
    const draco::Status status = encoder.EncodeToBuffer(&encoded);
    ASSERT_TRUE(status.ok()) << status.error_msg();
    primitive["extensions"]["KHR_draco_mesh_compression"] = {
        {"bufferView", b.view(std::vector<char>(encoded.data(), encoded.data() + encoded.size()))},
        {"attributes", ids}};
    for (const auto& [name, index] : primitive["attributes"].items()) {
        Json& accessor = b.json["accessors"][index.get<int>()];
        accessor.erase("bufferView");
        accessor["count"] = encoder.num_encoded_points();
    }
    Json& accessor = b.json["accessors"][primitive["indices"].get<int>()];
    accessor.erase("bufferView");
    accessor["count"] = 3 * encoder.num_encoded_faces();
    b.require({"KHR_draco_mesh_compression"});
}

std::string refusal_with_memory(const std::filesystem::path& path, std::size_t bytes) {
    GltfScene scene(path);
    MemoryLedger& memory = MemoryLedger::process();
    const std::size_t limit = memory.limit();
    memory.set_limit(limit - memory.free() + bytes);
    const std::string message = error_message([&] { scene.at_rest(); });
    memory.set_limit(limit);
    return message;
}

}  // namespace halflight
