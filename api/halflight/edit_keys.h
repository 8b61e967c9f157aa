// Edits over frames: values at keys, between which they are interpolated. Values are texts like those of options
// (edit_text.h), with the same ranges and units.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "api/halflight/camera_pose.h"
#include "api/halflight/scene_edits.h"
#include "engine/core/frames.h"
#include "engine/core/lens.h"

namespace halflight {

/// One value over frames. Before its first key it has the value of that key, after its last key the value of the last.
struct EditTrack {
    enum class Of : std::uint8_t {
        scene,        // emission, lamp_radius, sun_angle
        environment,  // rotation, intensity, tint
        camera,       // camera_track_keys()
        lights,       // keys of LightEdit but for ies
        materials,    // properties
        nodes,        // keys of NodeEdit
        hide,         // "true" while objects are hidden; the key is empty
    };
    struct Key {
        double frame = 0;   // kLeastFrame to kMostFrame, whole or not
        std::string value;  // "": the edits beside the keys hold
        bool operator==(const Key&) const = default;
    };
    Of of = Of::scene;
    std::string name{};  // name of objects, like NamedEdit::name; empty for scene, environment and camera
    std::string key{};
    std::vector<Key> keys{};  // by ascending frames, not empty
    bool step = false;        // values hold until the next key
    std::string source{};     // file and element, for errors
    bool operator==(const EditTrack& o) const {
        return of == o.of && name == o.name && key == o.key && keys == o.keys && step == o.step;
    }
};

/// Returns the value at a frame, whole or not. Lists of numbers are interpolated linearly, directions along the shorter
/// arc, and matrices by translation, rotation along the shorter arc, and stretch. Other values hold until the next key.
std::string sample(const EditTrack& track, double frame);

/// All edits over frames of a scene. Tracks apply in their order, after the edits without keys.
struct EditKeys {
    std::vector<EditTrack> tracks{};
    bool empty() const { return tracks.empty(); }
    /// Returns whether a track is of one of the kinds.
    bool has(std::initializer_list<EditTrack::Of> kinds) const;
    bool operator==(const EditKeys&) const = default;
};

/// Returns the name of a kind of tracks in settings files.
const char* name(EditTrack::Of of);

/// Checks a key of a track and returns its value in the form in which tracks are compared. Throws Error about `subject`
/// for values outside their ranges, and for keys that the kind lacks.
std::string checked_value(EditTrack::Of of, const std::string& key, const std::string& value,
                          const std::string& subject);

/// Replaces values of `edits` by those of a frame. Throws Error about the source of a track.
void apply_keys(const EditKeys& keys, double frame, SceneEdits& edits);

/// Values of a camera at a frame, in place of those of the chosen camera.
struct KeyedCamera {
    std::optional<std::string> camera{};           // name or number of a camera of the scene
    std::optional<dvec3> from{}, at{}, up{};       // like CameraPose; world units
    std::optional<double> vfov{}, ortho_height{};  // degrees; world units
    Lens lens{};                                   // members that are set replace those of the lens
    bool operator==(const KeyedCamera&) const = default;
};
KeyedCamera keyed_camera(const EditKeys& keys, double frame);
/// Returns a camera with the values of keys. `free` is its pose if it is none of the scene: it goes on to look at its
/// target, while a camera of the scene keeps its direction; with `from` and `at` it cuts nothing off. Throws Error if the values define no view.
Camera with_keys(Camera camera, const KeyedCamera& keys, const std::optional<CameraPose>& free);

/// Returns the frames at which the camera jumps, ascending: keys of its tracks that hold until the next one.
std::set<double> camera_cuts(const EditKeys& keys);

/// Returns the last frame of all keys; none if there are none.
std::optional<double> last_key(const EditKeys& keys);

/// Returns text that tells apart edits which differ in a range of frames: values at both ends, and keys between them.
/// Tracks that have the values of `base`, the edits beside the keys, are left out.
std::string values_text(const EditKeys& keys, const SceneEdits& base, double first, double last);

/// Edits and camera of one frame, of which a sequence of them makes keys.
struct FrameEdits {
    FrameNumber frame = 0;
    SceneEdits edits{};
    KeyedCamera camera{};
};
/// Returns keys that give each frame its edits and camera, with a key at each of `frames`, which ascend. `base` are the
/// edits beside the keys. Throws Error about `subject` for differences between frames that keys cannot have, such as
/// light groups, and for frames that undo an edit of `base`.
EditKeys keys_of(const std::vector<FrameEdits>& frames, const SceneEdits& base, const std::string& subject);

}  // namespace halflight
