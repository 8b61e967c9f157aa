// Scenes that are loaded from files, posed at a time and edited.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "api/halflight/camera.h"
#include "api/halflight/edit_keys.h"
#include "api/halflight/environment_choice.h"
#include "api/halflight/log.h"
#include "api/halflight/scene_edits.h"
#include "engine/core/frames.h"
#include "engine/core/memory_ledger.h"
#include "engine/core/versioned_file.h"
#include "engine/io/gltf/gltf.h"
#include "engine/scene/scene.h"

namespace halflight {

struct SeparateLights;
namespace paging {
class PageSource;
}

/// Choice of a scene to load: its file, environment, edits and animation.
struct SceneChoice {
    std::filesystem::path scene;  // file, .gltf or .glb, or a list of files, NAME.parts.json
    bool allow_outside = false;   // lets the scene name files outside its folder
    // Page file of the scene (pack_scene()), from which geometry is read. Empty: scenes that do not fit into memory,
    // and lists of files (NAME.parts.json), get one in the user's cache.
    std::filesystem::path pages{};
    bool in_memory = false;                       // refuses scenes that need a page file
    std::function<void(double share)> packing{};  // called with the share of the conversion done; may throw to stop
    bool tile_textures = false;                   // loads textures in tiles even if they fit into memory
    bool mip_levels = false;                      // makes mip levels, which RenderSettings::texture_lod needs
    bool strict_scene = false;                    // refuses scenes that break glTF, or whose images cannot be read
    std::string variant{};  // material variant of the file, by name; empty: the file's own materials
    double line_width = 0;  // diameter of points and lines, world units; 0: they are left out
    EnvironmentChoice environment{};
    bool lamps = true;                      // closed rooms without enough light get lamps
    std::optional<double> light_azimuth{};  // azimuth of the neutral light, degrees from +Z; none: the camera's
    SceneEdits edits{};
    std::string edits_source{};  // settings file of `edits`, for errors; empty: none
    EditKeys keys{};             // edits over frames
    // Animation that plays: a name, which comes first since a name may be a number; a number from 0; "all" or "none".
    // Without a value the scene is at rest, at the pose of its nodes, and animations are not read.
    std::optional<std::string> animation{};
    std::optional<FrameRate> frame_rate{};  // frame rate; none: that of the scene's extras, else 24
    FrameNumber frame_offset = 0;           // number of the frame at 0 s
    std::size_t picture_bytes = 0;          // memory to leave free for pictures (renderer/memory.h), bytes
};

/// Returns the options with which the scene of a choice is read.
GltfOptions gltf_options(const SceneChoice& choice);

/// Loads a scene into memory with `whole`. Lists of files, scenes with page files and scenes that do not fit into the
/// memory budget are loaded with `paged`, if the choice asks for nothing that pages lack. Throws what these throw.
void load_whole_or_paged(const SceneChoice& choice, const std::function<void()>& whole,
                         const std::function<void()>& paged);

/// Throws Error about the file if the memory budget (MemoryLedger::process()) has too little left for loading and
/// rendering a scene of this size and a picture of at least `picture_bytes`.
void check_fits(const SceneSize& size, const std::filesystem::path& file, std::size_t picture_bytes = 0);

/// Throws BudgetError about the file if its geometry exceeds tables on the device, so that it needs pages.
void check_tables(const SceneSize& size, const std::filesystem::path& file);

/// Lets a temporary file (engine/io/texture_store.h) take the textures of files that do not fit into the memory budget,
/// or all textures if `always` is set. `size` is that of the files together, and changes to what is left of it. Returns
/// the file, or null if textures stay in memory.
std::shared_ptr<TextureStore> tile_textures(std::span<GltfScene> files, SceneSize& size, std::size_t picture_bytes,
                                            bool always = false);

/// How light may be added to a scene.
struct AddedLight {
    bool lit_elsewhere = false;        // the scene has light in pages, or an animation brings it later: none is added
    bool lamps = true;                 // SceneChoice::lamps
    std::optional<Camera> camera{};    // camera of the picture; none: those of the scene, or its default camera
    double azimuth = kFramingAzimuth;  // azimuth of the camera, degrees from +Z to +X; the neutral sky follows it
    const rays::LazyProbe* probe = nullptr;  // probe of the scene; null: there is none yet
    bool straight_glass = false;             // SceneEdits::straight_glass, which decides where light arrives
};

/// Sets the environment of `choice`, with its sun if it has one. Without a choice, a scene gets a neutral sky if its
/// cameras see little by its own light. Closed scenes of which they see little get lamps, with or without a choice,
/// unless it is black. The log notes what is added (api/first_picture/default_light.h).
void set_environment(Scene& scene, const EnvironmentChoice& choice, const Log& log, const AddedLight& added = {});
/// Appends the sun of the environment, which `from` has, to a pose of the same file.
void take_sun(Scene& pose, const Scene& from);

/// A glTF file, its playing animations and its frame rate. It poses scenes; it holds none itself.
class SceneFile {
  public:
    /// Reads the file. Throws Error as GltfScene(), check_fits() and check_tables() do. moves: poses other than
    /// at_rest() are wanted, for which contents of the file are kept.
    SceneFile(const std::filesystem::path& path, const GltfOptions& options, std::size_t picture_bytes = 0,
              bool moves = true, bool tile_textures = false);
    /// Takes an open file.
    SceneFile(const std::filesystem::path& path, GltfScene file) : path_(path), file_(std::move(file)) {}

    /// Selects animations (SceneChoice::animation). The log names ignored channels and animations that drive the same
    /// properties. Throws Error for damaged animations, and for unknown names (the error lists the names).
    void play(const std::string& animation, const Log& log);
    /// Sets the frame rate: `wanted`, else that of the scene's extras, which the log notes, else 24.
    void set_frame_rate(const std::optional<FrameRate>& wanted, const Log& log);

    GltfScene& gltf() { return file_; }
    const std::filesystem::path& path() const { return path_; }
    const std::vector<std::size_t>& playing() const { return playing_; }  ///< Returns indices of animations.
    const FrameRate& frame_rate() const { return frame_rate_; }

    /// Returns the scene at a time. Its environment is that of the file.
    Scene at(double seconds);
    /// Returns the scene at a time, with images that the caller has already from an earlier scene of this file.
    Scene at(double seconds, std::vector<TextureImage> images);
    /// Poses `scene`, which has the images of this file, at another time. Environment, light profiles and bounds of
    /// pages stay. Throws Error for an invalid pose, and then leaves the scene unchanged.
    void pose(Scene& scene, double seconds);
    std::vector<Camera> cameras_at(double seconds) { return file_.cameras_at(seconds, playing_); }
    std::vector<float> camera_cuts(std::size_t camera) { return file_.camera_cuts(camera, playing_); }
    bool parts_come_and_go() { return file_.parts_come_and_go(playing_); }
    /// Returns the nodes at a time, for edits.
    SceneTree tree_at(double seconds) { return file_.tree_at(seconds, playing_); }
    /// Returns whether meshes, instances, lights or materials depend on time.
    bool surfaces_move() { return file_.surfaces_move(playing_); }
    /// Returns whether light may appear later although there is none at 0 s.
    bool drives_light();
    /// Returns the indices of materials whose emission changes.
    std::set<std::size_t> driven_emission();
    /// Returns the end of the last animation that plays, seconds; 0 if none plays.
    double end();

  private:
    void set_rest_bounds(Scene& scene, double seconds);

    std::filesystem::path path_;
    GltfScene file_;
    std::optional<WorldBounds> rest_bounds_;  // Scene::rest_bounds; none: not known yet
    std::vector<std::size_t> playing_;
    FrameRate frame_rate_;
};

/// A loaded scene: posed at a time, edited, with its environment and camera. The result for a time is a function of the
/// choices and that time. Substitutes for missing lights and cameras follow from the pose at 0 s. Renderers pose the
/// scene; it must not be used by two threads at a time.
class LoadedScene {
  public:
    /// Reads the files; the log gets the warnings. Throws Error that names file and element, before anything is decoded
    /// if the scene does not fit into memory (check_fits(), check_tables()).
    explicit LoadedScene(SceneChoice choice, const CameraChoice& camera = {}, const Log& log = {});
    LoadedScene(LoadedScene&&) noexcept;
    LoadedScene& operator=(LoadedScene&&) noexcept;
    ~LoadedScene();

    const SceneChoice& choice() const { return choice_; }  ///< Returns the choice with the current edits.
    const CameraChoice& camera_choice() const { return camera_choice_; }
    /// Returns the scene in its last pose; initially the pose at 0 s.
    const Scene& scene() const { return scene_; }
    /// Returns a number that changes whenever scene() changes, except for its cameras.
    std::uint64_t revision() const { return revision_; }
    /// Returns the nodes of the scene, at the time of its last pose if something moves.
    const SceneTree& tree() const { return tree_; }
    /// Returns a number that changes with edits that move or hide surfaces. Earlier hierarchies are invalid afterwards.
    std::uint64_t transform_revision() const { return transform_revision_; }

    /// Returns a number that changes with each edit and each choice of a camera.
    std::uint64_t choice_revision() const { return choice_revision_; }

    /// Replaces all edits, in the last pose. Throws Error as check_edits() does, and keeps the earlier edits then.
    void edit(SceneEdits edits);
    const SceneEdits& edits() const { return choice_.edits; }
    /// Replaces the edits over frames. The scene is at 0 s afterwards. Throws Error as edit() does, and keeps the
    /// earlier ones then.
    void set_keys(EditKeys keys);
    const EditKeys& keys() const { return choice_.keys; }
    /// Returns all edits at a time.
    SceneEdits edits_at(double seconds) const;
    /// Returns the instances of the last pose before edits, by which SceneEdits::transforms are numbered.
    const std::vector<Instance>& unedited_instances() const;
    /// Chooses another camera. Throws Error if the scene has none of that name, and keeps the earlier one then.
    void set_camera(const CameraChoice& camera);

    /// Fits a default camera to the edited scene and to pictures of that width / height. Does nothing if another
    /// camera was chosen.
    void frame_for(double aspect);

    /// Poses scene() at a time, with the edits of that time. Cameras are returned by camera(). Throws Error for an
    /// invalid pose, and if an edit does not suit the pose; scene() then needs another pose.
    void pose(double seconds);
    /// Returns the scene at another time, with all lights, but without the picture of an environment. Needs
    /// surfaces_move(). Throws Error like pose().
    Scene posed(double seconds);
    /// Frees the contents of meshes and images, whose memory large scenes need after their upload. Renderers that have
    /// uploaded the scene go on; other renderers, pictures after edits and set_camera() throw Error. Precondition: not
    /// surfaces_move().
    void free_surfaces();
    /// Throws Error if free_surfaces() was called.
    void check_surfaces() const;
    /// Lets `deformer` move vertices in later calls of pose() and posed(); null: the CPU. Needs surfaces_move().
    void deform_by(Deformer* deformer);
    Deformer* deformer() const { return deformer_; }
    /// Returns whether more of scene() than its cameras depends on time: by an animation, or by edits over frames.
    bool surfaces_move() const { return surfaces_move_; }
    /// Returns whether some animation of a scene with pages changes materials, though it may not play.
    bool drives_materials() const { return !driven_materials_.empty(); }

    /// Returns the chosen camera at a time.
    ChosenCamera camera(double seconds);
    /// Returns the first and the last time of the shot that the camera shows at a time, seconds. A key of the camera's
    /// nodes that moves it at once is a cut, which ends a shot, and so is such a key of edits.
    std::pair<double, double> shot(double seconds);
    /// Returns whether parts of the scene may appear or vanish (GltfScene::parts_come_and_go()).
    bool parts_come_and_go();
    const ChosenCamera& chosen_camera() const { return camera_; }  ///< Returns the camera at 0 s.
    const FrameRate& frame_rate() const { return frame_rate_; }
    /// Returns the time of a frame, whole or not, seconds; negative before SceneChoice::frame_offset.
    double time_of(double frame) const { return frame_rate_.seconds(frame - choice_.frame_offset); }
    /// Returns whether edits leave the environment alike in two frames.
    bool same_environment(FrameNumber a, FrameNumber b) const;
    /// Returns the frame at a time, whole or not. It is exact for times of whole frames.
    double frame_at(double seconds) const;
    /// Returns the end of the last animation that plays, seconds; none if nothing plays.
    std::optional<double> animation_end();
    const std::vector<std::size_t>& playing() const { return playing_; }  ///< Returns indices of animations.
    const std::vector<VersionedFile>& files() const { return files_; }  ///< Returns the files, glTF first, pages last.
    /// Returns the environment map of the choice; without one, a file without a path.
    const VersionedFile& environment_file() const { return environment_file_; }
    const std::vector<std::string>& variants() const { return variants_; }  ///< Returns the names of material variants.
    /// Returns the page file; null if the geometry is in memory.
    const std::shared_ptr<const paging::PageSource>& pages() const { return pages_; }
    /// Returns, per material, whether an instance shows it.
    std::vector<bool> used_materials() const;
    const SceneSize& size() const { return size_; }  ///< Returns the size at 0 s.
    /// Returns the environment of the file, which a choice or a neutral sky may have replaced in scene().
    const std::shared_ptr<const Environment>& own_environment() const { return own_environment_; }
    bool lit_elsewhere() const { return lit_elsewhere_; }  ///< Returns AddedLight::lit_elsewhere.

  private:
    struct Unedited;
    void apply_edits();
    /// Keeps the scene as it is before its first edit.
    void keep_unedited();
    /// Takes choice_.keys. Throws Error for names that find nothing.
    void take_keys();
    /// Marks instances that edits over frames move or hide.
    void mark_moved(Scene& scene, const SceneTree& tree) const;
    /// Throws Error for edits at a time that pages cannot have.
    void check_pages(const SceneEdits& edits) const;
    /// Returns a camera with the values that edits over frames give it at a time.
    ChosenCamera keyed(ChosenCamera chosen, double seconds);
    void restore_unedited();
    /// Turns the neutral sky, if it is in use, to the chosen camera.
    void turn_light();
    double light_azimuth() const;
    /// Loads the scene into memory. Returns whether its animations may bring light later.
    bool load_whole(const Log& log);
    /// Loads the scene, with its geometry from pages. Returns like load_whole().
    bool load_pages(const Log& log, bool again = false);
    void drop_empty_instances();
    void frame_motion();
    void choose(const rays::LazyProbe* probe = nullptr);
    /// Takes an open file. Returns like load_whole().
    bool take_file(SceneFile file, const Log& log);

    SceneChoice choice_;
    CameraChoice camera_choice_;
    std::optional<SceneFile> file_;  // file that poses scenes; none if nothing moves
    FrameRate frame_rate_;
    std::vector<std::size_t> playing_;
    std::vector<VersionedFile> files_;
    VersionedFile environment_file_;
    std::vector<std::string> variants_;
    std::shared_ptr<const paging::PageSource> pages_;
    Scene scene_;
    SceneTree tree_;
    SceneSize size_;
    MemoryLedger::Entry memory_;
    std::set<std::size_t> driven_emission_;     // materials whose emission the animation may change
    std::vector<bool> driven_materials_;        // with pages: per material, whether some animation changes it
    std::unique_ptr<SeparateLights> separate_;  // groups of SceneEdits::each_light; null: not asked for
    std::unique_ptr<Unedited> unedited_;        // values of the last pose before edits; null while there were no edits
    ChosenCamera unkeyed_camera_;               // camera at 0 s without edits over frames
    ChosenCamera camera_;                       // the same with them
    std::shared_ptr<const Environment> own_environment_;
    bool lit_elsewhere_ = false;
    std::vector<PunctualLight> suns_;                  // sun of the environment before edits; empty: none
    bool surfaces_move_ = false, file_moves_ = false;  // by edits, too; by animations alone
    bool freed_ = false;                               // free_surfaces() was called
    std::vector<bool> used_materials_;                 // used_materials() at that time
    Deformer* deformer_ = nullptr;
    std::optional<double> posed_at_ = 0;  // time of the last pose, seconds; none: a former deformer made it
    std::uint64_t revision_ = 1, transform_revision_ = 1, choice_revision_ = 1;
    std::uint64_t framed_ = 1;  // transform_revision_ at the last choice of a default camera
};

/// Warnings about poses after the first, such as values that an animation drives out of their range. Each is told once.
class PoseWarnings {
  public:
    explicit PoseWarnings(const LoadedScene& scene);
    /// Logs the warnings about the scene's last pose that have not been told.
    void tell(const LoadedScene& scene, const Log& log);

  private:
    std::set<std::string> told_;
};

}  // namespace halflight
