// Declarations shared by the files of the native module.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "api/halflight/halflight.h"
#include "engine/core/stopwatch.h"

namespace halflight::python {

namespace py = pybind11;

/// A scene that renderers and edits use in turn.
struct PyScene {
    LoadedScene scene;
    SavedSettings saved{};   // settings file that the scene was loaded with
    bool busy = false;       // a renderer uses the scene without the GIL
    std::thread::id user{};  // thread of that renderer

    /// Returns the scene for reading. Throws Error if a renderer on another thread may be posing it.
    const LoadedScene& readable() const {
        if (busy && user != std::this_thread::get_id())
            throw Error("scene", "is in use by a renderer on another thread");
        return scene;
    }
};

/// Marks a scene as busy during its lifetime. Throws Error if it is busy already: a callback or another thread must
/// not use a scene that is being rendered.
class Busy {
  public:
    explicit Busy(PyScene& scene) : scene_(scene) {
        if (scene.busy) throw Error("scene", "is in use by a renderer");
        scene.busy = true;
        scene.user = std::this_thread::get_id();
    }
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;
    ~Busy() { scene_.busy = false; }

  private:
    PyScene& scene_;
};

/// A picture with the metadata of its files.
struct PyPicture {
    RenderResult result;
    std::vector<std::string> layers;  // names of result.aovs
    PictureInfo info;
    std::string statistics;  // statistics of the render, JSON
};

/// Texts of settings by their names in the table of settings (engine/settings/settings_table.h).
using SettingTexts = std::map<std::string, std::string>;

/// Returns a log that passes lines to Python: sink(is_warning, line). May be used without the GIL.
Log log_to(py::object sink);

/// Gives up the GIL during its lifetime, for long work. At its end, the interpreter waits for such work, because Python
/// then terminates threads that request the GIL, and a thread inside C++ would abort the process.
class Unlocked {
  public:
    Unlocked() = default;  ///< Throws Error once the interpreter is about to end.

    /// Stops the work of other threads at their next call of Callback, and waits until all work has ended. Needs the
    /// GIL.
    static void end_all();

  private:
    friend class Callback;
    struct Counted {
        Counted();
        ~Counted() { --running; }
        Counted(const Counted&) = delete;
        Counted& operator=(const Counted&) = delete;
    };
    static inline std::atomic<int> running = 0;
    static inline std::atomic<bool> ending = false;

    Counted counted_;  // counts in `running` until the GIL has been taken again
    py::gil_scoped_release released_;
};

/// Calls a Python function as progress callback of C++, without the GIL held. Exceptions of the function, and
/// KeyboardInterrupt, stop the work; rethrow() raises them.
class Callback {
  public:
    /// function: returns False to stop; None: no callback.
    explicit Callback(py::object function) : function_(std::move(function)) {}
    Callback(const Callback&) = delete;
    Callback& operator=(const Callback&) = delete;

    /// Calls the function with what make() returns; takes the GIL. Without `make`, only signals are looked for, at most
    /// 20 times a second, because other threads may hold the GIL for milliseconds. Returns false if the work is to
    /// stop.
    bool operator()(const std::function<py::object()>& make = {});
    /// Raises what has stopped the work; needs the GIL.
    void rethrow();

  private:
    py::object function_;
    std::optional<py::error_already_set> error_;
    Stopwatch watch_;
    double looked_ = 0;  // time of the last look for signals alone, seconds
};

void bind_scene(py::module_& module);
void bind_picture(py::module_& module);
void bind_renderer(py::module_& module);

}  // namespace halflight::python
