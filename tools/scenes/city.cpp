// Writes the city. Only the models, the plan (16 bytes per placed model) and the JSON are in memory.
#include "tools/scenes/city.h"

#include <algorithm>
#include <cassert>
#include <memory>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "tools/scenes/city_buildings.h"

namespace halflight::scenes {
namespace {

constexpr std::uint64_t kFileLimit = 0xFFFFFFFFULL;  // largest value of a .glb's length field
// JSON takes about 250 bytes for each accessor with its view, three for each of at most 32 materials.
constexpr std::uint64_t kDistrictJson = 250 * 3 * 32, kFixedJson = 1 << 16;

/// A part of a model in float32, before it is moved to its place.
struct FlatPart {
    std::vector<vec3> positions, normals;
    std::vector<std::uint32_t> indices;
    Bounds bounds;
};

/// Data of all producers, by [model][material]; a model lacks most materials.
struct City {
    std::vector<std::vector<FlatPart>> models;
    std::vector<Placement> plan;
};

vec3 turned(const vec3& v, std::uint32_t quarter_turns) {
    switch (quarter_turns % 4) {
        case 1:
            return {v.z, v.y, -v.x};
        case 2:
            return {-v.x, v.y, -v.z};
        case 3:
            return {-v.z, v.y, v.x};
        default:
            return v;
    }
}

/// Places v in the city. Placing is monotonic in each coordinate, also after rounding, so it maps boxes to boxes.
vec3 placed(const vec3& v, const Placement& p) {
    return turned(v, p.quarter_turns) + vec3(p.x, 0, p.z);
}

std::shared_ptr<const City> make_city(const std::vector<Model>& models, std::vector<Placement> plan,
                                      std::size_t materials) {
    auto city = std::make_shared<City>();
    for (const Model& model : models) {
        std::vector<FlatPart>& flat = city->models.emplace_back(materials);
        for (const Part& part : model.mesh.parts) {
            FlatPart& target = flat[static_cast<std::size_t>(part.material)];
            for (const Vertex& v : part.vertices) {
                target.positions.emplace_back(v.position);
                target.normals.emplace_back(v.normal);
                target.bounds.add(target.positions.back());
            }
            target.indices = part.indices;
        }
    }
    city->plan = std::move(plan);
    return city;
}

/// Placements [begin, end) of the plan that are written as one mesh.
struct District {
    std::size_t begin = 0, end = 0;
    std::uint64_t triangles = 0, bytes = 0;
    Bounds bounds;
};

std::vector<District> districts(const City& city, const CityOptions& options) {
    // The target keeps the JSON small; at 60 bytes a triangle, a part holds several districts.
    const std::uint64_t target =
        std::min(std::max<std::uint64_t>(65536, options.triangles / 256), options.part_bytes / (4 * 60));
    std::vector<District> result;
    for (std::size_t i = 0; i < city.plan.size(); ++i) {
        if (result.empty() || result.back().triangles >= target) result.push_back({i, i, 0, kDistrictJson, {}});
        District& district = result.back();
        district.end = i + 1;
        for (const FlatPart& part : city.models[city.plan[i].model]) {
            if (part.indices.empty()) continue;
            district.triangles += part.indices.size() / 3;
            district.bytes += 24 * part.positions.size() + 4 * part.indices.size();
            district.bounds.add(placed(part.bounds.lower, city.plan[i]));
            district.bounds.add(placed(part.bounds.upper, city.plan[i]));
        }
    }
    return result;
}

/// Adds one mesh for a district, with one part per material; its bytes are made when the file is written.
void add_district(Document& document, const std::shared_ptr<const City>& city, const District& district,
                  std::size_t number) {
    std::vector<Document::StreamedPart> parts;
    for (std::size_t material = 0; material < city->models.front().size(); ++material) {
        const auto each = [city, district, material](auto&& visit) {
            for (std::size_t i = district.begin; i < district.end; ++i) {
                const FlatPart& part = city->models[city->plan[i].model][material];
                if (!part.indices.empty()) visit(part, city->plan[i]);
            }
        };
        Document::StreamedPart part;
        Bounds bounds;
        part.material = static_cast<int>(material);
        each([&](const FlatPart& flat, const Placement& p) {
            part.vertices += flat.positions.size();
            part.indices += flat.indices.size();
            bounds.add(placed(flat.bounds.lower, p)), bounds.add(placed(flat.bounds.upper, p));
        });
        if (part.indices == 0) continue;
        part.lower = bounds.lower, part.upper = bounds.upper;
        part.write_positions = [each](CheckedFile& file) {
            std::vector<vec3> moved;
            each([&](const FlatPart& flat, const Placement& p) {
                moved.resize(flat.positions.size());
                std::transform(flat.positions.begin(), flat.positions.end(), moved.begin(),
                               [&](const vec3& v) { return placed(v, p); });
                file.write(moved.data(), moved.size() * sizeof(vec3));
            });
        };
        part.write_normals = [each](CheckedFile& file) {
            std::vector<vec3> moved;
            each([&](const FlatPart& flat, const Placement& p) {
                moved.resize(flat.normals.size());
                std::transform(flat.normals.begin(), flat.normals.end(), moved.begin(),
                               [&](const vec3& n) { return turned(n, p.quarter_turns); });
                file.write(moved.data(), moved.size() * sizeof(vec3));
            });
        };
        part.write_indices = [each](CheckedFile& file) {
            std::vector<std::uint32_t> moved;
            std::uint32_t base = 0;
            each([&](const FlatPart& flat, const Placement&) {
                moved.resize(flat.indices.size());
                std::transform(flat.indices.begin(), flat.indices.end(), moved.begin(),
                               [&](std::uint32_t index) { return index + base; });
                file.write(moved.data(), moved.size() * sizeof(std::uint32_t));
                base += static_cast<std::uint32_t>(flat.positions.size());
            });
        };
        parts.push_back(std::move(part));
    }
    const std::string name = "district " + std::to_string(number);
    document.node(name, document.mesh(name, std::move(parts)));
}

Document start() {
    Document document("city");
    for (const Material& material : city_materials()) document.material(material);
    return document;
}

constexpr std::uint64_t kLandTriangles = 2;
constexpr int kLandMaterial = static_cast<int>(CityMaterial::grass);

/// Adds sun, sky, cameras, and the land around the city. Cameras look at the crossing at the origin and along the
/// street that starts there.
void add_views(Document& document, const Bounds& bounds) {
    MeshBuilder land("land");
    const double out = 1.5 * std::max(bounds.upper.x - bounds.lower.x, bounds.upper.z - bounds.lower.z);
    land.material(kLandMaterial).quad({-out, -0.05, out}, {out, -0.05, out}, {out, -0.05, -out}, {-out, -0.05, -out});
    document.node("land", document.mesh(land.take()));
    const double reach = std::min<double>(std::max(bounds.upper.x, bounds.upper.z), 500);
    document.sun("sun", {-0.55, 0.78, 0.16}, {1, 0.92, 0.80}, 10);
    document.sky({0.8, 1.05, 1.45});
    document.camera("street", {-4.5, 1.7, 3.5}, {30, 5.5, 0.5}, 55, 16.0 / 9);
    document.camera("aerial", {-0.75 * reach, 60 + 0.35 * reach, 0.95 * reach}, {0.1 * reach, 0, -0.05 * reach}, 38,
                    16.0 / 9);
}

std::string part_name(const std::filesystem::path& path, std::size_t number) {
    return fmt::format("{}.{:03}.glb", path.stem().string(), number);
}

nlohmann::ordered_json triple(const vec3& v) {
    return nlohmann::ordered_json::array({v.x, v.y, v.z});
}

void write_parts(const std::filesystem::path& path, const std::shared_ptr<const City>& city,
                 const std::vector<District>& all, std::uint64_t part_bytes, const Bounds& whole) {
    nlohmann::ordered_json index{{"triangles", 0}, {"parts", nlohmann::ordered_json::array()}};
    std::uint64_t total = 0;
    for (std::size_t next = 0; next < all.size();) {
        const std::size_t number = index["parts"].size();
        Document document = start();
        if (number == 0) add_views(document, whole);
        Bounds bounds;
        [[maybe_unused]] const std::size_t first = next;
        std::uint64_t bytes = kFixedJson;
        for (; next < all.size() && bytes + all[next].bytes <= part_bytes; ++next) {
            bytes += all[next].bytes;
            add_district(document, city, all[next], next);
            bounds.add(all[next].bounds);
        }
        assert(next > first);  // districts() makes none that is too large for a part
        const std::string name = part_name(path, number);
        document.write(path.parent_path() / name);
        index["parts"].push_back({{"uri", name},
                                  {"triangles", document.triangles()},
                                  {"bytes", std::filesystem::file_size(path.parent_path() / name)},
                                  {"min", triple(bounds.lower)},
                                  {"max", triple(bounds.upper)}});
        total += document.triangles();
    }
    index["triangles"] = total;
    write_file(path.parent_path() / (path.stem().string() + ".parts.json"), index.dump(1) + "\n");
}

void add_instances(Document& document, const std::vector<Model>& models, const std::vector<Placement>& plan,
                   bool gpu_instancing) {
    static constexpr double kHalf = 0.70710678118654752;  // quarter turns about +y as quaternions (y, w)
    static constexpr dvec2 kTurn[] = {{0, 1}, {kHalf, kHalf}, {1, 0}, {-kHalf, kHalf}};
    std::vector<int> meshes(models.size(), kNothing);
    for (const Placement& p : plan)
        if (meshes[p.model] == kNothing) meshes[p.model] = document.mesh(models[p.model].mesh);
    if (!gpu_instancing) {
        for (const Placement& p : plan)
            document.node(models[p.model].mesh.name, meshes[p.model],
                          move(p.x, 0, p.z) * turn_y(90.0 * p.quarter_turns));
        return;
    }
    for (std::uint32_t model = 0; model < models.size(); ++model) {
        if (meshes[model] == kNothing) continue;
        std::vector<vec3> translations;
        std::vector<vec4> rotations;
        for (const Placement& p : plan) {
            if (p.model != model) continue;
            translations.emplace_back(p.x, 0, p.z);
            rotations.emplace_back(0, kTurn[p.quarter_turns].x, 0, kTurn[p.quarter_turns].y);
        }
        document.instances(models[model].mesh.name, meshes[model], std::move(translations), std::move(rotations));
    }
}

}  // namespace

std::uint64_t write_city(const std::filesystem::path& path, const CityOptions& options) {
    if (options.parts && !options.flatten) throw Error(path.string(), "parts are for unique geometry: add --flatten");
    const std::vector<Model> models = city_models();
    const std::shared_ptr<const City> city =
        make_city(models, city_plan(models, options.triangles - std::min(options.triangles, kLandTriangles)),
                  city_materials().size());
    const std::vector<District> all = districts(*city, options);
    Bounds whole;
    std::uint64_t triangles = kLandTriangles, bytes = 0;
    for (const District& district : all)
        whole.add(district.bounds), triangles += district.triangles, bytes += district.bytes;

    if (options.parts) {
        write_parts(path, city, all, options.part_bytes, whole);
        return triangles;
    }
    Document document = start();
    add_views(document, whole);
    if (options.flatten) {
        if (bytes + kFixedJson > kFileLimit)
            throw Error(path.string(), "{} triangles take {} bytes, more than the 4 GiB of one .glb: add --parts",
                        triangles, bytes);
        for (std::size_t i = 0; i < all.size(); ++i) add_district(document, city, all[i], i);
    } else {
        add_instances(document, models, city->plan, options.gpu_instancing);
    }
    document.write(path);
    return triangles;
}

}  // namespace halflight::scenes
