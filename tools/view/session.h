// What is looked at and how: all that panels, mouse and scripts change. No window, no OpenGL.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/halflight/arguments.h"
#include "tools/halflight/console.h"
#include "tools/halflight/settings_file.h"
#include "tools/view/pick.h"
#include "tools/view/render_thread.h"
#include "tools/view/seen.h"

namespace halflight::view {

/// What a request is made of: another one is needed where it differs.
struct Wanted {
    std::shared_ptr<const Scene> scene;
    SceneEdits edits;
    CameraPose pose;
    std::optional<std::size_t> scene_camera;
    ivec2 size{0};
    int bounces = 0;
    std::vector<std::string> aovs;
    bool measure = false;
    bool operator==(const Wanted&) const = default;
};

class Session {
  public:
    /// Loads the scene. Throws Error, also for a view transform that these colours do not have.
    Session(const PreviewArguments& arguments, ColorConfig colors);

    // Panels write to these.
    std::string view = kFinal;  // what is seen: one of views()
    ViewTransform transform;
    SceneEdits edits;
    int bounces = 8;
    int samples = 1024;  // after which nothing more is done
    bool measure = false;
    std::vector<Bookmark> bookmarks;

    const std::filesystem::path& file() const { return file_; }
    const Scene& scene() const { return *scene_; }
    double diagonal() const { return diagonal_; }  ///< of the scene's bounds, world units, > 0
    /// A scene, whose camera is taken and whose settings are as they would be at the start, or an environment. Throws
    /// Error, and nothing has changed then.
    void open(const std::filesystem::path& path);

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

    Wanted wanted(const ivec2& size) const;
    Request request(const Wanted& wanted) const;

    std::filesystem::path settings_file() const;
    SavedSettings saved() const;
    void save() const;  ///< Throws Error.

  private:
    std::optional<Picked> pick(const dvec2& point, const ivec2& size) const;
    void load(const PreviewArguments& arguments);

    PreviewArguments arguments_;
    Console console_;
    ColorConfig colors_;
    std::filesystem::path file_;
    std::shared_ptr<const Scene> scene_;
    std::shared_ptr<const Picker> picker_;
    double diagonal_ = 1;
    CameraPose pose_;
    CameraPose first_pose_;
    std::optional<std::size_t> scene_camera_, first_camera_;
};

}  // namespace halflight::view
