// An eel that swims: one skinned mesh of any size, for measuring the cost of deforming meshes.
#include "tools/scenes/exact.h"
#include "tools/scenes/scenes.h"

namespace halflight::scenes {
namespace {

constexpr double kLength = 4, kRadius = 0.22, kHeight = 0.6;  // metres; kHeight is above the floor
constexpr int kJoints = 12;
constexpr int kFrames = 48, kFramesPerSecond = 24;  // frames of one stroke, which repeats
constexpr double kSway = 0.2;                       // greatest angle between neighbours, radians
constexpr double kWaves = 1.5;                      // number of waves along the body

/// Returns the two joints that a point of the body follows, and their weights. z: from -kLength / 2, the head.
Influence influence(double z) {
    const double along = std::clamp((z / kLength + 0.5) * kJoints - 0.5, 0.0, kJoints - 1.0);
    const int first = std::min(static_cast<int>(along), kJoints - 2);
    const auto second = static_cast<float>(along - first);
    return {{first, first + 1, 0, 0}, {1 - second, second, 0, 0}};
}

/// Makes a spheroid of `sides` meridians and `rings` bands, 2 sides (rings - 1) triangles; joint 0 is at the head.
Mesh body(int sides, int rings, int skin) {
    Part part;
    part.material = skin;
    const auto add = [&](double latitude, double longitude) {
        const double s = sine(latitude), c = -cosine(latitude);
        const dvec3 on(s * cosine(longitude), s * sine(longitude), c);
        const dvec3 position = dvec3(kRadius, kRadius, kLength / 2) * on;
        const dvec3 normal = glm::normalize(on / dvec3(kRadius, kRadius, kLength / 2));
        part.vertices.push_back({position, normal, {}});
        part.influences.push_back(influence(position.z));
    };
    add(0, 0);
    for (int ring = 1; ring < rings; ++ring)
        for (int side = 0; side < sides; ++side) add(kPi * ring / rings, 2 * kPi * side / sides);
    add(kPi, 0);
    const auto at = [&](int ring, int side) {
        if (ring == 0) return std::uint32_t{0};
        if (ring == rings) return static_cast<std::uint32_t>(part.vertices.size() - 1);
        return static_cast<std::uint32_t>(1 + (ring - 1) * sides + side % sides);
    };
    const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        part.indices.insert(part.indices.end(), {a, b, c});
    };
    for (int ring = 0; ring < rings; ++ring) {
        for (int side = 0; side < sides; ++side) {
            if (ring > 0) triangle(at(ring, side), at(ring, side + 1), at(ring + 1, side));
            if (ring < rings - 1) triangle(at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side));
        }
    }
    return {"eel", {std::move(part)}};
}

/// Makes a wave that runs from head to tail: each joint turns a little later than the one before it.
Skeleton swimming() {
    Skeleton skeleton{.name = "spine", .animation = "swim", .joints = {}, .seconds = {}};
    for (int frame = 0; frame <= kFrames; ++frame)
        skeleton.seconds.push_back(static_cast<float>(frame) / kFramesPerSecond);
    for (int joint = 0; joint < kJoints; ++joint) {
        const double z = kLength * ((joint + 0.5) / kJoints - 0.5), z_before = z - kLength / kJoints;
        Joint made{joint == 0 ? dvec3(0, 0, z) : dvec3(0, 0, z - z_before), {}};
        for (int frame = 0; frame <= kFrames; ++frame) {
            const double phase = 2 * kPi * (double(frame % kFrames) / kFrames - kWaves * joint / kJoints);
            const double half = 0.5 * kSway * sine(phase);
            made.turns.emplace_back(0, sine(half), 0, cosine(half));
        }
        skeleton.joints.push_back(std::move(made));
    }
    return skeleton;
}

}  // namespace

Document eel(std::uint64_t triangles) {
    // In the middle of the body, bands are as wide as they are long.
    const double across = 2 * kPi * kRadius / kLength;
    const int sides = std::max(3, static_cast<int>(std::sqrt(0.5 * static_cast<double>(triangles) * across)));
    const int rings = std::max(2, static_cast<int>(triangles / (2 * static_cast<std::uint64_t>(sides))) + 1);
    Document document("eel");
    const int skin = document.material(glossy("skin", {0.25, 0.3, 0.22}, 0.35));
    const int sand = document.material(matte("sand", {0.6, 0.52, 0.4}));
    const Skeleton skeleton = swimming();
    document.node("eel", document.mesh(body(sides, rings, skin)), skeleton, move(0, kHeight, 0));
    MeshBuilder floor("floor");
    floor.material(sand).quad({-8, 0, 8}, {8, 0, 8}, {8, 0, -8}, {-8, 0, -8});
    document.node("floor", document.mesh(floor.take()));
    document.camera("camera", {4.2, 2.6, 2.4}, {0, 0.4, 0}, 38, 16.0 / 9);
    document.sun("sun", {0.5, 1, 0.3}, {1, 0.95, 0.85}, 3);
    document.sky({0.35, 0.42, 0.5});
    return document;
}

}  // namespace halflight::scenes
