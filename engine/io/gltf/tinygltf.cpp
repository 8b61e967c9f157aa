#include <fstream>  // tinygltf's writer needs it, and includes it only with its access to files

#define TINYGLTF_IMPLEMENTATION
#include "engine/io/gltf/tinygltf.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/core/error.h"
#include "engine/scene/material.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

/// Members of accessors that tinygltf refuses, although glTF allows them or nothing may read them. They are indices
/// without a buffer view, whose data Draco decodes, and unknown component types.
struct Unusual {
    std::size_t accessor = 0;
    int buffer_view = kNone, component_type = 0;
};

/// Replaces the unusual members, and adds the view that they get to the list of buffer views.
std::vector<Unusual> replace_unusual(Json& root) {
    std::vector<Unusual> unusual;
    Json& accessors = root["accessors"];  // null: none
    Json& views = root["bufferViews"];
    for (std::size_t i = 0; i < accessors.size(); ++i) {
        Json& accessor = accessors[i];
        const int type = accessor["componentType"];
        const bool known = type >= TINYGLTF_COMPONENT_TYPE_BYTE && type <= TINYGLTF_COMPONENT_TYPE_FLOAT;
        if (known && accessor.contains("bufferView")) continue;
        unusual.push_back({i, accessor.value("bufferView", kNone), type});
        accessor["componentType"] = TINYGLTF_COMPONENT_TYPE_FLOAT;
        accessor["bufferView"] = views.size();
    }
    views.push_back({{"buffer", 0}, {"byteLength", 1}});
    return unusual;
}

/// Lets tinygltf read a file, or a part of it.
tinygltf::Model parse(Json root, const std::string& file) {
    const std::string text = std::exchange(root, nullptr).dump();
    if (text.size() > std::numeric_limits<unsigned>::max())
        throw Error(file, "has {} bytes of JSON without buffers and materials, more than tinygltf reads", text.size());
    tinygltf::Model model;
    tinygltf::TinyGLTF reader;
    std::string error, warning;
    if (!reader.LoadASCIIFromString(&model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), "", 0)) {
        std::ranges::replace(error, '\n', ' ');
        throw Error(file, "cannot be read by tinygltf: {}", error);
    }
    return model;
}

/// Reads nodes, which it takes out of the JSON. Nodes refer to others by index only. tinygltf 2.9 has no way to reserve
/// a list, and a list that grows takes twice its memory, so a long one is read in pieces.
std::vector<tinygltf::Node> take_nodes(Json& root, const std::string& file) {
    constexpr std::size_t kPiece = 65536;
    Json from = std::move(root["nodes"]);  // null: none
    root.erase("nodes");
    std::vector<tinygltf::Node> nodes;
    nodes.reserve(from.size());
    for (std::size_t first = 0; first < from.size(); first += kPiece) {
        Json piece = Json::array();
        for (std::size_t i = first; i < std::min(first + kPiece, from.size()); ++i) piece.push_back(std::move(from[i]));
        std::ranges::move(parse({{"nodes", std::move(piece)}}, file).nodes, std::back_inserter(nodes));
    }
    return nodes;
}

}  // namespace

tinygltf::Model to_model(Json root, const std::string& file) {
    const std::vector<Unusual> unusual = replace_unusual(root);
    std::vector<tinygltf::Node> nodes = take_nodes(root, file);
    tinygltf::Model model = parse(std::move(root), file);
    model.nodes = std::move(nodes);
    for (const Unusual& u : unusual) {
        model.accessors[u.accessor].bufferView = u.buffer_view;
        model.accessors[u.accessor].componentType = u.component_type;
    }
    model.bufferViews.pop_back();
    return model;
}

}  // namespace halflight
