#include "engine/tables/lights.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/names.h"
#include "engine/scene/light_types.h"
#include "engine/tables/alias_table.h"
#include "engine/tables/environment_warp.h"
#include "engine/tables/light_textures.h"
#include "engine/tables/light_tree.h"
#include "engine/tables/luminance.h"
#include "shaders/shared/light.h"
#include "shaders/shared/light_links.h"
#include "shaders/shared/vertex.h"
#include "shaders/shared/word.h"

namespace halflight {
namespace {

/// Groups of lights that get equal parts of the choices (lights.h).
enum Kind { kTriangles, kLocal, kDirectional, kEnvironment, kKinds };

/// Returns the rows of light links (shaders/shared/light_links.h).
std::vector<uvec4> link_rows(const Scene& scene, const TraceTables& trace, const std::vector<LightLinks>& sets) {
    std::vector<uvec4> rows{uvec4(1 + sets.size(), 0, 0, 0)};
    for (const auto& [receivers, blockers] : sets)
        rows.emplace_back(receivers, receivers >> 32, blockers, blockers >> 32);
    const std::size_t first = rows.size(), objects = trace.triangles.size() + trace.instances.size();
    rows.resize(first + (objects + shared::kClassesPerTexel - 1) / shared::kClassesPerTexel, uvec4(0));
    const auto set_class = [&](std::size_t object, std::size_t instance) {
        const std::uint32_t own = scene.instances[instance].link_class;
        const auto byte = static_cast<std::uint32_t>(object % shared::kClassesPerTexel);
        rows[first + object / shared::kClassesPerTexel][int(byte / 4)] |= own << (8 * (byte % 4));
    };
    for (const MeshRange& range : trace.ranges)
        for (std::size_t t = 0; range.merged && t < range.triangle_count; ++t)
            set_class(range.first_triangle + t, range.instance);
    for (std::size_t i = 0; i < trace.instances.size(); ++i)
        if (!trace.instances[i].identity) set_class(trace.triangles.size() + i, trace.instances[i].scene_instance);
    return rows;
}

class Builder {
  public:
    Builder(const Scene& scene, const TraceTables& trace, LightChoice choice, SunChoice sun, bool through)
        : scene_(scene), trace_(trace), choice_(choice), through_(through) {
        if (sun == SunChoice::apart) sun_ = strongest_sun();
        const double radius = 0.5 * glm::length(dvec3(trace.bounds.extent()));
        shadow_disk_ = kPi * (radius > 0 ? radius * radius : 1);
        std::ranges::transform(scene.light_profiles, std::back_inserter(lit_), lit_cone);
    }

    LightTables build() {
        add_triangles();
        for (const Size size : {Size::none, Size::ball, Size::disc})
            for (const PunctualLight& light : scene_.lights)
                if (&light != sun_ && size_of(light) == size) add_punctual(light);
        tables_.punctual_count = power_.size() - tables_.triangle_count;
        add_environment();
        const bool others = std::any_of(power_.begin(), power_.end(), [](double power) { return power > 0; });
        if (sun_ && !others) return Builder(scene_, trace_, choice_, SunChoice::among, through_).build();
        if (others) {
            choose();
            find_needs();
            if (sun_) add_sun();
        } else {
            tables_ = {};
            group_.clear();
            links_.clear();
            profiled_.clear();
        }
        add_groups();
        add_profiles();
        return std::move(tables_);
    }

  private:
    struct ProfiledLight {
        std::size_t light;  // its number
        const PunctualLight* from;
    };

    void add(const std::array<vec4, shared::kLightStride>& rows, double power, Kind kind, std::uint32_t group,
             const LightLinks& links) {
        if (power_.size() >= (1u << 29)) throw Error(scene_.name, "2^29 lights or more");
        group_.push_back(group);
        links_.push_back(links);
        tables_.rows.insert(tables_.rows.end(), rows.begin(), rows.end());
        power_.push_back(power);
        kind_.push_back(kind);
    }

    /// Fills in the tables of light groups and links.
    void add_groups() {
        const std::vector<LightLinks> sets = link_sets();
        tables_.needs.light_links = sets.size() > 1;
        for (const LightLinks& set : sets) tables_.needs.shadow_links |= set.blockers != LightLinks().blockers;
        if (scene_.light_groups.empty() && sets.size() == 1) return;
        const auto last = static_cast<std::uint32_t>(std::max<std::size_t>(scene_.light_groups.size(), 1) - 1);
        tables_.groups = {scene_.environment.light_group, last};
        tables_.groups.insert(tables_.groups.end(), group_.begin(), group_.end());
        for (std::uint32_t& group : tables_.groups) group = std::min(group, last);
        if (sets.size() == 1) return;
        const auto add_set = [&](std::uint32_t& entry, const LightLinks& links) {
            const auto set = std::ranges::find(sets, links);
            if (set != sets.end()) entry |= static_cast<std::uint32_t>(set - sets.begin()) << shared::kLightGroupBits;
        };
        add_set(tables_.groups[0], scene_.environment.links);
        for (std::size_t i = 0; i < links_.size(); ++i) add_set(tables_.groups[i + 2], links_[i]);
        tables_.links = link_rows(scene_, trace_, sets);
    }

    /// Returns the different links of lights, first those of lights that leave nothing out.
    std::vector<LightLinks> link_sets() const {
        std::vector<LightLinks> sets{LightLinks()};
        for (const LightLinks& links : links_)
            if (std::ranges::find(sets, links) == sets.end()) sets.push_back(links);
        return sets;
    }

    struct Owners {
        std::uint32_t group;
        LightLinks links;
    };
    /// Returns group and links of the light that a triangle emits. instance: number in TraceTables::instances;
    /// triangle: place in the tables of all geometry.
    Owners owners_of(std::size_t instance, std::uint32_t triangle, const Material& material) const {
        if (!instances_own_) return {kNoLightGroup, material.links};
        const TriangleSource source = source_of(trace_, static_cast<std::uint32_t>(instance), triangle);
        const Instance& own = scene_.instances[source.instance];
        return {std::min(own.light_group, material.light_group), both(own.links, material.links)};
    }

    /// Adds the bounds of the light that is added next.
    void add_to_tree(const LightBounds& bounds) {
        if (!(bounds.intensity > 0)) return;
        bounds_.push_back(bounds);
        in_tree_.push_back(static_cast<std::uint32_t>(power_.size()));
    }

    // --- Emissive triangles ---------------------------------------------------------------------------------------

    /// Returns the mean luminance that a triangle emits; 0: no light. uvs_of(set) returns the uvs of its corners.
    template <class UvsOf>
    double brightness(std::uint32_t triangle, UvsOf uvs_of) {
        const Material& material = scene_.materials[trace_.triangles[triangle].w & kTriangleMaterialMask];
        const double factor = material.unlit ? 0 : luminance_of(dvec3(material.emission));
        const TextureRef& texture = material.emission_texture;
        if (factor == 0 || !texture) return factor;
        const auto found = sums_.find(texture.image);
        const LuminanceSums& sums =
            found != sums_.end()
                ? found->second
                : sums_.emplace(texture.image, scene_.images[static_cast<std::size_t>(texture.image)]).first->second;
        return factor * sums.mean(texture, uvs_of(texture.uv_set));
    }

    std::array<vec2, 3> uvs_in_mesh(const MeshRange& range, std::uint32_t triangle, int set) const {
        const Mesh& mesh = scene_.meshes[range.mesh];
        const std::vector<vec2>& uvs = mesh.uvs[static_cast<std::size_t>(set)];
        if (uvs.empty()) return {};
        const uvec3 vertices = mesh.triangles[triangle - range.first_triangle];
        return {uvs[vertices.x], uvs[vertices.y], uvs[vertices.z]};
    }

    /// Returns the uvs of row `triangle` of the tables of a paged scene.
    std::array<vec2, 3> uvs_in_rows(std::uint32_t triangle, int set) const {
        const std::vector<vec4>& rows = trace_.absent->attributes;
        const std::size_t texels = rows.size() / trace_.positions.size();
        std::array<vec2, 3> uvs{};
        if (texels <= shared::kVertexUvTexel) return uvs;
        for (std::size_t k = 0; k < 3; ++k) {
            const vec4* row = &rows[(3 * std::size_t{triangle} + k) * texels];
            const vec4& more = row[shared::kVertexUvTexel];
            uvs[k] = set == 0 ? vec2(row[shared::kVertexNormalTexel].w, more.x) : vec2(more.y, more.z);
        }
        return uvs;
    }

    /// Adds the emissive triangles of a paged scene.
    void add_rows() {
        for (std::uint32_t t = 0; t < trace_.triangles.size(); ++t) {
            const double value = brightness(t, [&](int set) { return uvs_in_rows(t, set); });
            if (value == 0) continue;
            tables_.light_of_triangle.push_back(trace_.absent->resident[t]);
            add_triangle(0, t, value, trace_.absent->resident[t]);
        }
        tables_.triangle_count = power_.size();
        // Kernels read groups of 16 bytes, so entries after the last triangle must not disturb their search.
        while (tables_.light_of_triangle.size() % 4 != 0) tables_.light_of_triangle.push_back(shared::kNoLight);
    }

    void add_triangles() {
        if (trace_.absent) {
            add_rows();
            return;
        }
        struct Emitter {
            std::uint32_t triangle;
            double brightness;
        };
        std::vector<std::vector<Emitter>> emitters(trace_.blocks.size());
        std::vector<std::uint32_t> rank(trace_.triangles.size(), shared::kNoLight);
        bool any = false;
        for (const MeshRange& range : trace_.ranges) {
            for (std::uint32_t t = range.first_triangle; t < range.first_triangle + range.triangle_count; ++t) {
                const double value = brightness(t, [&](int set) { return uvs_in_mesh(range, t, set); });
                if (value == 0) continue;
                rank[t] = static_cast<std::uint32_t>(emitters[range.block].size());
                emitters[range.block].push_back({t, value});
                any = true;
            }
        }
        if (!any) return;
        const bool shared_blocks = trace_.blocks.size() > 1 || !trace_.instances.front().identity;
        for (std::size_t i = 0; i < trace_.instances.size(); ++i) {
            if (shared_blocks) rank.push_back(static_cast<std::uint32_t>(power_.size()));
            for (const Emitter& emitter : emitters[trace_.instances[i].block])
                add_triangle(i, emitter.triangle, emitter.brightness, emitter.triangle);
        }
        tables_.light_of_triangle = std::move(rank);
        tables_.triangle_count = power_.size();
    }

    /// Adds a triangle of an instance of the tables. `place`: its place in the tables of all geometry.
    void add_triangle(std::size_t number, std::uint32_t triangle, double brightness, std::uint32_t place) {
        const BlockInstance& instance = trace_.instances[number];
        const glm::dmat4x3 to_world(instance.block_to_world);
        const glm::dmat4x3 to_block(instance.world_to_block);
        const uvec4 corners = trace_.triangles[triangle];
        std::array<dvec3, 3> p;
        dvec3 block_reach(0);
        for (int k = 0; k < 3; ++k) {
            const dvec3 in_block(trace_.positions[corners[k]]);
            p[static_cast<std::size_t>(k)] = to_world * dvec4(in_block, 1);
            block_reach = glm::max(block_reach, glm::abs(in_block));
        }
        const dvec3 e1 = p[1] - p[0];
        const dvec3 e2 = p[2] - p[0];
        const dvec3 cross = glm::cross(e1, e2);
        const double area = 0.5 * glm::length(cross);
        // The error has three roundings: of the row, of the point on it, and of the tracer's plane (surface_at gives
        // the reasons).
        constexpr double kUlp = 0x1p-24;
        dvec3 error = 8 * kUlp * (glm::abs(p[0]) + glm::abs(e1) + glm::abs(e2));
        if (!instance.identity) {
            const dvec3 reach = glm::max(glm::abs(dvec3(trace_.bounds.lower)), glm::abs(dvec3(trace_.bounds.upper)));
            const auto absolute = [](const glm::dmat4x3& m, const dvec3& v) {
                return glm::abs(m[0]) * v.x + glm::abs(m[1]) * v.y + glm::abs(m[2]) * v.z;
            };
            error +=
                8 * kUlp * absolute(to_world, block_reach + absolute(to_block, reach + 2.0 * glm::abs(to_world[3])));
        }
        const Material& material = scene_.materials[corners.w & kTriangleMaterialMask];
        if (area > 0) {
            add_to_tree({.lower = glm::min(glm::min(p[0], p[1]), p[2]),
                         .upper = glm::max(glm::max(p[0], p[1]), p[2]),
                         .axis = cross / (2 * area),
                         .intensity = area * brightness,
                         .two_sided = true});
        }
        const bool mirrored = (corners.w & kTriangleMirrored) != 0 || glm::determinant(glm::dmat3(to_world)) < 0;
        const auto bound = static_cast<float>(mirrored ? -glm::length(error) : glm::length(error));
        const auto [group, links] = owners_of(number, place, material);
        add({vec4(vec3(p[0]), shared::float_of_word(shared::kLightTriangle)),
             vec4(vec3(e1), shared::float_of_word(triangle)), vec4(vec3(e2), bound), vec4(material.emission, 0)},
            area > 0 ? 2 * kPi * area * brightness : 0, kTriangles, group, links);
        area_.push_back(area);
    }

    // --- Other lights ---------------------------------------------------------------------------------------------

    enum class Size { none, ball, disc };
    static Size size_of(const PunctualLight& light) {
        if (light.type == LightType::directional) return light.angle > 0 ? Size::disc : Size::none;
        return light.radius > 0 ? Size::ball : Size::none;
    }

    void add_punctual(const PunctualLight& light) {
        const double intensity = luminance_of(dvec3(light.intensity));
        if (intensity == 0) return;
        const LightTypeRow& type = row_of(light.type);
        const LitCone* lit = light.profile == kNone ? nullptr : &lit_[static_cast<std::size_t>(light.profile)];
        if (lit && lit->share == 0) return;
        if (lit) profiled_.push_back({power_.size(), &light});
        tables_.needs.light_profiles |= lit != nullptr;
        if (type.need && &light != sun_) tables_.needs.*type.need = true;
        const Size size = size_of(light);
        tables_.needs.sized_lamps |= size == Size::ball;
        tables_.needs.sized_suns |= size == Size::disc;
        balls_ += size == Size::ball ? 1 : 0;
        discs_ += size == Size::disc && &light != sun_ ? 1 : 0;
        const double sine = std::sin(0.5 * double(light.angle));
        const float cos_outer = std::cos(light.outer_cone);
        const float cone = std::max(std::cos(light.inner_cone) - cos_outer, 0.001f);
        const bool directional = light.type == LightType::directional;
        if (!directional) {
            const dvec3 at = light.position - trace_.origin;
            const bool spot = light.type == LightType::spot;
            const dvec3 reach(light.radius);
            add_to_tree({.lower = at - reach,
                         .upper = at + reach,
                         .axis = (lit && lit->reversed ? -1.0 : 1.0) * dvec3(light.direction),
                         .theta_o = spot  ? double(light.inner_cone)
                                    : lit ? lit->angle
                                          : kPi,
                         .theta_e = spot ? double(light.outer_cone) - double(light.inner_cone) : kPi / 2,
                         .intensity = lit ? intensity * lit->share : intensity,
                         .sized = light.radius > 0});
        }
        double solid_angle =
            light.type == LightType::spot ? 2 * kPi * (1 - std::cos(double(light.outer_cone))) : 4 * kPi;
        if (lit) solid_angle = 2 * kPi * (1 - std::cos(lit->angle)) * lit->share;
        add({vec4(vec3(light.position - trace_.origin), shared::float_of_word(type.kind)),
             vec4(light.direction, cos_outer), vec4(1 / cone, directional ? sine * sine : double(light.radius), 0, 0),
             vec4(light.intensity, 0)},
            intensity * (directional ? shadow_disk_ : solid_angle), directional ? kDirectional : kLocal,
            light.light_group, light.links);
    }

    /// Appends the profiles of lights, as light.h says.
    void add_profiles() {
        if (profiled_.empty()) return;
        std::vector<vec4>& rows = tables_.rows;
        const std::size_t lights = rows.size();
        rows.resize(lights + shared::kLightProfileHeader * profiled_.size());
        std::map<int, std::size_t> places;  // first texel of a profile
        for (std::size_t i = 0; i < profiled_.size(); ++i) {
            const auto& [light, from] = profiled_[i];
            const auto [place, fresh] = places.emplace(from->profile, rows.size());
            const std::size_t header = lights + i * shared::kLightProfileHeader;
            rows[light * shared::kLightStride + 2].w = shared::float_of_word(static_cast<std::uint32_t>(header));
            rows[header] = vec4(from->right, shared::float_of_word(static_cast<std::uint32_t>(place->second)));
            rows[header + 1] = vec4(from->up, 0);
            if (!fresh) continue;
            const LightProfile& profile = scene_.light_profiles[static_cast<std::size_t>(from->profile)];
            const auto count = [](const std::vector<float>& of) {
                return shared::float_of_word(static_cast<std::uint32_t>(of.size()));
            };
            rows.emplace_back(count(profile.vertical), count(profile.horizontal), 0, 0);
            for (const auto* numbers : {&profile.vertical, &profile.horizontal, &profile.shares})
                for (std::size_t k = 0; k < numbers->size(); k += 4) {
                    vec4& texel = rows.emplace_back(0);
                    for (std::size_t c = 0; c < std::min<std::size_t>(4, numbers->size() - k); ++c)
                        texel[static_cast<int>(c)] = (*numbers)[k + c];
                }
        }
        rows.emplace_back(shared::float_of_word(static_cast<std::uint32_t>(lights)), 0, 0, -1);
    }

    /// Returns the strongest directional light, or null if there is none.
    const PunctualLight* strongest_sun() const {
        const PunctualLight* sun = nullptr;
        double most = 0;
        for (const PunctualLight& light : scene_.lights) {
            const double irradiance = luminance_of(dvec3(light.intensity));
            if (light.type == LightType::directional && irradiance > most) sun = &light, most = irradiance;
        }
        return sun;
    }

    /// Appends the row of the separate sun, after the choice among all others is built.
    void add_sun() {
        add_punctual(*sun_);
        tables_.rows.back().w = 1;
        tables_.needs.sun = true;
    }

    void add_environment() {
        const Environment& environment = scene_.environment;
        if (environment.black()) return;
        const bool constant = environment.map.pixels.empty();
        tables_.environment = constant ? Image(1, 1, 3) : environment.map;
        std::vector<float>& pixels = tables_.environment.pixels;
        if (constant) std::fill(pixels.begin(), pixels.end(), 1.0f);
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            pixels[i] *= environment.color[static_cast<int>(i % 3)];
            if (!std::isfinite(pixels[i]))
                throw Error(scene_.name, "the environment '{}' is too bright for float32", environment.name);
        }
        double integral = 4 * kPi * luminance_of(dvec3(environment.color));
        if (!constant) {
            cells_ = environment_cells(tables_.environment);
            integral = cells_->integral;
        }
        if (integral == 0) {
            tables_.environment = Image();
            return;
        }
        add({vec4(0, 0, 0, shared::float_of_word(shared::kLightEnvironment)), vec4(0), vec4(0), vec4(0)},
            shadow_disk_ * integral, kEnvironment, environment.light_group, environment.links);
    }

    // --- Choice ---------------------------------------------------------------------------------------------------

    void choose() {
        std::array<double, kKinds> of_kind{};
        for (std::size_t i = 0; i < power_.size(); ++i) of_kind[kind_[i]] += power_[i];
        const double total = std::accumulate(of_kind.begin(), of_kind.end(), 0.0);
        const auto kinds =
            static_cast<double>(std::count_if(of_kind.begin(), of_kind.end(), [](double p) { return p > 0; }));
        const auto shining =
            static_cast<double>(std::count_if(power_.begin(), power_.end(), [](double p) { return p > 0; }));
        const std::optional<LightTree> tree = tree_for_choice();
        tables_.choice = tree                              ? LightChoice::tree
                         : choice_ == LightChoice::uniform ? LightChoice::uniform
                                                           : LightChoice::power;
        const bool every = samples_all();
        if (every) tables_.choice = LightChoice::all;
        const double equal = 0.125 / shining;
        std::vector<double> weights(power_.size());
        for (std::size_t i = 0; i < power_.size(); ++i) {
            if (power_[i] > 0)
                weights[i] = choice_ == LightChoice::uniform
                                 ? 1 / shining
                                 : power_[i] * (0.625 / total + 0.25 / (kinds * of_kind[kind_[i]])) + equal;
        }
        if (tree) add_tree(*tree, weights, equal);
        // Rays look at each of these lights, and drivers end loops of 65535 steps.
        constexpr std::uint32_t kMostOneByOne = 60000;
        if (const std::uint32_t alone = tree ? discs_ : balls_ + discs_; alone > kMostOneByOne)
            throw Error(scene_.name, "{} lights with a size; the limit is {}{}", alone, kMostOneByOne,
                        tree ? " directional ones" : ", but for lamps with --estimator lights=tree");
        if (tables_.punctual_count > 0) {
            vec4& last = tables_.rows[(tables_.triangle_count + tables_.punctual_count - 1) * shared::kLightStride + 2];
            last.z = shared::float_of_word(tree ? discs_ : balls_ + discs_);
        }
        AliasTable table = build_alias_table(weights);
        for (const AliasEntry& entry : table.entries)
            tables_.alias.emplace_back(entry.threshold, shared::float_of_word(entry.alias));
        for (double& probability : table.probabilities) probability *= 1 - tables_.tree_share;
        if (every) std::fill(table.probabilities.begin(), table.probabilities.end(), 1.0);
        if (tree) {
            shared::LightTreeHeader header = light_tree_header(tables_.tree);
            header.gain = static_cast<float>(tables_.tree_share / table.probabilities[in_tree_[0]]);
            header.share = static_cast<float>(tables_.tree_share);
            header.through = through_ ? 1 : 0;
            set_light_tree_header(tables_.tree, header);
        }
        for (std::size_t i = 0; i < power_.size(); ++i) {
            const double density =
                i < area_.size() ? (area_[i] > 0 ? table.probabilities[i] / area_[i] : 0) : table.probabilities[i];
            tables_.rows[i * shared::kLightStride + 3].w = static_cast<float>(density);
        }
        if (has_environment()) {
            const double share = table.probabilities.back();
            tables_.environment_warp = cells_ ? environment_warp(*cells_, share, through_)
                                              : constant_environment(scene_.environment.color, share, through_);
        }
        tables_.probabilities = std::move(table.probabilities);
    }

    void find_needs() {
        LightNeeds& needs = tables_.needs;
        needs.area_lights = tables_.triangle_count > 0;
        needs.punctual_lights = tables_.punctual_count > 0;
        needs.environment = !tables_.environment.pixels.empty();
        needs.environment_map = needs.environment && !scene_.environment.map.pixels.empty();
        needs.light_choice = tables_.probabilities.size() > 1;
        needs.light_tree = !tables_.tree.empty();
    }

    /// Returns whether every light is sampled.
    bool samples_all() const {
        if (power_.size() < 2 || lone_pair()) return false;
        return choice_ == LightChoice::all ? power_.size() <= kMostLightsOfAll
                                           : choice_ == LightChoice::automatic && power_.size() <= kFewLights;
    }

    /// Returns whether the only lights are the two triangles of a square, and a choice that knows better may treat them
    /// as one.
    bool lone_pair() const {
        return choice_ != LightChoice::tree && power_.size() == 2 && in_tree_.size() == 2 &&
               act_as_one(bounds_[0], bounds_[1]);
    }

    bool has_environment() const { return kind_.back() == kEnvironment; }

    /// Returns the light tree, or none if another choice is requested or there is nothing to choose from.
    std::optional<LightTree> tree_for_choice() {
        const bool wanted =
            choice_ == LightChoice::tree || choice_ == LightChoice::automatic || choice_ == LightChoice::all;
        if (!wanted || in_tree_.size() + (has_environment() ? 1 : 0) < 2 || in_tree_.empty()) return {};
        if (in_tree_.size() > (std::size_t{1} << shared::kLightTreeDepth)) throw Error(scene_.name, "over 2^26 lights");
        if (samples_all() || lone_pair()) return {};
        return build_light_tree(bounds_, in_tree_);
    }

    /// Moves the weights of the tree's lights and of the environment, except their equal parts, to the tree. The alias
    /// table keeps the rest.
    void add_tree(const LightTree& tree, std::vector<double>& weights, double equal) {
        double share = 0;
        for (std::size_t i = 0; i < in_tree_.size(); ++i) {
            const std::uint32_t light = in_tree_[i];
            share += weights[light] - equal;
            weights[light] = equal;
            float& head = tables_.rows[std::size_t{light} * shared::kLightStride].w;
            head = shared::float_of_word(shared::word_of_float(head) | tree.trails[i] << shared::kLightKindBits);
        }
        if (has_environment()) {
            share += weights.back() - equal;
            weights.back() = equal;
        }
        // The share is a multiple of 2^-24, like the random numbers that it is compared with.
        tables_.tree_share = std::round(share * 0x1p24) * 0x1p-24;
        tables_.tree = tree.rows;
    }

    const Scene& scene_;
    const TraceTables& trace_;
    const LightChoice choice_;
    const bool through_;                   // some surface transmits light
    const PunctualLight* sun_ = nullptr;   // sun that is sampled apart; null: none
    double shadow_disk_ = 0;               // m^2
    std::map<int, LuminanceSums> sums_;    // sums of luminance by image
    std::uint32_t balls_ = 0;              // number of points and spots with a size
    std::uint32_t discs_ = 0;              // number of directional lights with a size, without sun_
    std::vector<ProfiledLight> profiled_;  // lights with a profile
    std::vector<LitCone> lit_;             // cone of each profile
    std::vector<double> power_;            // power per light
    std::vector<Kind> kind_;               // kind per light
    std::vector<double> area_;             // area per triangle light, m^2
    std::vector<std::uint32_t> group_;     // light group per light; kNoLightGroup: the last
    std::vector<LightLinks> links_;        // links per light
    // Some instance may have a light group or links of its own.
    const bool instances_own_ =
        !scene_.light_groups.empty() ||
        std::ranges::any_of(scene_.instances, [](const Instance& i) { return i.links != LightLinks(); });
    std::vector<LightBounds> bounds_;        // bounds of the lights that a tree may hold
    std::vector<std::uint32_t> in_tree_;     // indices of the lights that a tree may hold
    std::optional<EnvironmentCells> cells_;  // cells of the environment map
    LightTables tables_;
};

}  // namespace

const char* name(LightChoice choice) {
    return name_among(kLightChoices, {"auto", "power", "tree", "uniform", "all"}, choice);
}

const char* name(SunChoice choice) {
    return name_among(kSunChoices, {"apart", "among"}, choice);
}

LightTables build_lights(const Scene& scene, const TraceTables& trace, LightChoice choice, SunChoice sun,
                         bool through) {
    return Builder(scene, trace, choice, sun, through).build();
}

}  // namespace halflight
