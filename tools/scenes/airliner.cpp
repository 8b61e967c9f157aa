#include "tools/scenes/airliner.h"

namespace halflight::scenes {
namespace {

std::vector<Material> airliner_materials() {
    const auto paint = [](const char* name, const dvec3& color) {
        Material material = glossy(name, color, 0.4);
        material.clearcoat = 1, material.clearcoat_roughness = 0.08;
        return material;
    };
    return {paint("white paint", {0.80, 0.80, 0.79}),
            paint("grey paint", {0.40, 0.42, 0.44}),
            paint("blue paint", {0.03, 0.09, 0.30}),
            glossy("cockpit glass", {0.01, 0.012, 0.015}, 0.05),
            matte("zinc primer", {0.42, 0.48, 0.16}),
            metal("aluminium", {0.80, 0.81, 0.82}, 0.35),
            metal("steel", {0.45, 0.45, 0.46}, 0.4),
            metal("titanium", {0.42, 0.39, 0.36}, 0.35),
            metal("copper", {0.72, 0.42, 0.28}, 0.3),
            matte("duct", {0.66, 0.65, 0.60}),
            glossy("white cable", dvec3(0.70), 0.5),
            glossy("black cable", dvec3(0.03), 0.5),
            glossy("orange cable", {0.70, 0.22, 0.03}, 0.5),
            matte("rubber", dvec3(0.025)),
            glossy("lining", {0.74, 0.72, 0.68}, 0.55),
            matte("floor panel", {0.45, 0.42, 0.30}),
            matte("carpet", {0.07, 0.09, 0.16}),
            matte("blue cloth", {0.05, 0.13, 0.32}),
            matte("violet cloth", {0.16, 0.07, 0.26}),
            glossy("leather", {0.62, 0.58, 0.50}, 0.5),
            glossy("plastic", {0.35, 0.36, 0.38}, 0.4),
            glossy("screen", dvec3(0.01), 0.1),
            glossy("belt", {0.10, 0.10, 0.11}, 0.6),
            light("light strip", {6, 5.6, 5.0}),
            metal("blade", {0.60, 0.60, 0.62}, 0.25),
            glossy("apron", {0.20, 0.20, 0.195}, 0.85),
            matte("marking", {0.62, 0.48, 0.08})};
}

void add_views(Document& document, const Bounds&) {
    MeshBuilder apron("apron");
    constexpr double kFar = 250, kMiddle = 30;
    apron.material(static_cast<int>(AirlinerMaterial::apron))
        .quad({kMiddle - kFar, 0, kFar}, {kMiddle + kFar, 0, kFar}, {kMiddle + kFar, 0, -kFar},
              {kMiddle - kFar, 0, -kFar});
    apron.material(static_cast<int>(AirlinerMaterial::marking));
    for (const double z : {-38.0, 0.0, 38.0})
        apron.quad({-60, 0.01, z + 0.15}, {120, 0.01, z + 0.15}, {120, 0.01, z - 0.15}, {-60, 0.01, z - 0.15});
    document.node("apron", document.mesh(apron.take()));
    document.sun("sun", {-0.5, 0.75, 0.55}, {1, 0.93, 0.82}, 5);
    document.sky({0.42, 0.55, 0.75});
    constexpr double kCeiling = 1.75, kAisle = 1.03, kEye = 1.5;
    for (int i = 0; i < kRows / 2; ++i)
        for (const double side : {-1.0, 1.0})
            document.lamp("cabin lamp", {kNose + (2 * i + 1) * kRow, kAxisHeight + kCeiling, side * kAisle},
                          {1, 0.92, 0.80}, 7, 180);
    const double eye = kAxisHeight + kFloor + kEye;
    document.camera("inside", {kNose + 3.6 * kRow, eye, -kAisle}, {kNose + 16 * kRow, eye - 0.75, -kAisle + 0.7}, 62,
                    16.0 / 9);
    document.camera("air", {-19, 25, 43}, {29.5, 3, 1}, 40, 16.0 / 9);
}

}  // namespace

double hull_radius(double x) {
    const double end = 0.03;  // the tip of the nose is cut off
    if (x < kNose) {
        const double t = 1 - std::max(x, end) / kNose;
        return kHull * std::sqrt(1 - t * t);
    }
    const double s = std::max(0.0, (x - kNose - kBody) / kTail);
    return kHull * (1 - 0.92 * s * s * (2 - s));
}

double hull_centre(double x) {
    if (x < kNose) return -0.5 * (1 - x / kNose) * (1 - x / kNose);
    return 0.75 * (kHull - hull_radius(x));
}

bool has_door(int body_bay) {
    for (const int first : {1, 22, 43, 63})
        if (body_bay == first || body_bay == first + 1) return true;
    return false;
}

std::uint64_t write_airliner(const std::filesystem::path& path, const SceneOptions& options) {
    const auto make = [](double level) {
        Assembly airliner{
            .name = "airliner", .group = "section", .materials = airliner_materials(), .models = {}, .places = {}};
        airliner.add_views = add_views;
        const Detail detail{level};
        add_fuselage(airliner, detail);
        add_cabin(airliner, detail);
        add_wings(airliner, detail);
        add_engines(airliner, detail);
        return airliner;
    };
    return write_assembly(path, fitted(options.triangles, make), options);
}

}  // namespace halflight::scenes
