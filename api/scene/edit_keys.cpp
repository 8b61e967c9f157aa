#include "api/halflight/edit_keys.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <tuple>

#include "api/halflight/camera.h"
#include "api/halflight/edit_text.h"
#include "engine/core/error.h"
#include "engine/core/names.h"
#include "engine/core/suggestion.h"

namespace halflight {
namespace {

using Of = EditTrack::Of;

using Numbers = std::vector<double>;

/// Returns the numbers of a text; none if it is no list of finite numbers.
std::optional<Numbers> listed_numbers(const std::string& text) {
    Numbers values;
    for (const std::string& part : split_names(text)) {
        const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), values.emplace_back());
        if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(values.back()))
            return std::nullopt;
    }
    return values;
}

std::string list_text(const Numbers& values) {
    return fmt::format("{}", fmt::join(values, ","));
}
std::string list_text(const dvec3& v) {
    return fmt::format("{},{},{}", v.x, v.y, v.z);
}

/// Returns `count` numbers within a range.
Numbers checked_numbers(const std::string& subject, const std::string& text, std::size_t count,
                        const EditRange& range) {
    const auto values = listed_numbers(text);
    if (!values || values->size() != count)
        throw Error(subject, "expects {}, not '{}'", count == 1 ? "one number" : "three numbers", text);
    for (const double value : *values)
        if (!(value >= range.lower && value <= range.upper))
            throw Error(subject, "expects numbers from {} to {}, not {}", range.lower, range.upper, value);
    return *values;
}

/// A value of the scene, the environment or the camera.
struct SingleValue {
    Of of;
    const char* key;
    std::size_t count;  // count of its numbers; 0: a text
    EditRange range;
    void (*set)(SceneEdits& edits, const Numbers& v);           // null: of the camera
    Numbers (*get)(const SceneEdits& edits);                    // empty: not edited
    void (*set_camera)(KeyedCamera& camera, const Numbers& v);  // null: of the scene
    Numbers (*get_camera)(const KeyedCamera& camera);           // empty: not edited
};
constexpr double kLeastLength = 1e-30, kMostLength = 1e30;  // ranges of lengths in settings files

Numbers numbers_of(const std::optional<dvec3>& v) {
    return v ? Numbers{v->x, v->y, v->z} : Numbers();
}
dvec3 point_of(const Numbers& v) {
    return {v[0], v[1], v[2]};
}
constexpr SingleValue kSingles[] = {
    {Of::scene, "emission", 1, kEditFactor, [](SceneEdits& e, const Numbers& v) { e.emission = float(v[0]); },
     [](const SceneEdits& e) { return Numbers{double(e.emission)}; }, nullptr, nullptr},
    {Of::scene, "lamp_radius", 1, kEditRadius, [](SceneEdits& e, const Numbers& v) { e.lamp_radius = float(v[0]); },
     [](const SceneEdits& e) { return e.lamp_radius ? Numbers{double(*e.lamp_radius)} : Numbers(); }, nullptr, nullptr},
    {Of::scene, "sun_angle", 1, kEditAngle, [](SceneEdits& e, const Numbers& v) { e.sun_angle = float(v[0]); },
     [](const SceneEdits& e) { return e.sun_angle ? Numbers{double(*e.sun_angle)} : Numbers(); }, nullptr, nullptr},
    {Of::environment, "rotation", 1, kEditRotation,
     [](SceneEdits& e, const Numbers& v) { e.environment_rotation = v[0]; },
     [](const SceneEdits& e) { return Numbers{e.environment_rotation}; }, nullptr, nullptr},
    {Of::environment, "intensity", 1, kEditFactor,
     [](SceneEdits& e, const Numbers& v) { e.environment_intensity = float(v[0]); },
     [](const SceneEdits& e) { return Numbers{double(e.environment_intensity)}; }, nullptr, nullptr},
    {Of::environment, "tint", 3, kEditColor,
     [](SceneEdits& e, const Numbers& v) { e.environment_tint = vec3(point_of(v)); },
     [](const SceneEdits& e) { return numbers_of(dvec3(e.environment_tint)); }, nullptr, nullptr},
    {Of::camera, "camera", 0, {}, nullptr, nullptr, nullptr, nullptr},
    {Of::camera,
     "from",
     3,
     {-kMostLength, kMostLength},
     nullptr,
     nullptr,
     [](KeyedCamera& c, const Numbers& v) { c.from = point_of(v); },
     [](const KeyedCamera& c) { return numbers_of(c.from); }},
    {Of::camera,
     "at",
     3,
     {-kMostLength, kMostLength},
     nullptr,
     nullptr,
     [](KeyedCamera& c, const Numbers& v) { c.at = point_of(v); },
     [](const KeyedCamera& c) { return numbers_of(c.at); }},
    {Of::camera,
     "up",
     3,
     {-kMostLength, kMostLength},
     nullptr,
     nullptr,
     [](KeyedCamera& c, const Numbers& v) { c.up = point_of(v); },
     [](const KeyedCamera& c) { return numbers_of(c.up); }},
    {Of::camera,
     "vfov_degrees",
     1,
     {0.005, 179.99},
     nullptr,
     nullptr,
     [](KeyedCamera& c, const Numbers& v) { c.vfov = v[0]; },
     [](const KeyedCamera& c) { return c.vfov ? Numbers{*c.vfov} : Numbers(); }},
    {Of::camera,
     "ortho_height",
     1,
     {kLeastLength, kMostLength},
     nullptr,
     nullptr,
     [](KeyedCamera& c, const Numbers& v) { c.ortho_height = v[0]; },
     [](const KeyedCamera& c) { return c.ortho_height ? Numbers{*c.ortho_height} : Numbers(); }},
    {Of::camera,
     "focus",
     1,
     {kLeastLength, kMostLength},
     nullptr,
     nullptr,
     [](KeyedCamera& c, const Numbers& v) { c.lens.focus = {.kind = Focus::Kind::distance, .distance = v[0]}; },
     [](const KeyedCamera& c) {
         return c.lens.focus.kind == Focus::Kind::distance ? Numbers{c.lens.focus.distance} : Numbers();
     }},
    {Of::camera,
     "fstop",
     1,
     {0.01, 1e6},
     nullptr,
     nullptr,
     [](KeyedCamera& c, const Numbers& v) { c.lens.fstop = float(v[0]); },
     [](const KeyedCamera& c) { return c.lens.fstop > 0 ? Numbers{double(c.lens.fstop)} : Numbers(); }},
};

const SingleValue& single(Of of, const std::string& key, const std::string& subject) {
    const auto row = std::ranges::find_if(kSingles, [&](const SingleValue& s) { return s.of == of && s.key == key; });
    if (row != std::end(kSingles)) return *row;
    std::vector<std::string> names;
    for (const SingleValue& s : kSingles)
        if (s.of == of) names.emplace_back(s.key);
    throw Error(subject, "'{}' is none of {}{}", key, fmt::join(names, ", "), did_you_mean(key, names));
}

/// Returns a value that has no effect, for values that are always there; "": there is none.
std::string without_effect(Of of, const std::string& key) {
    if (of == Of::hide || (of == Of::lights && key == "off")) return "false";
    if (of == Of::lights && key == "factor") return "1";
    if (of == Of::nodes && (key == "translate" || key == "rotate")) return "0,0,0";
    return of == Of::nodes && key == "scale" ? "1,1,1" : "";
}

/// Interpolates spherically between two unit vectors, along the shorter arc (Shoemake 1985).
dvec3 arc_between(const dvec3& a, const dvec3& b, double t) {
    const double angle = std::acos(std::clamp(glm::dot(a, b), -1.0, 1.0));
    if (angle < 1e-6) return glm::normalize(glm::mix(a, b, t));
    if (angle > kPi - 1e-6) return t < 0.5 ? a : b;  // no arc is the shortest one
    return (std::sin((1 - t) * angle) * a + std::sin(t * angle) * b) / std::sin(angle);
}

/// A linear map as a rotation after a stretch, which is symmetric unless the map mirrors.
struct Polar {
    glm::dquat rotation;
    dmat3 stretch;
    /// Finds the closest rotation by the iteration of Higham (1986).
    explicit Polar(const dmat3& m) {
        dmat3 r = m;
        for (int i = 0; i < 64; ++i) {
            const dmat3 next = 0.5 * (r + glm::transpose(glm::inverse(r)));
            if (next == r) break;
            r = next;
        }
        if (glm::determinant(r) < 0) r = -r;
        rotation = glm::normalize(glm::quat_cast(r));
        stretch = glm::transpose(r) * m;
    }
};

/// Interpolates matrices of 12 numbers, by rows.
Numbers matrix_between(const Numbers& a, const Numbers& b, double t) {
    const auto linear = [](const Numbers& v) {
        dmat3 m;
        for (int i = 0; i < 9; ++i) m[i % 3][i / 3] = v[std::size_t(i / 3 * 4 + i % 3)];
        return m;
    };
    const Polar from(linear(a)), to(linear(b));
    const dmat3 m =
        glm::mat3_cast(glm::slerp(from.rotation, to.rotation, t)) * (from.stretch * (1 - t) + to.stretch * t);
    Numbers mixed(12);
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) mixed[std::size_t(4 * r + c)] = m[c][r];
        const auto place = std::size_t(4 * r + 3);
        mixed[place] = a[place] + t * (b[place] - a[place]);
    }
    return mixed;
}

}  // namespace

const char* name(Of of) {
    switch (of) {
        case Of::scene:
            return "scene";
        case Of::environment:
            return "environment";
        case Of::camera:
            return "camera";
        case Of::lights:
            return "lights";
        case Of::materials:
            return "materials";
        case Of::nodes:
            return "nodes";
        case Of::hide:
            return "hide";
    }
    return "";
}

std::string sample(const EditTrack& track, double frame) {
    const auto later = std::ranges::upper_bound(track.keys, frame, {}, &EditTrack::Key::frame);
    if (later == track.keys.begin()) return later->value;
    const EditTrack::Key& a = *std::prev(later);
    if (later == track.keys.end() || track.step || a.value == later->value || a.frame == frame) return a.value;
    const auto from = listed_numbers(a.value), to = listed_numbers(later->value);
    if (!from || !to || from->size() != to->size() || (track.of == Of::camera && track.key == "camera")) return a.value;
    const double t = (frame - a.frame) / (later->frame - a.frame);
    if (track.key == "direction")
        return list_text(arc_between(glm::normalize(point_of(*from)), glm::normalize(point_of(*to)), t));
    if (track.key == "matrix") return list_text(matrix_between(*from, *to, t));
    Numbers mixed = *from;
    for (std::size_t i = 0; i < mixed.size(); ++i) mixed[i] += t * ((*to)[i] - mixed[i]);
    return list_text(mixed);
}

bool EditKeys::has(std::initializer_list<Of> kinds) const {
    return std::ranges::any_of(tracks,
                               [&](const EditTrack& t) { return std::ranges::find(kinds, t.of) != kinds.end(); });
}

std::string checked_value(Of of, const std::string& key, const std::string& value, const std::string& subject) {
    const auto listed = listed_numbers(value);
    if (without_effect(of, key) == "false") {
        if (value != "true" && value != "false") throw Error(subject, "is neither true nor false");
        return value;
    }
    if (of == Of::lights) {
        if (key == "ies" || key == "on") throw Error(subject, "'{}' has no keys over frames", key);
        LightEdit edit;
        set_key(edit, subject, key, value);
        if (listed) return list_text(*listed);
        for (const auto& row : light_edit_keys())
            if (row.name == key) return row.get(edit);
    }
    if (of == Of::nodes) {
        NodeEdit edit;
        set_key(edit, subject, key, value);
        Numbers v = *listed;  // set_key() accepts numbers only
        if (key == "scale" && v.size() == 1) v = Numbers(3, v[0]);
        if (key == "matrix") v.resize(12);
        return list_text(v);
    }
    if (of == Of::materials) {
        MaterialEdit edit;
        set_key(edit, subject, key, value);
        return listed ? list_text(*listed) : property_text(edit.at(key));
    }
    const SingleValue& row = single(of, key, subject);
    if (row.count > 0) return list_text(checked_numbers(subject, value, row.count, row.range));
    if (value.empty()) throw Error(subject, "is empty");
    return value;
}

namespace {

/// Sets the source of an edit among `edits`; the edit of an added light has none there.
template <class Edit>
void set_source(std::vector<NamedEdit<Edit>>& edits, const Edit& edit, const std::string& source) {
    for (NamedEdit<Edit>& named : edits)
        if (&named.edit == &edit) named.source = source;
}

}  // namespace

void apply_keys(const EditKeys& keys, double frame, SceneEdits& edits) {
    for (const EditTrack& track : keys.tracks) {
        if (track.of == Of::camera) continue;
        const std::string value = sample(track, frame);
        if (value.empty()) continue;
        if (track.of == Of::lights) {
            LightEdit& edit = light_edit(edits, track.name);
            set_source(edits.lights, edit, track.source);
            if (track.key == "off")
                edit.off = value == "true";
            else
                set_key(edit, track.source, track.key, value);
        } else if (track.of == Of::materials) {
            MaterialEdit& edit = material_edit(edits, track.name);
            set_source(edits.materials, edit, track.source);
            set_key(edit, track.source, track.key, value);
        } else if (track.of == Of::nodes) {
            NodeEdit& edit = node_edit(edits, track.name);
            set_source(edits.nodes, edit, track.source);
            set_key(edit, track.source, track.key, value);
        } else if (track.of == Of::hide) {
            std::erase(edits.hidden, ObjectName{track.name});
            if (value == "true") add_hidden(edits, track.source, track.name);
        } else {
            single(track.of, track.key, track.source).set(edits, *listed_numbers(value));
        }
    }
}

KeyedCamera keyed_camera(const EditKeys& keys, double frame) {
    KeyedCamera camera;
    for (const EditTrack& track : keys.tracks) {
        if (track.of != Of::camera) continue;
        const std::string value = sample(track, frame);
        if (value.empty()) continue;
        if (track.key == "camera")
            camera.camera = value;
        else
            single(Of::camera, track.key, track.source).set_camera(camera, *listed_numbers(value));
    }
    return camera;
}

Camera with_keys(Camera camera, const KeyedCamera& keys, const std::optional<CameraPose>& free) {
    if (keys.from || keys.at || keys.up) {
        const dvec3 from = keys.from.value_or(free ? free->from : dvec3(camera.camera_to_world[3]));
        const dvec3 ahead = from - dvec3(camera.camera_to_world[2]), own_up(camera.camera_to_world[1]);
        const dvec3 at = keys.at.value_or(free ? free->at : ahead);
        const dvec3 up = keys.up.value_or(free ? free->up : keys.at ? dvec3(0, 1, 0) : own_up);
        const Camera looking = look_at_camera(from, at, up, camera.vertical_fov);
        camera.camera_to_world = looking.camera_to_world;
        if (keys.from && keys.at) camera.near_plane = looking.near_plane, camera.far_plane = looking.far_plane;
    }
    if (keys.vfov) camera.vertical_fov = glm::radians(*keys.vfov);
    if (keys.ortho_height) camera.ortho_height = *keys.ortho_height;
    camera.lens = merged(camera.lens, keys.lens);  // settings may have what it lacks
    return camera;
}

std::set<double> camera_cuts(const EditKeys& keys) {
    std::set<double> cuts;
    for (const EditTrack& track : keys.tracks) {
        if (track.of != Of::camera || !(track.step || track.key == "camera")) continue;
        for (std::size_t k = 1; k < track.keys.size(); ++k)
            if (track.keys[k].value != track.keys[k - 1].value) cuts.insert(track.keys[k].frame);
    }
    return cuts;
}

std::optional<double> last_key(const EditKeys& keys) {
    std::optional<double> last;
    for (const EditTrack& track : keys.tracks) last = std::max(last.value_or(kLeastFrame), track.keys.back().frame);
    return last;
}

namespace {

using TrackId = std::tuple<Of, std::string, std::string>;  // kind, name, key

/// Values that tracks can have, in the order in which edits apply.
struct TrackValues {
    std::vector<std::pair<TrackId, std::string>> all;
    /// Adds a value, or the one without effect in place of an empty one.
    void add(Of of, const std::string& name, const std::string& key, const std::string& value) {
        const std::string any = value.empty() ? without_effect(of, key) : value;
        if (!any.empty()) all.push_back({{of, name, key}, any});
    }
    /// Returns a value; the one without effect, or "", if there is none.
    std::string at(const TrackId& id) const {
        const auto found = std::ranges::find(all, id, [](const auto& v) { return v.first; });
        return found == all.end() ? without_effect(std::get<0>(id), std::get<2>(id)) : found->second;
    }
};

TrackValues track_values(const FrameEdits& frame) {
    TrackValues values;
    for (const SingleValue& s : kSingles)
        if (s.of != Of::camera) values.add(s.of, "", s.key, list_text(s.get(frame.edits)));
    const auto add_light = [&](const std::string& name, const LightEdit& edit) {
        for (const auto& row : light_edit_keys())
            if (std::string_view(row.name) != "ies" && std::string_view(row.name) != "on")
                values.add(Of::lights, name, row.name, row.get(edit));
    };
    for (const auto& [name, edit, source] : frame.edits.lights) add_light(name, edit);
    for (const AddedLamp& lamp : frame.edits.added_lights) add_light(lamp.name, lamp.edit);
    for (const auto& [name, edit, source] : frame.edits.materials)
        for (const auto& [property, numbers] : edit) values.add(Of::materials, name, property, property_text(numbers));
    for (const auto& [name, edit, source] : frame.edits.nodes)
        for (const auto& row : node_edit_keys()) values.add(Of::nodes, name, row.name, row.get(edit));
    for (const auto& [name, source] : frame.edits.hidden) values.add(Of::hide, name, "", "true");
    values.add(Of::camera, "", "camera", frame.camera.camera.value_or(""));
    for (const SingleValue& s : kSingles)
        if (s.get_camera) values.add(Of::camera, "", s.key, list_text(s.get_camera(frame.camera)));
    return values;
}

/// Names of edits in the order in which they apply. A track moves its edit to the end, behind patterns that may name
/// the same objects, even if it has the value of that edit.
class EditOrder {
  public:
    explicit EditOrder(const SceneEdits& base) {
        const auto add = [&](Of of, const auto& edits) {
            for (const auto& edit : edits) names_[of].push_back(edit.name);
        };
        add(Of::lights, base.lights), add(Of::materials, base.materials), add(Of::nodes, base.nodes);
    }
    /// Returns whether the edit of a track is among those of the order and was not the last one. new_value: the track
    /// changes it, or adds it.
    bool move_last(const EditTrack& track, bool new_value) {
        std::vector<std::string>& names = names_[track.of];
        const auto own = std::ranges::find(names, track.name);
        if (own == names.end()) {
            if (new_value) names.push_back(track.name);
            return false;
        }
        const bool moves = std::next(own) != names.end();
        std::rotate(own, std::next(own), names.end());
        return moves;
    }

  private:
    std::map<Of, std::vector<std::string>> names_;
};

/// Returns the part of edits that tracks cannot have.
SceneEdits unkeyed_rest(SceneEdits edits) {
    for (const SingleValue& s : kSingles)
        if (s.set) s.set(edits, s.get(SceneEdits()).empty() ? Numbers(s.count) : s.get(SceneEdits()));
    std::vector<NamedEdit<LightEdit>> profiles;
    for (const auto& light : edits.lights)
        if (!light.edit.ies.empty()) profiles.push_back({light.name, LightEdit{.ies = light.edit.ies}, ""});
    std::ranges::stable_sort(profiles, {}, &NamedEdit<LightEdit>::name);  // edits of other values change the order
    edits.lights = std::move(profiles);
    for (AddedLamp& lamp : edits.added_lights) lamp.edit = LightEdit{.ies = lamp.edit.ies};
    edits.materials.clear(), edits.nodes.clear(), edits.hidden.clear();
    return edits;
}

}  // namespace

std::string values_text(const EditKeys& keys, const SceneEdits& base, double first, double last) {
    const TrackValues own = track_values({.edits = base});
    EditOrder order(base);
    std::string text;
    for (const EditTrack& track : keys.tracks) {
        const std::string from = sample(track, first), to = sample(track, last);
        std::string inside;
        bool changes = from != to;
        for (const EditTrack::Key& key : track.keys) {
            if (!(key.frame > first && key.frame <= last)) continue;
            inside += fmt::format(" {}={}", key.frame, key.value);
            changes = changes || key.value != from;
        }
        if (!changes && from.empty()) continue;
        const bool new_value = changes || from != own.at({track.of, track.name, track.key});
        if (!order.move_last(track, new_value) && !new_value) continue;
        text += fmt::format("{} {} {}: {}", name(track.of), track.name, track.key, from);
        if (changes) text += fmt::format("{}{} {}", track.step ? " step" : "", inside, to);
        text += '\n';
    }
    return text;
}

EditKeys keys_of(const std::vector<FrameEdits>& frames, const SceneEdits& base, const std::string& subject) {
    const TrackValues before = track_values({.edits = base});
    std::vector<TrackValues> all;
    std::vector<TrackId> ids;  // in the order in which they first appear
    for (const FrameEdits& frame : frames) {
        if (unkeyed_rest(frame.edits) != unkeyed_rest(base))
            throw Error(subject,
                        "frame {}: only lights, materials, nodes, hidden objects, environment and camera can change "
                        "from frame to frame, not light profiles, added lights, transforms of instances, catchers, "
                        "groups and links",
                        frame.frame);
        all.push_back(track_values(frame));
        for (const auto& [id, value] : before.all)
            if (all.back().at(id).empty())
                throw Error(subject, "frame {} undoes the edit '{}' of {} '{}'; it can have another value", frame.frame,
                            std::get<2>(id), name(std::get<0>(id)), std::get<1>(id));
        for (const auto& [id, value] : all.back().all)
            if (std::ranges::find(ids, id) == ids.end()) ids.push_back(id);
    }
    EditKeys keys;
    for (const TrackId& id : ids) {
        const auto& [of, object, key] = id;
        EditTrack track{.of = of, .name = object, .key = key, .source = subject};
        for (std::size_t i = 0; i < frames.size(); ++i) track.keys.push_back({double(frames[i].frame), all[i].at(id)});
        const std::string& first = track.keys.front().value;
        if (std::ranges::any_of(track.keys, [&](const auto& k) { return k.value != first; }) || first != before.at(id))
            keys.tracks.push_back(std::move(track));
    }
    return keys;
}

}  // namespace halflight
