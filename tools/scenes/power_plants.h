// Sixteen power plants of any number of triangles: boilers in steel frames, ducts, stacks, pipe racks, turbine halls.
#pragma once

#include "tools/scenes/assembly.h"
#include "tools/scenes/structure.h"

namespace halflight::scenes {

/// Indices into power_plant_materials().
enum class PlantMaterial : int {
    ground,
    road,
    concrete,
    dark_steel,
    primer,
    galvanized,
    yellow,
    tube,
    cladding,
    silver,
    green,
    red,
    blue,
    white,
    bolts,
    ceramic,
    coal,
    rubber,
    lamp
};

/// One plant: its models, and where they stand on a square of 130 m. x and z are level, y is up.
struct Plant {
    Assembly& assembly;
    Detail detail;
    std::vector<std::pair<std::uint32_t, dmat4>> places{};

    template <class Build>
    std::uint32_t add(std::string name, Build build) {
        return assembly.add(name, [name, build, detail = detail] {
            MeshBuilder mesh(name);
            build(mesh, detail);
            return mesh.take();
        });
    }
    void place(std::uint32_t model, const dmat4& matrix = dmat4(1)) { places.emplace_back(model, matrix); }
};

inline constexpr double kHouse = 15, kCell = 7.5, kLevel = 6;  // half the boiler house's side, its grid, its storeys
inline constexpr int kLevels = 8;

/// Adds the steel frame with floors and stairs.
void add_boiler_house(Plant& plant);
/// Adds furnace, drum, burners and ducts.
void add_boiler(Plant& plant);
/// Adds racks, stack, tanks, cooling tower and conveyor.
void add_yard(Plant& plant);
/// Adds the hall with its turbines.
void add_turbine_hall(Plant& plant);

/// Adds a rectangular duct along a path that lies in the plane across `normal`, with ribs around it. Without a
/// distance there are none.
void rect_duct(MeshBuilder& mesh, std::span<const dvec3> path, const dvec3& normal, double width, double height,
               double rib_distance);

/// Writes the plants as write_assembly() does. Returns the number of triangles written.
std::uint64_t write_power_plants(const std::filesystem::path& path, const SceneOptions& options);

}  // namespace halflight::scenes
