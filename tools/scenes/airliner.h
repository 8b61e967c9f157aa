// A wide-body airliner of any number of triangles. It has a fuselage with frames and systems, a cabin, wings, engines.
// x points from nose to tail, y up, z to the right-hand side; y = 0 is the fuselage's axis while parts are made.
#pragma once

#include "tools/scenes/assembly.h"
#include "tools/scenes/structure.h"

namespace halflight::scenes {

/// Indices into airliner_materials().
enum class AirlinerMaterial : int {
    white,
    grey,
    blue,
    cockpit_glass,
    primer,
    aluminium,
    steel,
    titanium,
    copper,
    duct,
    cable_white,
    cable_black,
    cable_orange,
    rubber,
    lining,
    floor,
    carpet,
    cloth,
    dark_cloth,
    leather,
    plastic,
    screen,
    belt,
    strip,
    blade,
    apron,
    marking
};

// Sizes in metres. Frames stand one bay apart; two rows of seats take three bays.
inline constexpr double kHull = 3.1, kBay = 0.54, kRow = 1.5 * kBay, kAxisHeight = 5.2, kFloor = -0.5;
inline constexpr int kNoseBays = 15, kBodyBays = 66, kTailBays = 36, kRows = kBodyBays * 2 / 3;
inline constexpr double kNose = kNoseBays * kBay, kBody = kBodyBays * kBay, kTail = kTailBays * kBay;
inline constexpr double kWindowAngle = 78.8;  // angle of the windows' middle, degrees from the top

double hull_radius(double x);  ///< Returns the radius of the outer skin at x.
double hull_centre(double x);  ///< Returns the height of the middle of the hull at x.
bool has_door(int body_bay);   ///< Returns whether a bay of the body has a door, and so no window.

/// Adds skin, frames, floor beams, pipes and cables.
void add_fuselage(Assembly& airliner, const Detail& detail);
/// Adds seats, bins, linings, galleys and the hold.
void add_cabin(Assembly& airliner, const Detail& detail);
/// Adds wings and tail.
void add_wings(Assembly& airliner, const Detail& detail);
/// Adds engines, pylons and landing gear.
void add_engines(Assembly& airliner, const Detail& detail);

/// Returns a maker of a mesh for Assembly::add(); `build` gets the builder.
template <class Build>
std::function<Mesh()> maker(std::string name, Build build) {
    return [name = std::move(name), build = std::move(build)] {
        MeshBuilder mesh(name);
        build(mesh);
        return mesh.take();
    };
}

/// Writes the airliner as write_assembly() does. Returns the number of triangles written.
std::uint64_t write_airliner(const std::filesystem::path& path, const SceneOptions& options);

}  // namespace halflight::scenes
