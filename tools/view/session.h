// What is looked at and how: all that panels, mouse and scripts change. No window, no OpenGL.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/halflight/loaded_scene.h"
#include "api/halflight/settings_file.h"
#include "tools/cli/console.h"
#include "tools/cli/picture_arguments.h"
#include "tools/view/layer_view.h"
#include "tools/view/pick.h"
#include "tools/view/render_thread.h"

namespace halflight::view {

/// What moves in a scene, and when it is seen.
struct Timeline {
    std::shared_ptr<SceneFile> file{};      // null where it has no animations; of one opening at a time
    std::vector<std::string> animations{};  // titles()
    std::string animation = "none";         // that plays, as of --animation
    std::vector<std::size_t> playing{};     // the same by number
    FrameRate rate{};
    std::uint32_t frame = 0;        // that is seen
    std::uint32_t last = 0;         // last_frame()
    std::vector<Camera> cameras{};  // of the scene at that frame
};
/// What --animation calls each: its name, or its number where that says nothing or something else.
std::vector<std::string> titles(const std::vector<Animation>& animations);
/// The last frame that is no later than `end` seconds, as far as floats can tell; at most 10^6.
std::uint32_t last_frame(double end, const FrameRate& rate);

class Session {
  public:
    /// Loads the scene. Throws Error, also for a view transform that these colours do not have.
    Session(const PreviewArguments& arguments, ColorConfig colors);

    // Panels write to these.
    LayerView layer_view;
    ViewTransform transform;
    SceneEdits edits;
    int bounces = 8;
    int samples = 1024;           // after which nothing more is done
    bool estimate_error = false;  // Picture::relmse is wanted
    PreviewModes modes;
    rays::Culling culling = rays::Culling::automatic;
    bool measure = false;
    std::vector<Bookmark> bookmarks;

    const std::filesystem::path& file() const { return file_; }
    const Scene& scene() const { return *scene_; }  ///< as it is seen, without edits
    const Timeline& timeline() const { return timeline_; }
    double diagonal() const { return diagonal_; }  ///< of the scene's bounds, world units, > 0
    /// A scene, an environment or a pose: all of open() that takes long.
    struct Opened {
        PreviewArguments arguments;
        std::shared_ptr<const Scene> reference;  // as of Request
        std::shared_ptr<const Scene> scene;
        Timeline timeline;
        std::shared_ptr<const Picker> picker;
        double diagonal = 1;
        struct Start {
            CameraPose pose;
            std::optional<std::size_t> camera;
        };
        std::optional<Start> start;  // of a scene; none: it is the one that was there, but for pose or environment
    };
    /// Reads a file, on whatever thread it is called. Throws Error.
    std::function<Opened()> opening(const std::filesystem::path& path) const;
    /// The scene at another frame, or in another animation, which begins at its own frame 0. Throws Error as
    /// choose_animations() and the pose do, on whatever thread it is called.
    std::function<Opened()> posing(const std::string& animation, std::uint32_t frame) const;
    /// Of a scene, its camera is taken and its settings are as they would be at the start; otherwise all else stays.
    void open(Opened opened);

    const CameraPose& pose() const { return pose_; }
    /// Where the camera is that of the scene as it is, its number.
    std::optional<std::size_t> scene_camera() const { return scene_camera_; }
    /// As `render` would have it, bit for bit.
    Camera camera() const;
    void move(const CameraPose& pose);  ///< Throws Error for what makes no view, and nothing has changed then.
    void take_camera(std::size_t index);
    void take_camera(const std::string& name_or_number);  ///< Throws Error that lists those that there are.
    void reset_camera();                                  ///< to that of the start
    /// Looks at the surface that is seen at a pixel; false where there is none. Throws as move() does.
    bool focus(const dvec2& point, const ivec2& size);
    /// The same, and comes as close as to see the whole object.
    bool frame_object(const dvec2& point, const ivec2& size);
    void bookmark(const std::string& name);  ///< replaces one of this name
    void bookmark();                         ///< "view N" with the first N from 1 that no other has
    void recall(const std::string& name);    ///< Throws Error where there is none.

    Request request(const ivec2& size) const;
    /// Of the picture, in a few words: what is seen, and what is not as the scene has it.
    std::string description() const;

    std::filesystem::path settings_file() const;
    /// size: of the picture, pixels; not saved where it is none, of a window that is minimised.
    SavedSettings saved(const ivec2& size) const;
    void save(const ivec2& size) const;  ///< Throws Error.

  private:
    std::optional<PickResult> pick(const dvec2& point, const ivec2& size) const;
    static Opened load(const PreviewArguments& arguments, const ColorConfig& colors, const Console& console);
    Opened now() const;  ///< as it is, to be changed
    /// pose_ is that of the scene's camera at this frame.
    void follow_camera();

    PreviewArguments arguments_;
    Console console_;
    ColorConfig colors_;
    std::filesystem::path file_;
    std::shared_ptr<const Scene> reference_;
    std::shared_ptr<const Scene> scene_;
    Timeline timeline_;
    std::shared_ptr<const Picker> picker_;
    double diagonal_ = 1;
    CameraPose pose_;
    CameraPose first_pose_;
    std::optional<std::size_t> scene_camera_, first_camera_;
};

}  // namespace halflight::view
