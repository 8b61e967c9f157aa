// State of the viewer: scene, camera and settings, which panels, mouse and scripts change. Uses no window, no OpenGL.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/halflight/loaded_scene.h"
#include "api/halflight/settings_file.h"
#include "api/scene/added_surfaces.h"
#include "engine/settings/constraints.h"
#include "tools/cli/console.h"
#include "tools/cli/picture_arguments.h"
#include "tools/view/layer_view.h"
#include "tools/view/pick.h"
#include "tools/view/region.h"
#include "tools/view/request.h"
#include "tools/view/selection.h"

namespace halflight::view {

/// Animations of a scene, and the frame that is shown.
struct Timeline {
    std::shared_ptr<SceneFile> file{};      // file for poses, used by one opening at a time; null: no animations
    std::vector<std::string> animations{};  // names of all animations, from titles()
    std::string animation = "none";         // animation that plays: a value of --animation
    std::vector<std::size_t> playing{};     // indices of the animations that play
    FrameRate rate{};
    FrameNumber frame = 0;              // number of the frame shown
    FrameNumber last_posed = 0;         // number of the last frame of the animation, from last_frame()
    FrameNumber last = 0;               // number of the last frame, of the animation or of keys
    bool keyed = false;                 // edits over frames change the scene
    std::vector<Camera> own_cameras{};  // the scene's cameras at that frame, without keys
    std::vector<Camera> cameras{};      // the same cameras, the chosen one with keys
    KeyedCamera keys{};                 // values of keys for the chosen camera at that frame
    /// Takes edits over frames, at `frame`. Throws Error if they have no values there, and if one of them names a
    /// camera that the scene lacks; cameras are without keys then.
    void take_keys(const PreviewArguments& arguments, const Scene& scene);
    /// Returns a free camera with keys. Throws Error if they define no view.
    Camera with_keys(const CameraPose& free, const Scene& scene) const;
    /// Returns whether frames differ.
    bool runs() const { return keyed || !playing.empty(); }
};
/// Returns the value of --animation for each animation: its name, or its number if the name is empty or ambiguous.
std::vector<std::string> titles(const std::vector<Animation>& animations);
/// Returns the edits of the arguments at a frame. Throws Error if keys have no values there.
SceneEdits edits_at(const PreviewArguments& arguments, FrameNumber frame);
/// Returns the last frame that is no later than `end` seconds, with a tolerance of 10^-3 frames; at most 10^6.
FrameNumber last_frame(double end, const FrameRate& rate);

/// Texts by which edits find the objects of a scene, one for each object (references_to()).
struct ObjectReferences {
    std::vector<std::string> lights, materials, meshes, nodes, cameras;
};

/// The place of a node, on which its edit acts.
struct NodeFrame {
    dvec3 origin;  // origin of the node before its edit, but after its matrix, world units
    dmat4 above;   // world to world: the motion by edits of the nodes above
    dvec3 pivot;   // point that stays where it is when the edit rotates or scales the node, in the space of `origin`
};

/// View of the scene: the pose of the camera, and the camera in use.
struct View {
    CameraPose pose;
    std::optional<std::size_t> camera{};  // camera of the scene that is in use; none: a free one
    /// Views of the same camera are equal, also if an animation moves it.
    bool operator==(const View& o) const { return camera == o.camera && (camera || pose == o.pose); }
};

/// The pictures that are denoised.
enum class Denoising {
    off,
    preview,  // pictures of few samples, by Preview::filter
    always,   // every picture, by RenderSettings::denoise
};

/// Values of options that are switched off. They return when the option is switched on again.
struct SwitchedOff {
    Lens lens{};          // depth of field
    Exposure exposure{};  // exposure without a physical camera
    float iso = float(PhysicalCamera::kUsualIso);
    ExposureTime shutter_speed{};
    float fstop = 0;                                // f-number of that exposure
    Preview preview{.cache = true};                 // preview modes that denoising excludes
    float clamp = 10;                               // PreviewModes::clamp
    ClearSky sky{.elevation = 40, .azimuth = 135};  // environment
    vec3 color{0.5f};                               // colour of the environment
};

/// Functions that load something are defined in session_opening.cpp.
class Session {
  public:
    struct Opened;
    /// Returns a function that loads the scene of the arguments, on any thread. It throws Error, also for a view
    /// transform that `colors` does not have.
    static std::function<Opened()> starting(const PreviewArguments& arguments, const ColorConfig& colors);
    /// Starts with a loaded scene.
    Session(const PreviewArguments& arguments, ColorConfig colors, Opened opened);
    /// Loads the scene, as starting() does.
    Session(const PreviewArguments& arguments, ColorConfig colors);

    // Panels write to the following members.
    LayerView layer_view;
    ViewTransform transform;
    SceneEdits edits;
    int bounces = 8;
    int samples = 1024;  // samples per pixel after which rendering stops
    PreviewModes modes;
    rays::Culling culling = rays::Culling::automatic;
    bool measure = false;
    std::vector<Bookmark> bookmarks;
    Selection selection;
    SwitchedOff switched_off;
    // Nodes rotate and scale about their origin; false: about the centre of their bounds.
    bool pivots_on_origin = false;
    std::optional<Region> region{};  // part of the picture that takes further samples; none: the whole picture

    const std::filesystem::path& file() const { return file_; }
    /// Returns the warning about entries of the settings file that were left out when the scene was opened, or "".
    const std::string& warning() const { return warning_; }
    /// Returns whether the scene was opened with a settings file.
    bool took_settings() const { return arguments_.settings_source != nullptr; }
    /// Returns the scene at the current frame, without edits.
    const Scene& scene() const { return *scene_; }
    const std::shared_ptr<const Scene>& shared_scene() const { return scene_; }
    /// Returns the edits with those over frames at the current frame, or without them if they have no values there,
    /// which posing() reports.
    SceneEdits edits_now() const;
    /// Replaces the edits. Throws Error if they do not suit the scene, and keeps the earlier ones then.
    void edit(SceneEdits edits);
    /// Returns the nodes of scene().
    const SceneTree& tree() const { return *tree_; }
    const std::shared_ptr<const SceneTree>& shared_tree() const { return tree_; }
    bool in_pages() const { return pages_ != nullptr; }  ///< Returns whether the geometry is in pages.

    // The following functions are defined in session_selection.cpp.

    /// Returns the references of scene(), and of the lamps that edits add to it.
    const ObjectReferences& references() const;
    /// Returns the lights of scene(), and then the lamps that edits add, before their edits.
    const std::vector<PunctualLight>& lights() const;
    /// Returns the edit that adds a light, by its index in lights(); null for lights of the scene.
    const AddedLamp* added_lamp(std::size_t light) const;
    /// Returns lights() and materials as the picture shows them, except for clay, hidden lights and the factor on all
    /// emissive surfaces. The scene has no meshes and images.
    Scene edited_values() const { return edited_values(""); }
    /// Returns a rectangle or a disc as the picture shows it, by its index in lights(); none for other lights.
    std::optional<AreaLamp> area_lamp(std::size_t light) const;
    /// Adds a lamp before the surface at a pixel, else before the point about which the camera turns, and selects it.
    /// It lights a white surface there with a radiance that is shown as 1. Throws Error as edit() does.
    void add_lamp(LampKind kind, const dvec2& point, const ivec2& size);
    /// Adds a copy of the selected light beside it, and selects it. Throws Error if the selected object is no light,
    /// and for light profiles of the scene's file.
    void duplicate_lamp();
    /// Removes the selected lamp if an edit has added it. Returns whether it has.
    bool remove_lamp();
    /// Returns the instances of picker() that belong to the selected node, with those below it, or mesh.
    std::vector<std::size_t> selected_instances() const;
    /// Returns the meshes of the selected node, with those below it, one for each instance, hidden ones included.
    std::vector<int> meshes_of_node() const;
    /// Selects the node of the surface visible at a pixel, or nothing.
    void select(const dvec2& point, const ivec2& size);
    /// Selects an object by "node:NAME", "light:NAME", "material:NAME", "mesh:NAME", "camera:NAME", "environment" or
    /// "none". Throws Error for unknown names.
    void select(const std::string& name);
    /// Returns kind and reference of an object: "node crate".
    std::string name_of(const Selection& object) const;
    NodeFrame node_frame(std::size_t index) const;  ///< Returns the place of a node.
    /// Returns the bounds of the selected object, world units; empty ones for objects without a place.
    WorldBounds selected_bounds() const;

    /// Returns the picker of the scene with the edits that move or hide surfaces.
    const Picker& picker() const;
    const Timeline& timeline() const { return timeline_; }
    double diagonal() const { return diagonal_; }  ///< Returns the diagonal of the scene's bounds, world units, > 0.
    /// Result of the slow part of opening a scene, an environment or a pose; open() takes it.
    struct Opened {
        PreviewArguments arguments;
        std::shared_ptr<const Scene> reference;  // Request::reference
        std::shared_ptr<const Scene> scene;
        std::shared_ptr<const SceneTree> reference_tree, tree;
        std::shared_ptr<const Environment> own_environment{};  // environment of the file
        bool lit_elsewhere = false;                            // parameter of set_environment()
        std::vector<std::string> variants{};                   // material variants of the file
        std::shared_ptr<const paging::PageSource> pages{};     // Request::pages
        Timeline timeline;
        std::shared_ptr<const Picker> picker;
        double diagonal = 1;
        struct Start {
            CameraPose pose;
            std::optional<std::size_t> camera;
        };
        std::optional<Start> start;          // camera of a new scene; none: only pose or environment are new
        std::string warning{};               // entries of the settings file that were left out; empty: none
        std::vector<VersionedFile> files{};  // files that the scene was read from
        VersionedFile environment_file{};    // environment map; without a path: there is none
        bool again = false;                  // the scene was open already, and its files have changed
    };
    /// Returns a function that reads a file, on any thread. The call and the function throw Error.
    std::function<Opened()> opening(const std::filesystem::path& path) const;
    /// Returns a function that changes the environment, on any thread. The function throws Error for unusable files.
    std::function<Opened()> lighting(const EnvironmentChoice& environment) const;
    /// Returns a function that loads the scene with another material variant ("": the file's own materials), on any
    /// thread. Camera and settings stay. The function throws Error for unknown variants.
    std::function<Opened()> dressing(const std::string& variant) const;
    /// Returns a function that loads the scene anew, on any thread. Camera, settings and edits stay. Edits that no
    /// longer suit the scene are left out, with a warning. The function throws Error if the scene cannot be loaded.
    std::function<Opened()> reloading() const;
    /// Returns the files of scene and environment, as they were read.
    std::vector<VersionedFile> files() const;
    const EnvironmentChoice& environment() const { return arguments_.choice.environment; }
    const std::string& variant() const { return arguments_.choice.variant; }
    const std::vector<std::string>& variants() const { return variants_; }
    /// Returns what undo and redo restore: the settings to save, without camera, size and frame.
    SavedSettings document() const;
    /// Returns the document that these arguments make of the current scene. Throws Error if their edits do not suit it.
    SavedSettings document(const PreviewArguments& arguments) const;
    /// Restores a document. Returns a function like lighting() and dressing() if environment or variant change, and
    /// one like posing(), which throws Error, if its edits over frames have no values at the current frame.
    std::optional<std::function<Opened()>> restore(const SavedSettings& document);
    /// Returns a function that poses the scene at a frame of an animation, on any thread. Throws Error without
    /// animations. The function throws Error for an unknown animation or an invalid pose.
    std::function<Opened()> posing(const std::string& animation, FrameNumber frame) const;
    /// Replaces the scene. A new scene brings its own camera and settings; a new pose or environment keeps them.
    void open(Opened opened);

    const CameraPose& pose() const { return pose_; }
    /// Returns the index of the scene's camera in use; none if the camera was moved.
    std::optional<std::size_t> scene_camera() const { return scene_camera_; }
    /// Returns the camera; it equals that of `halflight render` bit for bit, apart from the lens.
    Camera camera() const;
    /// Returns the camera with the lens of `transform`; a pinhole if that lens cannot be used.
    Camera camera_with_lens() const;
    void move(const CameraPose& pose);  ///< Throws Error for an invalid pose and keeps the earlier one.
    void take_camera(std::size_t index);
    void take_camera(const std::string& name_or_number);  ///< Throws Error that lists the scene's cameras.
    void reset_camera();                                  ///< Restores the camera that was chosen last.
    View view() const { return {pose_, scene_camera_}; }
    void take_view(const View& view);  ///< Restores a view of the same scene.
    /// Looks at the surface visible at a pixel; returns false if there is none. Throws what move() throws.
    bool focus(const dvec2& point, const ivec2& size);
    /// Focuses the lens on the surface visible at a pixel, or at infinity; the lens stays there when the camera moves.
    /// Scenes in pages keep the point of the picture instead. A lens without an aperture gets a usual f-number.
    void focus_lens(const dvec2& point, const ivec2& size);
    /// Switches depth of field on, with the focus and the aperture that it had, or off. The exposure stays.
    void set_depth_of_field(bool on);
    /// Returns the row of constraints that a change of the picture's settings would break; null: none, or a row is
    /// broken already.
    const Constraint* against(const std::function<void(RenderSettings&)>& change) const;
    Denoising denoising() const;
    void set_denoising(Denoising denoising);  ///< Sets the member `modes`.
    /// Lets ISO, shutter speed and f-number decide the exposure, or ends this. The depth of field stays.
    void set_physical_exposure(bool on);
    /// Looks at the object visible at a pixel from a distance that shows the whole object; otherwise like focus().
    bool frame_object(const dvec2& point, const ivec2& size);
    /// Looks at the selected object, or at all surfaces, from a distance that shows them whole. Returns false if there
    /// are none.
    bool frame_selection(const ivec2& size);
    bool frame_all(const ivec2& size);
    void bookmark(const std::string& name);  ///< Saves the pose; replaces a bookmark of this name.
    void bookmark();                         ///< Saves the pose as "view N" with the first free N from 1.
    void recall(const std::string& name);    ///< Takes the pose of a bookmark. Throws Error if there is none.

    Request request(const ivec2& size) const;
    /// Returns a short description of the picture: the layer shown, and the edits and modes that change it. Defined in
    /// description.cpp.
    std::string description() const;

    std::filesystem::path settings_file() const;
    /// Returns the settings file as it was read, or saved here.
    const VersionedFile& settings_version() const { return arguments_.settings_version; }
    void set_settings_version(const VersionedFile& file) { arguments_.settings_version = file; }
    /// Returns whether another program has written the settings file since it was read, or saved here.
    bool settings_changed() const;
    void set_colors(ColorConfig colors) { colors_ = std::move(colors); }
    void note_saved(const std::filesystem::path& file);  ///< Makes the file, which has been saved, the settings file.
    /// Returns the settings to save. size: size of the picture, pixels; {0, 0} (a minimised window) is not saved.
    SavedSettings saved(const ivec2& size) const;
    void save(const ivec2& size) const;  ///< Writes settings_file(). Throws Error.

  private:
    std::optional<PickResult> pick(const dvec2& point, const ivec2& size) const;
    /// Focuses the lens. usual: aperture of a lens that has none.
    void choose_focus(const Focus& focus, const Lens& usual);
    bool frame_bounds(const WorldBounds& box, const ivec2& size);
    /// Returns whether a node is `top` or hangs below it.
    bool below(int node, std::size_t top) const;
    /// Returns the centre of the surfaces of a node, with those below it, before edits; none without surfaces.
    std::optional<dvec3> centre(std::size_t node) const;
    /// Returns the instances as edits move and hide them; unchanged ones if the edits do not suit the scene, which
    /// the picture reports.
    static std::vector<Instance> moved_instances(const Scene& scene, const SceneTree& tree, const SceneEdits& edits);
    static Opened load(const PreviewArguments& arguments, const ColorConfig& colors, const Console& console);
    /// Loads a scene without the entries of its settings file that do not suit it.
    static Opened load_with_settings(PreviewArguments arguments, const ColorConfig& colors, const Console& console);
    /// Finds the references of the current scene. With the same scene in another pose or environment, edits of lights
    /// that the earlier environment had are removed, with their keys.
    void find_references(bool other_scene);
    /// Sets cameras and selection to those of the same names after the scene was loaded anew. before: references() of
    /// the earlier scene.
    void find_again(const ObjectReferences& before);
    /// Returns edited_values() without the edits of lights by patterns that match `copy`; "": with all edits.
    Scene edited_values(const std::string& copy) const;
    /// Throws Error if edits with keys do not suit the scene at the current frame.
    void check_keyed(SceneEdits edits, const EditKeys& keys) const;
    /// Replaces the edits over frames. Returns whether they have values at the current frame, which else has none.
    bool take_keys(EditKeys keys);
    /// Returns the pose of a free camera that keys change; none if the user has moved it, or has chosen another one.
    std::optional<CameraPose> keyed_pose() const;
    void update_lights() const;  ///< Brings lights() and their references up to date.
    /// Returns a name that no light has: "spot", "spot 2".
    std::string free_lamp_name(std::string name) const;
    Opened now() const;  ///< Returns the current scene, for a caller that changes parts of it.
    /// Copies the lens of a scene's camera into the session, unless the user has set a lens.
    void take_lens(const Camera& camera);
    /// Sets pose_ to that of the scene's camera at this frame.
    void follow_camera();

    PreviewArguments arguments_;
    Console console_;
    ColorConfig colors_;
    std::filesystem::path file_;
    std::string warning_;
    std::shared_ptr<const Scene> reference_;
    std::shared_ptr<const Scene> scene_;
    std::shared_ptr<const SceneTree> reference_tree_, tree_;
    std::shared_ptr<const Environment> own_environment_;
    bool lit_elsewhere_ = false;
    std::vector<std::string> variants_;
    std::vector<VersionedFile> files_;
    VersionedFile environment_file_;
    mutable ObjectReferences references_;
    mutable std::vector<PunctualLight> lights_;  // lights(), of the scene and the lamps that follow
    mutable std::shared_ptr<const Scene> scene_of_lights_;
    mutable std::vector<std::pair<std::string, LampKind>> lamps_of_lights_;
    std::shared_ptr<const paging::PageSource> pages_;
    Timeline timeline_;
    std::shared_ptr<const Picker> picker_;
    mutable std::optional<Picker> edited_picker_;  // cache of picker(), for `picked_edits_`
    mutable SceneEdits picked_edits_;
    struct Centre {
        std::size_t node;
        std::optional<dvec3> centre;
    };
    mutable std::optional<Centre> centre_;  // cache of centre(), for the current scene
    double diagonal_ = 1;
    CameraPose pose_;
    CameraPose first_pose_;                                   // pose that reset_camera() restores
    std::optional<std::size_t> scene_camera_, first_camera_;  // cameras of these poses
    std::optional<Lens> taken_lens_;  // lens in use, taken from a camera of the scene; none: not taken
    Lens asked_lens_;                 // lens in use before it was taken
};

}  // namespace halflight::view
