// The airliner's engines with their pylons, and its landing gear.
#include <cmath>

#include "tools/scenes/airliner.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {
namespace {

using enum AirlinerMaterial;

int index(AirlinerMaterial material) {
    return static_cast<int>(material);
}

/// A row of equal blades around the x axis.
struct Stage {
    std::string name;
    AirlinerMaterial material;
    double x, inner, outer;  // metres
    int blades;
    double root, tip;          // chords, metres
    double root_pitch, twist;  // degrees from the axis
    double fineness;           // share of the cells that a large blade has
};

void add_blade(MeshBuilder& mesh, const Stage& stage, const Detail& detail) {
    const auto cells = [&](double n, int least, int most) {
        return std::max(2, static_cast<int>(detail(n, least, most) * stage.fineness));
    };
    mesh.material(index(stage.material));
    surface(mesh, 2 * cells(8, 2, 60), cells(10, 2, 80), [&](double u, double v) {
        const double chord = glm::mix(stage.root, stage.tip, v), w = 2 * u - 1;  // around from one edge and back
        const double c = w * w, side = w < 0 ? 1 : -1;
        const double y = chord * (0.07 * side * std::sqrt(c) * (1 - c) + 0.12 * 4 * c * (1 - c));
        const dvec2 t = cos_sin_degrees(stage.root_pitch + stage.twist * v), p((c - 0.5) * chord, y);
        return dvec3(stage.x + t.x * p.x - t.y * p.y, glm::mix(stage.inner, stage.outer, v), t.y * p.x + t.x * p.y);
    });
}

/// Returns the blades of an engine, from front to rear.
std::vector<Stage> stages(const Detail& detail) {
    std::vector<Stage> result{{"fan blade", blade, 1.35, 0.39, 1.455, 22, 0.34, 0.52, 25, 35, 1},
                              {"guide vane", grey, 2.05, 0.80, 1.52, detail(90, 12, 46), 0.22, 0.22, -20, 15, 0.4}};
    for (int i = 0, count = detail(16, 2, 10); i < count; ++i)
        result.push_back({"compressor blade " + std::to_string(i), steel, 2.15 + 1.1 * (i + 0.5) / count, 0.31,
                          0.86 - 0.02 * i, detail(80, 8, 56), 0.05, 0.05, 30, 20, 0.3});
    for (int i = 0, count = detail(10, 1, 6); i < count; ++i)
        result.push_back({"turbine blade " + std::to_string(i), titanium, 3.75 + 0.15 * i, 0.37, 0.80 - 0.03 * i,
                          detail(80, 8, 64), 0.07, 0.06, -35, -15, 0.3});
    return result;
}

/// Adds one engine without its blades around the x axis; its inlet begins at x = 0.
void engine(MeshBuilder& mesh, const Detail& detail) {
    const int sides = detail(96, 12, 400);
    const auto turned = [&](AirlinerMaterial material, std::span<const dvec2> profile, int steps) {
        const Local axis(mesh, turn_z(-90));  // profiles are (radius, x)
        mesh.material(index(material));
        lathe(mesh, steps > 0 ? curve(profile, steps) : std::vector<dvec2>(profile.begin(), profile.end()), sides);
    };
    const int steps = detail(4, 1, 16);
    const dvec2 lip[] = {{1.47, 0.75}, {1.46, 0.35}, {1.52, 0.08}, {1.60, 0.0}, {1.68, 0.06}, {1.76, 0.3}};
    const dvec2 cowl[] = {{1.762, 0.304}, {1.86, 0.9}, {1.89, 1.7}, {1.82, 2.7}, {1.66, 3.6}, {1.52, 4.2}};
    const dvec2 duct_wall[] = {{1.515, 4.2}, {1.53, 3.6}, {1.56, 2.6}, {1.50, 1.75}, {1.47, 1.35}, {1.47, 0.752}};
    turned(aluminium, lip, steps), turned(white, cowl, steps), turned(titanium, duct_wall, steps);
    const dvec2 trailing[] = {{1.52, 4.2}, {1.515, 4.201}};
    turned(titanium, trailing, 0);
    const dvec2 spinner[] = {{0.0, 0.62}, {0.13, 0.70}, {0.26, 0.87}, {0.38, 1.12}, {0.40, 1.55}};
    const dvec2 core[] = {{0.62, 1.9}, {0.82, 2.1}, {0.92, 2.7}, {0.88, 3.6}, {0.74, 4.6}, {0.60, 5.2}};
    const dvec2 plug[] = {{0.40, 4.6}, {0.42, 5.0}, {0.30, 5.6}, {0.10, 6.2}, {0.0, 6.3}};
    const dvec2 shaft[] = {{0.30, 1.5}, {0.32, 2.2}, {0.38, 3.0}, {0.36, 3.8}, {0.40, 4.6}};
    turned(grey, spinner, steps), turned(titanium, core, steps), turned(titanium, plug, steps);
    turned(steel, shaft, steps);

    // Pipes and harnesses between the core and the duct's wall, with clamps and flanges.
    const int pipes = detail(40, 4, 60), pipe_sides = detail(8, 3, 40);
    Random random(90);
    for (int i = 0; i < pipes; ++i) {
        static constexpr AirlinerMaterial kMetals[] = {steel, titanium, copper, cable_black};
        const double from = random.in(0, 360), lean = random.in(-70, 70), out = 0.975 + 0.012 * (i % 5);
        const double x0 = random.in(2.3, 2.7), x1 = random.in(3.1, 3.5);
        std::vector<dvec3> path;
        for (int k = 0; k <= 6; ++k) {
            const dvec2 t = cos_sin_degrees(from + lean * k / 6);
            const double r = k == 0 || k == 6 ? 0.85 : out;
            path.emplace_back(glm::mix(x0, x1, k / 6.0), r * t.x, r * t.y);
        }
        mesh.material(index(kMetals[i % 4]));
        pipe(mesh, path, random.in(0.006, 0.018), pipe_sides, 0.06, detail(4, 1, 12));
    }
    mesh.material(index(steel));
    for (const double x : {2.45, 2.85, 3.3, 3.7}) {
        const Local axis(mesh, turn_z(-90));
        const dvec2 rim[] = {{0.85, x - 0.014}, {0.96, x - 0.012}, {0.96, x + 0.012}, {0.85, x + 0.014}};
        lathe(mesh, rim, sides);
        for (int i = 0, bolts = detail(40, 6, 96); i < bolts; ++i) {
            const dvec2 t = 0.943 * ring_of(bolts)[static_cast<std::size_t>(i)];
            for (const double end : {-1.0, 1.0})
                bolt(mesh, {t.x, x + end * 0.0125, t.y}, {0, end, 0}, 0.007, detail(5, 4, 20));
        }
    }
    mesh.material(index(aluminium));  // fasteners of the cowl
    for (const double x : {0.42, 2.3, 3.9})
        for (int i = 0, heads = detail(100, 12, 400); i < heads; ++i) {
            const dvec2 t = ring_of(heads)[static_cast<std::size_t>(i)];
            const double r = x < 1 ? 1.7885 : x < 3 ? 1.8585 : 1.589;
            rivet(mesh, {x, r * t.x, r * t.y}, {0, t.x, t.y}, 0.008, detail(5, 4, 12));
        }
}

/// Adds the pylon between the engine at the origin and the wing's lower side.
void pylon(MeshBuilder& mesh, const Detail& detail) {
    mesh.material(index(white));
    surface(mesh, 2 * detail(10, 3), detail(4, 1), [](double u, double v) {
        const double w = 2 * u - 1, c = w * w, side = w < 0 ? -1 : 1;
        const double front = glm::mix(1.0, 2.6, v), back = glm::mix(6.2, 8.2, v);
        const double wide = 0.9 * side * std::sqrt(c) * (1 - c);
        return dvec3(glm::mix(front, back, c), glm::mix(1.35, 2.35, v), wide);
    });
}

void wheel(MeshBuilder& mesh, const dvec3& at, double radius, double width, const Detail& detail) {
    const Local place(mesh, move(at.x, at.y, at.z) * turn_x(90));
    const double r = radius, w = width / 2;
    const dvec2 tyre[] = {{0.55 * r, -w},      {0.85 * r, -w}, {0.98 * r, -0.6 * w}, {r, 0},
                          {0.98 * r, 0.6 * w}, {0.85 * r, w},  {0.55 * r, w}};
    mesh.material(index(rubber));
    lathe(mesh, curve(tyre, detail(3, 1, 12)), detail(40, 8, 200));
    const dvec2 rim[] = {{0, -0.5 * w}, {0.2 * r, -0.5 * w}, {0.5 * r, -0.8 * w}, {0.56 * r, -0.95 * w}};
    mesh.material(index(aluminium));
    lathe(mesh, rim, detail(40, 8, 200));
    const Local other(mesh, turn_x(180));
    lathe(mesh, rim, detail(40, 8, 200));
}

void gear(MeshBuilder& mesh, const dvec3& hip, double radius, int axles, double track, const Detail& detail) {
    const int sides = detail(20, 4, 120);
    const double ground = -kAxisHeight + radius;
    mesh.material(index(white));
    rod(mesh, hip, {hip.x, ground + 0.9, hip.z}, 0.16, sides);
    mesh.material(index(steel));
    rod(mesh, {hip.x, ground + 1.0, hip.z}, {hip.x, ground, hip.z}, 0.11, sides);
    mesh.material(index(white));
    rod(mesh, {hip.x + 1.6, hip.y, hip.z * 0.8}, {hip.x, ground + 1.0, hip.z}, 0.06, sides);
    const double reach = 0.72 * (axles - 1) * 2 * radius / 1.3;
    if (axles > 1) rod(mesh, {hip.x - reach, ground, hip.z}, {hip.x + reach, ground, hip.z}, 0.12, sides, true);
    for (int i = 0; i < axles; ++i) {
        const double x = axles > 1 ? hip.x + reach * (2.0 * i / (axles - 1) - 1) : hip.x;
        mesh.material(index(steel));
        rod(mesh, {x, ground, hip.z - track}, {x, ground, hip.z + track}, 0.07, sides);
        for (const double side : {-1.0, 1.0})
            wheel(mesh, {x, ground, hip.z + side * track}, radius, 0.75 * radius, detail);
    }
    mesh.material(index(rubber));
    const dvec3 hose[] = {hip + dvec3(0.2, 0, 0),
                          {hip.x + 0.22, ground + 1.3, hip.z},
                          {hip.x + 0.35, ground + 0.6, hip.z},
                          {hip.x + 0.12, ground + 0.1, hip.z}};
    pipe(mesh, hose, 0.02, detail(8, 3), 0.2, detail(4, 1, 12));
}

}  // namespace

void add_engines(Assembly& airliner, const Detail& detail) {
    const auto add = [&](const std::string& name, auto build) { return airliner.add(name, maker(name, build)); };
    const std::uint32_t power = add("engine", [=](MeshBuilder& mesh) { engine(mesh, detail); });
    const std::uint32_t mount = add("pylon", [=](MeshBuilder& mesh) { pylon(mesh, detail); });
    const auto axis = [](double side) { return move(23.4, kAxisHeight - 3.05, side * 9.8); };
    for (const double side : {-1.0, 1.0})
        for (const std::uint32_t model : {power, mount}) airliner.place(model, axis(side));
    for (const Stage& stage : stages(detail)) {
        const std::uint32_t one = add(stage.name, [=](MeshBuilder& mesh) { add_blade(mesh, stage, detail); });
        for (const double side : {-1.0, 1.0})
            for (int i = 0; i < stage.blades; ++i) airliner.place(one, axis(side) * turn_x(360.0 * i / stage.blades));
    }
    const std::uint32_t gears = add("landing gear", [=](MeshBuilder& mesh) {
        gear(mesh, {6.6, -2.7, 0}, 0.52, 1, 0.38, detail);
        for (const double side : {-1.0, 1.0}) gear(mesh, {33.4, -1.9, side * 5.3}, 0.65, 3, 0.62, detail);
    });
    airliner.place(gears, move(0, kAxisHeight, 0));
}

}  // namespace halflight::scenes
