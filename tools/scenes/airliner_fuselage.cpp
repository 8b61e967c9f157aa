// The airliner's fuselage, bay by bay: skin, frame, stringers, floor beams, pipes and cables.
#include <array>
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

constexpr double kStringer = 0.030, kFrame = 0.12;  // heights of the sections
constexpr double kWindowSlot = 7;                   // half the angle of the row of windows, degrees

/// Returns the point of the hull, `inside` metres below the outer skin, at x and an angle from the top in degrees.
dvec3 on_hull(double x, double degrees, double inside = 0) {
    const dvec2 t = cos_sin_degrees(degrees);
    const double radius = hull_radius(x) - inside;
    return {x, hull_centre(x) + radius * t.x, radius * t.y};
}

dvec3 outward(double degrees) {
    const dvec2 t = cos_sin_degrees(degrees);
    return {0, t.x, t.y};
}

/// A bay between two frames, from x0 to x0 + kBay.
struct Bay {
    double x0;
    bool body;  // whether it belongs to the cylindrical part, which has a cabin
    bool windows;
};

int stringers(const Detail& detail) {
    return detail(64, 8, 96);
}

double stringer_angle(int i, int count) {
    return 360.0 * (i + 0.5) / count;
}

bool meets_window(double degrees) {
    const double middle = degrees < 180 ? kWindowAngle : 360 - kWindowAngle;
    return std::abs(degrees - middle) < 5;
}

void skin(MeshBuilder& mesh, const Bay& bay, const Detail& detail) {
    struct Arc {
        double from, to;  // degrees
        AirlinerMaterial paint;
        bool window;
    };
    constexpr double kLow = kWindowAngle + kWindowSlot, kHigh = kWindowAngle - kWindowSlot, kStripe = 99;
    const Arc arcs[] = {{-kHigh, kHigh, white, false},
                        {kHigh, kLow, white, true},
                        {kLow, kStripe, blue, false},
                        {kStripe, 360 - kStripe, grey, false},
                        {360 - kStripe, 360 - kLow, blue, false},
                        {360 - kLow, 360 - kHigh, white, true}};
    for (const Arc& arc : arcs) {
        const auto at = [&](double u, double v) { return on_hull(bay.x0 + kBay * v, glm::mix(arc.from, arc.to, u)); };
        mesh.material(index(arc.paint));
        const int rows = detail(2, 1);
        if (arc.window && bay.windows)
            pierced_surface(mesh, at, {0.5, 0.5}, {0.2 / 0.757, 0.14 / kBay}, 4 * detail(4, 2), detail(1.5, 1));
        else
            surface(mesh, detail(72 * (arc.to - arc.from) / 360, arc.to - arc.from > 90 ? 8 : 1), rows, at);
    }
}

void skin_rivets(MeshBuilder& mesh, const Bay& bay, const Detail& detail) {
    const int count = stringers(detail);
    const int around = detail(240, 24, 780);
    int number = 0;
    const auto head = [&](double x, double degrees) {
        const bool window = bay.windows && std::abs(x - bay.x0 - kBay / 2) < 0.17 && meets_window(degrees);
        if (!window) rivet(mesh, on_hull(x, degrees), outward(degrees), 0.0045, detail.dithered(number++, 5, 4, 20));
    };
    mesh.material(index(aluminium));
    for (int i = 0; i < count; ++i)
        for (int k = 0, along = detail.dithered(i, 10, 1, 21); k < along; ++k)
            head(bay.x0 + kBay * (k + 0.5) / along, stringer_angle(i, count) + 0.2);
    for (int i = 0; i < around; ++i)
        for (const double x : {0.012, kBay - 0.012}) head(bay.x0 + x, 360.0 * i / around);
}

/// Adds the frame at x0, and the stringers up to the next one with their clips.
void structure(MeshBuilder& mesh, const Bay& bay, const Detail& detail) {
    const double depth = 0.003 + kStringer + kFrame / 2, next = bay.x0 + kBay;
    const int count = stringers(detail);
    mesh.material(index(primer));
    if (hull_radius(bay.x0) > 2 * depth) {
        const Local centre(mesh, move(0, hull_centre(bay.x0), 0));
        const std::vector<dvec2> section =
            detail.above(0.4) ? zee_section(0.035, kFrame, 0.003) : bar_section(0.01, kFrame);
        hoop(mesh, section, bay.x0, hull_radius(bay.x0) - depth, 0, 360, detail(72, 8));
    }
    for (int i = 0; i < count; ++i) {
        const double angle = stringer_angle(i, count);
        if (bay.windows && meets_window(angle)) continue;
        if (std::min(hull_radius(bay.x0), hull_radius(next)) < 0.004 * count) break;  // the tips have no room
        const std::vector<dvec2> section =
            detail.above(0.4) ? zee_section(0.02, kStringer, 0.002) : bar_section(0.004, kStringer);
        const double inside = 0.002 + kStringer / 2;
        mesh.material(index(primer));
        beam(mesh, section, on_hull(bay.x0 + 0.001, angle, inside), on_hull(next - 0.001, angle, inside),
             outward(angle), detail(0.6, 1));
        if (!detail.has(i, 0.2, 0.5)) continue;
        // A clip ties the frame to the skin beside each stringer.
        const double beside = angle + 0.4 * 360 / count;
        if (bay.windows && meets_window(beside)) continue;
        const dmat4 foot = frame_at(on_hull(bay.x0 + 0.012, beside, 0.002), {1, 0, 0}, outward(beside));
        const Local clip(mesh, foot);
        mesh.box({-0.03, -0.09, -0.002}, {0.03, 0, 0.002});
        mesh.box({-0.03, -0.003, 0.002}, {0.03, 0, 0.03}, MeshBuilder::kBack);
        if (!detail.has(3 * i, 0.6, 1.2)) continue;
        mesh.material(index(aluminium));
        for (const double x : {-0.018, 0.018})
            for (const double y : {-0.05, -0.075})
                rivet(mesh, {x, y, 0.002}, {0, 0, 1}, 0.004, detail.dithered(i, 5, 4, 12));
        for (const double x : {-0.018, 0.018})
            rivet(mesh, {x, -0.003, 0.018}, {0, -1, 0}, 0.004, detail.dithered(i, 5, 4, 12));
    }
}

/// Adds the floor beam at x0, its struts and the fittings of the seat tracks.
void floor_beam(MeshBuilder& mesh, const Bay& bay, const Detail& detail) {
    constexpr double kTop = kFloor - 0.045, kHigh = 0.20, kSide = 2.85;
    mesh.material(index(primer));
    if (!detail.above(0.4)) {
        beam(mesh, bar_section(0.02, kHigh), {bay.x0, kTop - kHigh / 2, -kSide}, {bay.x0, kTop - kHigh / 2, kSide});
    } else {
        constexpr int kCells = 18;
        constexpr double kCell = kSide / kCells;  // half a cell's width
        for (int i = 0; i < kCells; ++i) {
            const Local cell(mesh, move(bay.x0, kTop - kHigh / 2, kCell * (2 * i + 1) - kSide) * turn_y(90));
            pierced_plate(mesh, {kCell, kHigh / 2 - 0.004}, 0.065, 4 * detail(4, 2), 0.004);
            if (!detail.above(0.8)) continue;
            const Local lip(mesh, turn_x(90));
            const dvec2 profile[] = {{0.0655, -0.009}, {0.071, -0.009}, {0.071, 0.009}, {0.0655, 0.009}};
            lathe(mesh, profile, 4 * detail(4, 2));
        }
        for (const double y : {kTop - 0.002, kTop - kHigh + 0.002})
            beam(mesh, bar_section(0.07, 0.004), {bay.x0, y, -kSide}, {bay.x0, y, kSide}, {0, 1, 0}, detail(4, 1));
    }
    for (const double z : {-1.72, 1.72}) {
        const dvec3 head(bay.x0, kTop - kHigh, z), foot(bay.x0, -2.46, z);
        if (detail.above(0.4))
            beam(mesh, i_section(0.05, 0.06, 0.004), head, foot, {1, 0, 0});
        else
            beam(mesh, bar_section(0.04, 0.04), head, foot, {1, 0, 0});
    }
    mesh.material(index(steel));
    if (detail.above(0.3))
        for (int i = 0; i < 12; ++i)
            for (const double x : {-0.022, 0.022})
                bolt(mesh, {bay.x0 + x, kTop - kHigh, -2.75 + 0.5 * i}, {0, -1, 0}, 0.006, detail(5, 4, 20));
}

/// Adds wires side by side, tied at the frames, sagging between them.
void cable_bundle(MeshBuilder& mesh, const dvec3& start, int number, const Detail& detail) {
    if (!detail.has(number, 0.08, 0.2)) return;
    static constexpr AirlinerMaterial kColors[] = {cable_white, cable_white, cable_black, cable_orange};
    constexpr double kWire = 0.004;
    const int wires = detail.dithered(number, 14, 1, 91), steps = detail(4, 1), sides = detail(4, 3, 12);
    Random random(static_cast<std::uint32_t>(number));
    for (int i = 0; i < wires; ++i) {
        // Wires lie on the spiral of a sunflower, which packs a disc evenly.
        const double radius = 1.9 * kWire * std::sqrt(i + 0.3), sag = random.in(0.004, 0.02);
        const dvec2 t = cos_sin_degrees(137.508 * i), sway{random.in(-0.006, 0.006), random.in(-0.006, 0.006)};
        std::vector<dvec3> path;
        for (int k = 0; k <= steps; ++k) {
            const double u = double(k) / steps, belly = 4 * u * (1 - u);
            path.push_back(start +
                           dvec3(kBay * u, radius * t.x + belly * (sway.x - sag), radius * t.y + belly * sway.y));
        }
        mesh.material(index(kColors[random.below(4)]));
        tube(mesh, path, 0.85 * kWire, sides);
    }
    if (!detail.above(0.15)) return;
    const Local clamp(mesh, move(start.x, start.y, start.z) * turn_z(-90));
    const double around = 1.9 * kWire * std::sqrt(wires) + kWire;
    const dvec2 profile[] = {
        {around - 0.001, -0.012}, {around + 0.002, -0.012}, {around + 0.002, 0.012}, {around - 0.001, 0.012}};
    mesh.material(index(rubber));
    lathe(mesh, profile, detail(10, 4));
}

/// Adds the pipes and ducts of one side.
template <int kSide>
void pipes(MeshBuilder& mesh, const Bay& bay, const Detail& detail) {
    const int sides = detail(12, 3, 64);
    const auto run = [&](AirlinerMaterial material, double y, double z, double radius) {
        mesh.material(index(material));
        rod(mesh, {bay.x0, y, z}, {bay.x0 + kBay, y, z}, radius, sides);
        if (!detail.above(0.5)) return;
        const Local joint(mesh, move(bay.x0 + 0.3 * kBay, y, z) * turn_z(-90));
        const double r = radius;
        const dvec2 nut[] = {{r, -1.2 * r},      {1.4 * r, -1.2 * r}, {1.4 * r, -0.2 * r}, {1.2 * r, 0},
                             {1.4 * r, 0.2 * r}, {1.4 * r, 1.2 * r},  {r, 1.2 * r}};
        mesh.material(index(steel));
        lathe(mesh, nut, detail.above(1) ? 24 : 6);
    };
    constexpr double side = kSide;
    // Air ducts in the crown, with a joint and a riser down the wall in each bay.
    mesh.material(index(duct));
    rod(mesh, {bay.x0, 2.36, side * 0.62}, {bay.x0 + kBay, 2.36, side * 0.62}, 0.17, detail(24, 6, 160));
    {
        const Local joint(mesh, move(bay.x0 + 0.1, 2.36, side * 0.62) * turn_z(-90));
        const dvec2 ring[] = {{0.169, -0.03}, {0.182, -0.02}, {0.182, 0.02}, {0.169, 0.03}};
        lathe(mesh, ring, detail(24, 6, 160));
    }
    std::vector<dvec3> riser{{bay.x0 + 0.27, 2.36, side * 0.75}};
    // The riser passes the window on its way down the wall; it keeps to the frame.
    for (int i = 0, steps = detail(6, 3); i <= steps; ++i) {
        dvec3 p = on_hull(bay.x0 + 0.065, glm::mix(38.0, 104.0, double(i) / steps), 0.085);
        p.z *= side;
        riser.push_back(p);
    }
    pipe(mesh, riser, 0.03, detail(10, 3), 0.15, detail(2, 1));
    for (int i = 0; i < 3; ++i) run(i == 2 ? copper : aluminium, 2.05 + 0.07 * i, side * (1.95 - 0.07 * i), 0.012);
    for (int i = 0; i < detail(20, 1, 5); ++i)
        run(i < 2    ? copper
            : i == 2 ? titanium
                     : aluminium,
            kFloor - 0.32 - 0.02 * (i % 2), side * (1.1 + 0.08 * i), 0.010 + 0.004 * (i % 3));
}

template <int kSide>
void cables(MeshBuilder& mesh, const Bay& bay, const Detail& detail) {
    constexpr double side = kSide;
    const int number = side > 0 ? 20 : 10;
    cable_bundle(mesh, {bay.x0, 2.62, side * 0.95}, number, detail);
    cable_bundle(mesh, {bay.x0, 2.5, side * 1.2}, number + 1, detail);
    cable_bundle(mesh, {bay.x0, 2.22, side * 1.58}, number + 2, detail);
    cable_bundle(mesh, {bay.x0, kFloor - 0.34, side * 0.75}, number + 3, detail);
    cable_bundle(mesh, {bay.x0, kFloor - 0.34, side * 0.45}, number + 4, detail);
    cable_bundle(mesh, {bay.x0, kFloor - 0.36, side * 2.45}, number + 5, detail);
    if (side > 0) cable_bundle(mesh, {bay.x0, kFloor - 0.36, 0}, 30, detail);
}

/// Adds the frame of a door as a raised rim; the door is closed.
void door(MeshBuilder& mesh, double x, double side, int pieces) {
    constexpr double kWide = 0.92, kFrom = 54, kTo = 97;
    const std::vector<dvec2> rim = bar_section(0.03, 0.03);
    mesh.material(index(grey));
    for (const double at : {x, x + kWide})
        hoop(mesh, rim, at, kHull, side > 0 ? kFrom : -kTo, side > 0 ? kTo : -kFrom, pieces);
    for (const double angle : {kFrom, kTo})
        beam(mesh, rim, on_hull(x, side * angle), on_hull(x + kWide, side * angle), outward(side * angle));
    mesh.material(index(steel));
    const Local handle(mesh, frame_at(on_hull(x + 0.2, side * 82), {1, 0, 0}, outward(side * 82)));
    mesh.box({-0.03, -0.01, 0}, {0.03, 0.02, 0.22});
}

void nose_and_tail(MeshBuilder& mesh, const Detail& detail) {
    mesh.material(index(cockpit_glass));
    constexpr double kPanes[][4] = {{2, 24, 1.75, 2.62}, {26, 47, 1.90, 2.75}, {49, 66, 2.05, 2.95}};  // degrees, x
    for (const double side : {-1.0, 1.0})
        for (const auto& [from, to, front, back] : kPanes) {
            const double a = side > 0 ? from : -to, b = side > 0 ? to : -from;
            surface(mesh, detail(6, 2), detail(5, 2), [&, front = front, back = back](double u, double v) {
                return on_hull(glm::mix(front, back, v), glm::mix(a, b, u), -0.012);
            });
        }
    mesh.material(index(grey));
    surface(mesh, detail(40, 8, 200), detail(40, 8, 200),
            [](double u, double v) {  // fairing around the roots of the wings
                const double a = 4 * u * (1 - u), b = 4 * v * (1 - v);
                return on_hull(glm::mix(19.0, 38.5, v), glm::mix(108.0, 252.0, u),
                               -0.01 - 0.55 * std::sqrt(a) * b * (2 - b));
            });
    mesh.material(index(white));
    {
        const Local tip(mesh, move(0, hull_centre(0), 0) * turn_z(-90));
        const double r = hull_radius(0);
        const dvec2 cap[] = {{0, -0.055}, {0.5 * r, -0.043}, {0.8 * r, -0.022}, {r, 0}};
        lathe(mesh, cap, detail(72, 10));
    }
    {
        const double end = kNose + kBody + kTail, r = hull_radius(end);
        const Local exhaust(mesh, move(end, hull_centre(end), 0) * turn_z(-90));
        const dvec2 pipe_profile[] = {{r, 0}, {0.9 * r, 0.12}, {0.8 * r, 0.12}, {0.75 * r, -0.5}, {0, -0.5}};
        mesh.material(index(titanium));
        lathe(mesh, pipe_profile, detail(72, 10));
    }
    // Pressure bulkheads close the cabin.
    mesh.material(index(primer));
    for (const double x : {kNose - 2 * kBay, kNose + kBody + 6 * kBay}) {
        const double radius = hull_radius(x) - 0.16, bulge = x < kNose ? -0.05 : 0.9;
        const Local dome(mesh, move(x + 0.1, hull_centre(x), 0) * turn_z(-90));
        std::vector<dvec2> profile;
        for (int i = 0, steps = detail(12, 3); i <= steps; ++i) {
            const double r = 1 - double(i) / steps;
            profile.emplace_back(radius * r, bulge * (1 - r * r));
        }
        lathe(mesh, profile, detail(48, 12, 300));
        for (int i = 0; i < 16; ++i) {  // stiffeners, straight ones in front and bent ones at the rear
            const dvec2 t = ring_of(16)[static_cast<std::size_t>(i)];
            std::vector<dmat4> frames;
            for (int k = 0, steps = detail(8, 2); k <= steps; ++k) {
                const double r = 0.98 * glm::mix(1.0, 0.12, double(k) / steps);
                frames.push_back(frame_at({radius * r * t.x, bulge * (1 - r * r) - 0.02, radius * r * t.y},
                                          {-t.x, 2 * r * bulge / radius, -t.y}, {0, 1, 0}));
            }
            sweep(mesh, bar_section(0.03, 0.05), frames);
        }
    }
}

}  // namespace

void add_fuselage(Assembly& airliner, const Detail& detail) {
    const dmat4 lift = move(0, kAxisHeight, 0);
    const auto add = [&](const std::string& name, const Bay& bay, auto part) {
        return airliner.add(name, maker(name, [=](MeshBuilder& mesh) { part(mesh, bay, detail); }));
    };
    // The bays of the body share models, which are made at x = kNose.
    const Bay plain{kNose, true, false}, pierced{kNose, true, true};
    const std::uint32_t shared[2][2] = {
        {add("skin", plain, skin), add("skin rivets", plain, skin_rivets)},
        {add("window skin", pierced, skin), add("window skin rivets", pierced, skin_rivets)}};
    const std::uint32_t frames[2] = {add("door frames", plain, structure), add("frames", pierced, structure)};
    const std::uint32_t beams = add("floor beam", plain, floor_beam);
    const std::uint32_t left = add("left pipes", plain, pipes<-1>), right = add("right pipes", plain, pipes<1>);
    const std::uint32_t left_cables = add("left cables", plain, cables<-1>),
                        right_cables = add("right cables", plain, cables<1>);
    for (int i = 0; i < kNoseBays + kBodyBays + kTailBays; ++i) {
        const int body = i - kNoseBays;
        const dmat4 at = move(kBay * body, kAxisHeight, 0);
        if (body >= 0 && body < kBodyBays) {
            const int windows = has_door(body) ? 0 : 1;
            for (const std::uint32_t model :
                 {shared[windows][0], frames[windows], beams, left, right, left_cables, right_cables})
                airliner.place(model, at);
            if (detail.has(i, 0.12, 0.3)) airliner.place(shared[windows][1], at);
            continue;
        }
        const Bay bay{kBay * i, false, false};
        const std::string number = std::to_string(i);
        airliner.place(add("skin " + number, bay, skin), lift);
        if (i > 1) airliner.place(add("frame " + number, bay, structure), lift);  // the tip has no room
        if (i > 0 && detail.has(i, 0.12, 0.3)) airliner.place(add("skin rivets " + number, bay, skin_rivets), lift);
    }
    const std::uint32_t doors =
        airliner.add("doors", maker("doors", [=](MeshBuilder& mesh) {
                         for (int body = 0; body < kBodyBays; ++body)
                             if (has_door(body) && !has_door(body - 1))
                                 for (const double side : {-1.0, 1.0})
                                     door(mesh, kNose + kBay * body + 0.08, side, detail(24, 4));
                     }));
    const std::uint32_t ends =
        airliner.add("nose and tail", maker("nose and tail", [=](MeshBuilder& mesh) { nose_and_tail(mesh, detail); }));
    airliner.place(doors, lift), airliner.place(ends, lift);
}

}  // namespace halflight::scenes
