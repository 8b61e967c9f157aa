// Fuzzes the decoders of compressed geometry alone, since most mutations of whole scenes do not reach them.
#include <cstring>
#include <nlohmann/json.hpp>

#include "engine/io/gltf/draco.h"
#include "engine/io/gltf/meshopt.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

/// Takes an unsigned number from the start of the input; 0 at its end.
template <class T>
T take(std::string_view& input) {
    T value = 0;
    if (input.size() < sizeof value) return value;
    std::memcpy(&value, input.data(), sizeof value);
    input.remove_prefix(sizeof value);
    return value;
}

void limit_memory() {
    MemoryLedger::process().set_limit(kProgramBytes + (std::size_t{256} << 20));
}

}  // namespace

void draco(std::string_view input) {
    const auto vertices = take<std::uint16_t>(input), indices = take<std::uint16_t>(input);
    GltfDocument document;
    document.file = "scene";
    for (const int type : {TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC2, TINYGLTF_TYPE_SCALAR}) {
        tinygltf::Accessor& accessor = document.model.accessors.emplace_back();
        accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
        accessor.type = type;
        accessor.count = type == TINYGLTF_TYPE_SCALAR ? indices : vertices;
    }
    tinygltf::BufferView& view = document.model.bufferViews.emplace_back();
    view.buffer = 0;
    view.byteLength = input.size();
    document.buffers.emplace_back(std::string(input));
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.indices = 3;
    primitive.attributes = {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}};
    using tinygltf::Value;
    const Value::Object attributes{{"POSITION", Value(6)}, {"NORMAL", Value(7)}, {"TEXCOORD_0", Value(5)}};
    primitive.extensions["KHR_draco_mesh_compression"] =
        Value(Value::Object{{"bufferView", Value(0)}, {"attributes", Value(attributes)}});
    limit_memory();
    check_errors("scene: ", [&] {
        const auto mesh = decode_draco(document, primitive, "primitive");
        for (const auto& [accessor, elements] : mesh->accessors)
            for (const std::uint32_t index : mesh->indices)
                if (index >= elements.count) throw Broken("an index is out of range");
    });
}

void meshopt(std::string_view input) {
    const char* const modes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
    const char* const filters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"};
    const auto mode = take<std::uint8_t>(input) % 3u, filter = take<std::uint8_t>(input) % 5u;
    const auto stride = take<std::uint8_t>(input);
    const auto count = take<std::uint16_t>(input);
    nlohmann::json view{{"byteLength", std::size_t{count} * stride}};
    view["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},          {"byteLength", input.size()},
                                                     {"byteStride", stride}, {"count", count},
                                                     {"mode", modes[mode]},  {"filter", filters[filter]}};
    limit_memory();
    check_errors("view", [&] {
        const GltfMeshoptView compressed = *read_meshopt_view(view, "view");
        compressed.check_length(input.empty() ? 0 : static_cast<unsigned char>(input[0]), "view");
        if (compressed.decode(input, "view").size() != compressed.size()) throw Broken("the size is wrong");
    });
}

}  // namespace halflight::fuzz
