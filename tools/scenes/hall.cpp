#include "tools/scenes/hall.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "engine/io/files.h"
#include "tools/scenes/document.h"
#include "tools/scenes/mesh.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {
namespace {

// Metres. The hall extends along -z in bays; its floor is at y = 0.
constexpr double kHalf = 6, kHeight = 6.5, kBay = 5;
constexpr int kLeastBays = 2, kMostBays = 400;

/// Surfaces of a bay, each with a material of its own while there are enough: two of each on both sides.
constexpr HallSurface kOfBay[] = {
    HallSurface::marble,    HallSurface::marble,   HallSurface::brick,    HallSurface::brick, HallSurface::limestone,
    HallSurface::limestone, HallSurface::painting, HallSurface::painting, HallSurface::wood,  HallSurface::wood};
constexpr int kSurfaces = static_cast<int>(std::size(kOfBay));

/// Adds a column with base and capital.
void add_column(MeshBuilder& mesh, const dvec3& foot) {
    const dvec2 profile[] = {{0.62, 0}, {0.62, 0.35}, {0.45, 0.45}, {0.42, 5.4}, {0.44, 5.5}, {0.7, 5.9}, {0.7, 6.5}};
    mesh.frame(move(foot.x, foot.y, foot.z));
    lathe(mesh, profile, 40, 2, 2.6);
    mesh.frame(dmat4(1));
}

/// Returns a bay that starts at z; `materials` are those of kOfBay.
Mesh bay(const std::string& name, double z, const int (&materials)[kSurfaces]) {
    MeshBuilder mesh(name);
    const double end = z - kBay, middle = z - kBay / 2;
    for (int side = 0; side < 2; ++side) {
        const double x = side == 0 ? -kHalf : kHalf, in = side == 0 ? 1 : -1;
        const auto material = [&](int pair) { return materials[2 * pair + side]; };
        mesh.texel_size(2.5).material(material(0));
        const double left = std::min(x, 0.0), right = std::max(x, 0.0);
        mesh.quad({left, 0, z}, {right, 0, z}, {right, 0, end}, {left, 0, end});
        mesh.texel_size(3).material(material(1));
        if (side == 0)
            mesh.quad({x, 0, z}, {x, 0, end}, {x, kHeight, end}, {x, kHeight, z});
        else
            mesh.quad({x, 0, end}, {x, 0, z}, {x, kHeight, z}, {x, kHeight, end});
        mesh.material(material(2));
        add_column(mesh, {x + 2.2 * in, 0, z - 0.8});
        const double plane = x + 0.06 * in, low = 1.4, high = 3.6, half = 1.3;
        mesh.material(material(3));
        if (side == 0)
            mesh.picture({plane, low, middle + half}, {plane, low, middle - half}, {plane, high, middle - half},
                         {plane, high, middle + half});
        else
            mesh.picture({plane, low, middle - half}, {plane, low, middle + half}, {plane, high, middle + half},
                         {plane, high, middle - half});
        mesh.texel_size(1).material(material(4));
        const double plinth = x + 2.4 * in;
        mesh.box({plinth - 0.4, 0, middle - 0.9}, {plinth + 0.4, 1.0, middle - 0.1}, MeshBuilder::kBottom);
        sphere(mesh, {plinth, 1.35, middle - 0.5}, 0.35, 48, 24);
    }
    return mesh.take();
}

/// Returns end walls, ceiling and lamps of a hall of `length` metres.
Mesh shell(double length, int plaster, int lamp) {
    MeshBuilder mesh("shell");
    mesh.material(plaster);
    mesh.quad({-kHalf, kHeight, -length}, {kHalf, kHeight, -length}, {kHalf, kHeight, 0}, {-kHalf, kHeight, 0});
    mesh.quad({-kHalf, 0, -length}, {kHalf, 0, -length}, {kHalf, kHeight, -length}, {-kHalf, kHeight, -length});
    mesh.quad({kHalf, 0, 0}, {-kHalf, 0, 0}, {-kHalf, kHeight, 0}, {kHalf, kHeight, 0});
    mesh.material(lamp);
    for (double z = -kBay / 2; z > -length; z -= kBay) {
        const double y = kHeight - 0.02;
        mesh.quad({-1, y, z - 0.6}, {1, y, z - 0.6}, {1, y, z + 0.6}, {-1, y, z + 0.6});
    }
    return mesh.take();
}

}  // namespace

std::uint64_t write_hall(const std::filesystem::path& path, const HallOptions& options) {
    Document document("hall");
    const int sets = (options.textures + 2) / 3;
    const int bays = std::clamp((sets + kSurfaces - 1) / kSurfaces, kLeastBays, kMostBays);
    const std::filesystem::path folder = path.parent_path() / path.stem();
    std::filesystem::create_directories(folder);
    const auto texture = [&](HallSurface surface, HallMap map, int set) {
        const int number = 3 * set + static_cast<int>(map);
        if (number >= options.textures) return kNothing;
        const std::string name = fmt::format("{:04}.jpg", number);
        write_file(folder / name,
                   hall_texture(surface, map, static_cast<std::uint32_t>(set) + 1, options.texture_size));
        return document.texture_file(name, (path.stem() / name).string());
    };
    std::vector<int> materials;
    for (int set = 0; set < sets; ++set) {
        const HallSurface surface = kOfBay[set % kSurfaces];
        Material m = matte(fmt::format("set {}", set), dvec3(1));
        m.color_texture = texture(surface, HallMap::color, set);
        m.normal_texture = texture(surface, HallMap::normal, set);
        m.roughness_texture = texture(surface, HallMap::roughness, set);
        if (m.roughness_texture != kNothing) m.metallic = 1, m.specular = 1;  // factors of the map
        materials.push_back(document.material(m));
    }
    const double length = bays * kBay;
    document.node("shell", document.mesh(shell(length, document.material(matte("plaster", dvec3(0.7, 0.68, 0.64))),
                                               document.material(light("lamp", dvec3(14, 13, 11.5))))));
    for (int b = 0; b < bays; ++b) {
        int own[kSurfaces];
        for (int i = 0; i < kSurfaces; ++i) own[i] = materials[static_cast<std::size_t>((b * kSurfaces + i) % sets)];
        const std::string name = fmt::format("bay {}", b);
        document.node(name, document.mesh(bay(name, -b * kBay, own)));
    }
    document.camera("hall", {0.8, 1.7, -0.4}, {-0.2, 1.75, -length}, 60, 16.0 / 9);
    document.camera("close", {-1.2, 1.5, -1.5}, {-6, 1.2, -4.2}, 50, 16.0 / 9);
    document.write(path);
    return document.triangles();
}

}  // namespace halflight::scenes
