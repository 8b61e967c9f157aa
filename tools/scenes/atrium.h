// The parts of the atrium. Each function makes one mesh in its own coordinate frame, in metres.
#pragma once

#include "tools/scenes/document.h"

namespace halflight::scenes::atrium {

struct Materials {
    int floor, blocks, stone, plaster, wood, brass, iron, water, clay, soil, leaf, lawn, cushion;
    int banners[3];
};
Materials add_materials(Document& document);

// The building is a row of bays of 3 m along x; the court is 8.4 m wide between the axes of its columns.
inline constexpr int kBays = 9;
inline constexpr double kBay = 3, kHalfLength = 13.5;  // kHalfLength = kBays * kBay / 2
inline constexpr double kHalfCourt = 4.2;              // column axes at z = +-kHalfCourt
inline constexpr double kHalfWidth = 8;                // inner faces of the outer walls at z = +-kHalfWidth
inline constexpr double kAisle = kHalfWidth - kHalfCourt;
inline constexpr double kSpring = 3;   // height at which the lower arches begin
inline constexpr double kGallery = 5;  // height of the upper storey's floor
inline constexpr double kUpperSpring = 7.2;
inline constexpr double kRoof = 9.4;   // height of the top of the aisles' roofs
inline constexpr double kWall = 0.35;  // thickness of outer walls

// --- atrium_building.cpp, atrium_walls.cpp ---

Mesh column(const Materials& m);        ///< Makes a column of the lower storey on the origin, kSpring high.
Mesh upper_column(const Materials& m);  ///< Makes a column of the upper storey, from kGallery to kUpperSpring.
/// Makes one bay of the arcade above the columns, centred on x = 0, z = 0, moulded on both faces.
Mesh arcade(const Materials& m, const char* name, double span, double spring, double radius, double top,
            double thickness);
Mesh vault(const Materials& m);                   ///< Makes a groin vault over one bay of the aisle, centred.
Mesh cornice(const Materials& m, double length);  ///< Makes a moulding along x, centred, 0.42 high, from z = 0 to +z.
Mesh transverse_arch(const Materials& m);         ///< Makes an arch between two vaults, over the aisle, centred.
Mesh ceiling(const Materials& m);                 ///< Makes beams and boards over one bay of the gallery, centred.
Mesh balustrade(const Materials& m, double length, int balusters);  ///< Makes a balustrade along x, centred, on y = 0.
Mesh door_bay(const Materials& m);     ///< Makes an outer wall of one bay, 5 m high, facing +z, with a door.
Mesh niche_bay(const Materials& m);    ///< Makes an outer wall of one bay with an arched niche for an urn.
Mesh window_bay(const Materials& m);   ///< Makes an outer wall of the upper storey with a shuttered window.
Mesh shell(const Materials& m);        ///< Makes floors, roofs and end walls.
Mesh stairs(const Materials& m);       ///< Makes steps from the court's floor to the gallery at the west end.
Mesh window_wall(const Materials& m);  ///< Makes the east end: mullions between stone piers.
Mesh beams(const Materials& m);        ///< Makes timber over the court.
Mesh garden(const Materials& m);       ///< Makes the garden behind the window wall.

// --- atrium_furnishing.cpp ---

Mesh hanging(const Materials& m, int which, double width,
             double height);  ///< Makes a banner on its rod, hanging from the origin.
Mesh fountain(const Materials& m);
Mesh potted_bush(const Materials& m, std::uint32_t seed);
Mesh potted_tree(const Materials& m, std::uint32_t seed);
Mesh bench(const Materials& m);
Mesh table(const Materials& m);
Mesh chair(const Materials& m);
Mesh lantern(const Materials& m);  ///< Makes a lantern that hangs from the origin.
Mesh urn(const Materials& m);      ///< Makes a brass urn on a stone foot.

/// A wall |x| <= half, 0 <= y <= rise around a half-round opening about the origin, from z = -depth / 2 to depth / 2.
/// The ring between `radius` and `outer` stands proud by `proud` on the front and, with `back`, on the back.
struct ArchWall {
    double half, rise, radius, outer, depth, proud;
    bool back;
};

void arch_wall(MeshBuilder& mesh, const ArchWall& wall, int ring_material, int wall_material);
/// Adds one piece of turned stone, `height` metres high. Leaves the builder's frame at identity.
void baluster(MeshBuilder& mesh, double x, double y, double z, double height);

}  // namespace halflight::scenes::atrium
