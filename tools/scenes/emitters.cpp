// A hall with any number of small lamps, for measuring the selection of lights.
#include "engine/core/error.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/scenes.h"

namespace halflight::scenes {
namespace {

constexpr double kSide = 60, kHeight = 8;              // metres
constexpr double kLowest = 3.2;                        // lowest height of a lamp, metres; everything else is below
constexpr int kKinds = 16;                             // number of lamps' kinds, by radiance and colour
constexpr double kDecades = 2;                         // decades between the dimmest and the brightest kind
constexpr double kLeastEdge = 0.05, kMostEdge = 0.25;  // edges of a lamp, metres
constexpr double kRadianceTimesArea = 4000;            // approximate sum over all lamps
constexpr int kBlockTriangles = 10;                    // a box without its bottom
constexpr std::uint64_t kShellTriangles = 12;

double power_of_ten(double exponent) {
    // Squares and roots round equally on all machines.
    double value = 1, factor = 10;
    const double whole = std::floor(exponent);
    for (double e = whole; e > 0; --e) value *= 10;
    for (double e = whole; e < 0; ++e) value /= 10;
    for (double rest = exponent - whole, bit = 0.5; bit > 1e-9; bit /= 2) {
        factor = std::sqrt(factor);
        if (rest >= bit) value *= factor, rest -= bit;
    }
    return value;
}

dvec3 direction(Random& random) {
    const double y = random.in(-1, 1), turn = random.in(0, 2 * kPi), r = std::sqrt(1 - y * y);
    return {r * cosine(turn), y, r * sine(turn)};
}

/// Adds a square that shines on both sides.
void add_lamp(MeshBuilder& mesh, Random& random) {
    const dvec3 normal = direction(random);
    const dvec3 side = glm::normalize(glm::cross(normal, std::abs(normal.y) < 0.9 ? dvec3(0, 1, 0) : dvec3(1, 0, 0)));
    const double half = 0.5 * random.in(kLeastEdge, kMostEdge);
    const dvec3 u = half * side, v = half * glm::cross(normal, side);
    constexpr double kAway = kMostEdge;  // distance from walls and ceiling, metres
    const dvec3 at(random.in(kAway, kSide - kAway), random.in(kLowest, kHeight - kAway),
                   random.in(kAway, kSide - kAway));
    mesh.quad(at - u - v, at + u - v, at + u + v, at - u + v);
}

Mesh lamps(int count, const std::vector<int>& kinds) {
    MeshBuilder mesh("lamps");
    Random random(71);
    for (int i = 0; i < count; ++i) {
        mesh.material(kinds[static_cast<std::size_t>(random.below(kKinds))]);
        add_lamp(mesh, random);
    }
    return mesh.take();
}

Mesh shell(int walls, int floor) {
    MeshBuilder mesh("hall");
    constexpr double s = kSide, h = kHeight;
    mesh.material(floor).quad({0, 0, s}, {s, 0, s}, {s, 0, 0}, {0, 0, 0});
    mesh.material(walls).quad({0, h, 0}, {s, h, 0}, {s, h, s}, {0, h, s});
    mesh.quad({0, 0, 0}, {s, 0, 0}, {s, h, 0}, {0, h, 0});
    mesh.quad({s, 0, s}, {0, 0, s}, {0, h, s}, {s, h, s});
    mesh.quad({0, 0, s}, {0, 0, 0}, {0, h, 0}, {0, h, s});
    mesh.quad({s, 0, 0}, {s, 0, s}, {s, h, s}, {s, h, 0});
    return mesh.take();
}

/// Makes crates on the floor, and cloth of all remaining triangles.
Mesh clutter(std::uint64_t triangles, const std::vector<int>& materials) {
    MeshBuilder mesh("clutter");
    Random random(72);
    const auto some_material = [&] {
        return materials[static_cast<std::size_t>(random.below(static_cast<int>(materials.size())))];
    };
    for (; triangles >= kBlockTriangles; triangles -= kBlockTriangles) {
        const double x = random.in(0.5, kSide - 0.5), z = random.in(0.5, kSide - 0.5);
        const double a = random.in(0.05, 0.4), b = random.in(0.05, 0.4), high = random.in(0.1, 2.5);
        mesh.material(some_material());
        mesh.frame(move(x, 0, z) * turn_y(random.in(0, 90))).box({-a, 0, -b}, {a, high, b}, MeshBuilder::kBottom);
    }
    for (; triangles > 0; --triangles) {
        mesh.material(some_material()).frame(move(random.in(1, kSide - 1), random.in(1, 2), random.in(1, kSide - 1)));
        const dvec3 normal(0, 0, 1);
        const std::uint32_t a = mesh.vertex({{0, 0, 0}, normal, {}}), b = mesh.vertex({{0.5, 0, 0}, normal, {}}),
                            c = mesh.vertex({{0, 0.5, 0}, normal, {}});
        mesh.triangle(a, b, c);
    }
    return mesh.take();
}

}  // namespace

Document emitters(int lights, std::uint64_t triangles) {
    const std::uint64_t own = kShellTriangles + 2 * static_cast<std::uint64_t>(lights);
    if (triangles == 0) triangles = own + 10'000;
    if (triangles < own)
        throw Error("emitters", "{} lights in a hall are {} triangles, more than {}", lights, own, triangles);
    Document document("emitters");
    const int walls = document.material(matte("walls", {0.6, 0.58, 0.55}));
    const int floor = document.material(matte("floor", {0.45, 0.42, 0.4}));
    const std::vector<int> wares{document.material(matte("wood", {0.5, 0.35, 0.2})),
                                 document.material(matte("paint", {0.2, 0.35, 0.5})),
                                 document.material(matte("paper", {0.8, 0.78, 0.75})),
                                 document.material(glossy("varnish", {0.4, 0.15, 0.1}, 0.3))};
    document.node("hall", document.mesh(shell(walls, floor)));
    if (triangles > own) document.node("clutter", document.mesh(clutter(triangles - own, wares)));

    constexpr double kMeanArea =
        (kLeastEdge * kLeastEdge + kLeastEdge * kMostEdge + kMostEdge * kMostEdge) / 3;  // edges are uniform
    double mean = 0;
    std::vector<double> radiances;
    for (int k = 0; k < kKinds; ++k) {
        radiances.push_back(power_of_ten(kDecades * k / (kKinds - 1)));
        mean += radiances.back() / kKinds;
    }
    std::vector<int> kinds;
    for (int k = 0; k < kKinds; ++k) {
        static constexpr dvec3 kTints[] = {{1, 0.9, 0.75}, {0.8, 0.9, 1}, {1, 0.7, 0.5}};
        const double radiance =
            radiances[static_cast<std::size_t>(k)] / mean * kRadianceTimesArea / (kMeanArea * std::max(lights, 1));
        kinds.push_back(document.material(light("lamp " + std::to_string(k), radiance * kTints[k % 3])));
    }
    document.node("lamps", document.mesh(lamps(lights, kinds)));
    // The camera is below all lamps and looks down, so it shows lit surfaces and no lamp.
    document.camera("camera", {20, 2.9, 50}, {26.5, 0, 44.5}, 25, 16.0 / 9);
    return document;
}

}  // namespace halflight::scenes
