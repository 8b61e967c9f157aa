// The objects of a glTF file as plain values. Members have the names and defaults of glTF 2.0, section 5.
#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/material.h"

namespace halflight::gltf {

// Component types of accessors.
constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
              kFloat = 5126;
// Modes of primitives.
constexpr int kPoints = 0, kLines = 1, kLineLoop = 2, kLineStrip = 3, kTriangles = 4, kTriangleStrip = 5,
              kTriangleFan = 6;
// Filters and wrap modes of samplers.
constexpr int kNearest = 9728, kRepeat = 10497, kClampToEdge = 33071, kMirroredRepeat = 33648;

using Attributes = std::map<std::string, int>;  // index of the accessor, by semantic

struct Accessor {
    struct Indices {
        int bufferView = kNone;
        std::size_t byteOffset = 0;
        int componentType = 0;
    };
    struct Values {
        int bufferView = kNone;
        std::size_t byteOffset = 0;
    };
    struct Sparse {
        std::size_t count = 0;  // 0: the accessor is not sparse
        Indices indices;
        Values values;
    };
    int bufferView = kNone;
    std::size_t byteOffset = 0;
    int componentType = 0;
    std::size_t count = 0;
    bool normalized = false;
    Sparse sparse;
    std::string type;
};

struct BufferView {
    int buffer = kNone;
    std::size_t byteLength = 0;
    std::size_t byteOffset = 0;
    std::size_t byteStride = 0;  // 0: elements are packed
};

struct Camera {
    struct Orthographic {
        double xmag = 0, ymag = 0, zfar = 0, znear = 0;
    };
    struct Perspective {
        double aspectRatio = 0;  // 0: that of the picture
        double yfov = 0;
        double zfar = 0;  // 0: infinite
        double znear = 0;
    };
    std::string name, type;
    Orthographic orthographic;
    Perspective perspective;
};

/// A light of KHR_lights_punctual.
struct Light {
    struct Spot {
        double innerConeAngle = 0;
        double outerConeAngle = 0.7853981634;
    };
    std::vector<double> color;  // empty: white
    double intensity = 1;
    std::string name, type;
    Spot spot;
};

struct Primitive {
    Attributes attributes;
    nlohmann::json extensions;
    int indices = kNone;
    int material = kNone;
    int mode = kTriangles;
    std::vector<Attributes> targets;
};

struct Mesh {
    std::string name;
    std::vector<Primitive> primitives;
    std::vector<double> weights;
};

struct Node {
    int camera = kNone;
    std::vector<int> children;
    nlohmann::json extensions;
    int mesh = kNone;
    std::string name;
    int skin = kNone;
    std::vector<double> matrix, rotation, scale, translation, weights;  // empty: the default
};

struct Sampler {
    int magFilter = kNone;
    int wrapS = kRepeat, wrapT = kRepeat;
};

struct Scene {
    std::vector<int> nodes;
};

struct Skin {
    int inverseBindMatrices = kNone;
    std::vector<int> joints;
    std::string name;
};

struct Texture {
    nlohmann::json extensions;
    int sampler = kNone;
    int source = kNone;
};

struct Model {
    std::vector<Accessor> accessors;
    std::vector<BufferView> bufferViews;
    std::vector<Camera> cameras;
    nlohmann::json extensions;  // without lights
    std::vector<Light> lights;
    std::vector<Mesh> meshes;
    std::vector<Node> nodes;
    std::vector<Sampler> samplers;
    int scene = kNone;
    std::vector<Scene> scenes;
    std::vector<Skin> skins;
    std::vector<Texture> textures;
};

/// Converts a file that has passed check_gltf(), and frees its parts on the way.
Model to_model(nlohmann::json root);

/// Returns the number of components of an accessor's type; 0 for unknown types.
int component_count(std::string_view type);

/// Returns the object `key` of `extensions`, or null.
inline const nlohmann::json* find_extension(const nlohmann::json& extensions, const char* key) {
    const auto found = extensions.find(key);
    return found == extensions.end() ? nullptr : &*found;
}

}  // namespace halflight::gltf
