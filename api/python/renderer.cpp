// Python classes and functions for renderers, sequences and settings.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "api/halflight/denoise.h"
#include "api/python/bindings.h"
#include "engine/core/interruption.h"
#include "engine/core/process.h"
#include "engine/core/stopwatch.h"
#include "engine/core/suggestion.h"
#include "engine/gpu/context.h"

namespace halflight::python {
namespace {

/// Returns settings by the rules of the command line. `chosen` replaces missing values of size and camera.
RenderSettings settings_of(const SettingTexts& texts, const Camera& chosen) {
    RenderSettings settings;
    for (const auto& [name, text] : texts) {
        const auto rows = known_settings();
        const auto row = std::ranges::find(rows, name, &Setting::name);
        if (row == rows.end()) {
            std::vector<std::string> all;
            for (const Setting& setting : rows) all.emplace_back(setting.name);
            throw Error("settings", "there is no setting '{}'{}", name, did_you_mean(name, all));
        }
        if (const std::string problem = row->set(settings, text); !problem.empty())
            throw Error("settings", "{} {}", name, problem);
    }
    const Camera camera = with_optics(chosen, settings.optics);
    const auto given = [&](const char* name, int value) {
        return texts.contains(name) ? std::optional(value) : std::nullopt;
    };
    constexpr int kDefaultWidth = 1280;
    const ivec2 size =
        picture_size(given("width", settings.width), given("height", settings.height), kDefaultWidth, camera);
    settings.width = size.x, settings.height = size.y;
    if ((settings.time_limit > 0 || settings.error) && !texts.contains("samples")) settings.samples = kMaxSamples;
    settings.camera = camera;
    settings.want_view = true;
    return settings;
}

/// Throws Error in a process that was forked from one that has had a context.
void check_driver_not_forked() {
    static const pid_t owner = getpid();  // process of the first call, which comes before the first context
    check_not_forked(owner, "GPU");
}

/// Returns the context that all renderers of a thread share: making one takes as long as many small pictures. The
/// context lives until the process ends.
std::shared_ptr<gpu::Context> shared_context(const std::string& device, bool shader_cache) {
    check_driver_not_forked();
    using Contexts = std::map<std::pair<std::string, bool>, std::shared_ptr<gpu::Context>>;
    thread_local Contexts& contexts = *new Contexts;  // drivers cannot be closed safely while a process exits
    std::shared_ptr<gpu::Context>& context = contexts[{device, shader_cache}];
    if (!context) {
        gpu::ContextOptions options = default_device(device);
        if (!shader_cache) options.binaries_folder.clear();
        context = std::make_shared<gpu::Context>(gpu::Context::create(options));
    }
    return context;
}

py::object progress_of(const RenderProgress& p) {
    return py::make_tuple(p.samples_done, p.samples_total, p.seconds);
}

struct PyRenderer {
    std::shared_ptr<PyScene> scene;
    FrameRenderer renderer;
    OutputOptions output;
    SettingTexts texts;
    FrameNumber own_frame = 0;  // frame of the settings

    /// Renders a frame. The result is incomplete if a signal has raised an exception, which `progress` holds.
    RenderResult render(FrameNumber frame, Callback& progress) {
        struct Stopped {};
        const Interruptible stops([&] {
            if (!progress()) throw Stopped();
        });
        try {
            return renderer.render(frame,
                                   [&](const RenderProgress& p) { return progress([&] { return progress_of(p); }); });
        } catch (const Stopped&) {
            RenderResult incomplete;
            incomplete.stats.interrupted = true;
            return incomplete;
        }
    }

    std::shared_ptr<PyPicture> render(std::optional<FrameNumber> frame, py::object function, const Log& log) {
        check_driver_not_forked();
        const Busy busy(*scene);
        Callback progress(std::move(function));
        auto picture = std::make_shared<PyPicture>();
        bool cancelled = false;
        {
            const Unlocked unlocked;
            Stopwatch clock;
            const auto go_on = [&](double) {
                return progress([&] { return progress_of({.samples_total = renderer.settings().samples}); });
            };
            cancelled = !renderer.find_estimator(go_on);
            if (!cancelled) {
                picture->result = render(frame.value_or(own_frame), progress);
                StepTimes times;
                times.load = renderer.load_seconds();
                times.render = clock.lap() - times.load;
                times.total = clock.seconds();
                const RenderStats& stats = picture->result.stats;
                if (!stats.interrupted) {
                    const std::string error = judge(stats, output, "picture", log);
                    picture->info = picture_info(renderer, picture->result, output, error);
                }
                picture->layers = renderer.settings().aovs;
                picture->statistics = run_statistics(renderer, stats, times, {})
                                          .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
            }
        }
        progress.rethrow();
        if (cancelled) throw Error("picture", "stopped before its first sample");
        return picture;
    }

    std::optional<std::string> find_estimator(py::object function) {
        check_driver_not_forked();
        const Busy busy(*scene);
        Callback progress(std::move(function));
        std::optional<Estimator> found;
        {
            const Unlocked unlocked;
            found = renderer.find_estimator([&](double share) { return progress([&] { return py::float_(share); }); });
        }
        progress.rethrow();
        return found ? std::optional(text(*found)) : std::nullopt;
    }

    /// Changes settings of single pictures: samples, seed, error, time, filter.
    void change(const SettingTexts& more) {
        const Busy busy(*scene);
        SettingTexts changed = texts;
        static const std::set<std::string> kOfPicture{"samples", "seed", "error", "time", "filter", "filter-radius"};
        for (const auto& [name, value] : more) {
            if (!kOfPicture.contains(name))
                throw Error("settings", "{} holds for all pictures of a renderer; make another one", name);
            changed[name] = value;
        }
        renderer.set_frame_settings(settings_of(changed, scene->scene.chosen_camera().camera));
        texts = std::move(changed);
    }
};

OutputOptions output_of(const std::string& working_space, bool reproducible, bool strict, bool best_effort,
                        const std::string& exr_compression, bool exr_parts, int exr_tiles, int png_bits,
                        int jpeg_quality, const std::string& tiff_type) {
    if (png_bits != 0 && png_bits != 8 && png_bits != 16)
        throw Error("png_bits", "expects 8 or 16, or 0 for 16 in HDR alone, not {}", png_bits);
    if (jpeg_quality < 1 || jpeg_quality > 100) throw Error("jpeg_quality", "expects 1 to 100, not {}", jpeg_quality);
    if (tiff_type != "8" && tiff_type != "16" && tiff_type != "float")
        throw Error("tiff_type", "expects 8, 16 or float, not '{}'", tiff_type);
    return {.working_space = working_space,
            .exr = {exr_compression_named(exr_compression), exr_parts, exr_tiles},
            .jpeg_quality = jpeg_quality,
            .png_bits = png_bits,
            .tiff = tiff_type == "8"    ? TiffType::uint8
                    : tiff_type == "16" ? TiffType::uint16
                                        : TiffType::float32,
            .reproducible = reproducible,
            .strict = strict,
            .best_effort = best_effort};
}

RendererOptions options_of(const std::string& device, bool shader_cache,
                           const std::optional<std::filesystem::path>& ocio, double shutter,
                           std::optional<int> shutter_times, const std::string& shutter_position, double shutter_ramp) {
    return {.context = shared_context(device, shader_cache),
            .colors = ColorConfig::load(ocio),
            .shutter = {.open = shutter,
                        .times = shutter_times,
                        .position = parse_shutter_position("shutter position", shutter_position),
                        .ramp = shutter_ramp}};
}

std::unique_ptr<PyRenderer> make_renderer(std::shared_ptr<PyScene> scene, const SettingTexts& texts,
                                          const RendererOptions& options, OutputOptions output, bool measure,
                                          int pictures) {
    const Busy busy(*scene);
    RenderSettings settings = settings_of(texts, scene->scene.chosen_camera().camera);
    settings.measure = measure;
    settings.pictures = pictures;
    const Unlocked unlocked;
    const FrameNumber frame = settings.frame;
    FrameRenderer renderer(scene->scene, std::move(settings), options);
    return std::make_unique<PyRenderer>(
        PyRenderer{std::move(scene), std::move(renderer), std::move(output), texts, frame});
}

bool same_camera(const CameraChoice& a, const CameraChoice& b) {
    return a.camera == b.camera && a.look_from == b.look_from && a.look_at == b.look_at && a.up == b.up &&
           a.vertical_fov == b.vertical_fov && a.pose == b.pose;
}

/// Returns the keys of edits that a function makes for each frame, and for those near it on which pictures depend. It
/// gets the scene as it is now each time, and leaves it so.
EditKeys keys_of_function(PyScene& s, const py::object& function, const std::vector<FrameNumber>& frames,
                          FrameNumber near) {
    const SceneEdits base = s.readable().edits();
    const CameraChoice camera = s.readable().camera_choice();
    const bool orthographic = s.readable().chosen_camera().camera.orthographic;
    const auto restore = [&] {
        const Busy busy(s);  // the function may let other threads run
        s.scene.edit(base);
        if (!same_camera(s.scene.camera_choice(), camera)) s.scene.set_camera(camera);
    };
    // The exposure and the pilot follow from the scene at 0 s.
    std::set<FrameNumber> all{s.scene.choice().frame_offset};
    for (const FrameNumber frame : frames)
        for (FrameNumber n = frame - near; n <= frame + near; ++n) all.insert(n);
    std::vector<FrameEdits> edits;
    try {
        for (const FrameNumber frame : all) {
            restore();
            function(frame);
            FrameEdits& own = edits.emplace_back(FrameEdits{frame, s.readable().edits(), {}});
            const CameraChoice& now = s.readable().camera_choice();
            if (same_camera(now, camera)) continue;
            if (now.look_from && orthographic)
                throw Error("edit()", "frame {}: look() is in perspective, but the camera of the scene is orthographic",
                            frame);
            if (!now.look_from && !now.camera)
                throw Error("edit()", "frame {} goes back to the default camera; it needs a camera's name, or look()",
                            frame);
            if (now.look_from)
                own.camera = {.from = now.look_from, .at = now.look_at, .up = now.up, .vfov = now.vertical_fov};
            else
                own.camera.camera = now.camera;
        }
    } catch (...) {
        restore();
        throw;
    }
    restore();
    return keys_of(edits, base, "edit()");
}

py::dict render_files(const std::shared_ptr<PyScene>& scene, const SettingTexts& texts, const RendererOptions& renderer,
                      const OutputOptions& output, const std::vector<std::filesystem::path>& outputs,
                      const std::vector<FrameNumber>& frames, const std::optional<std::filesystem::path>& movie,
                      const std::optional<std::filesystem::path>& stats, bool overwrite,
                      const std::vector<std::string>& accept_sources, bool develop, const py::object& edit,
                      py::object function, py::object log) {
    const RenderSettings settings = settings_of(texts, scene->readable().chosen_camera().camera);
    struct Keys {
        PyScene& s;
        EditKeys before;
        ~Keys() {
            try {
                const Busy busy(s);
                s.scene.set_keys(before);
            } catch (const Error&) {  // its surfaces were freed
            }
        }
    } const keys{*scene, scene->readable().keys()};
    if (!edit.is_none()) {
        const int reach = settings.denoise_frames.value_or(has_halves(settings) ? kDenoiseFrames : 0);
        const auto open = static_cast<FrameNumber>(std::ceil(renderer.shutter.open));
        EditKeys all = keys.before;
        for (EditTrack& track : keys_of_function(*scene, edit, frames, std::max(reach, 1) + open).tracks)
            all.tracks.push_back(std::move(track));
        const Busy busy(*scene);
        scene->scene.set_keys(std::move(all));
    }
    const Busy busy(*scene);
    Callback progress(std::move(function));
    const SequenceOptions options{.frames = frames,
                                  .part = {},
                                  .outputs = outputs,
                                  .movie = movie,
                                  .stats = stats,
                                  .overwrite = overwrite,
                                  .accept_sources = accept_sources,
                                  .develop = develop,
                                  .output = output};
    const Log sink = log_to(std::move(log));
    SequenceEvents events;
    events.go_on = [&] { return progress(); };
    events.progress = [&](FrameNumber frame, const RenderProgress& p) {
        return progress([&] { return py::make_tuple(frame, p.samples_done, p.samples_total, p.seconds); });
    };
    SequenceTally tally;
    {
        const Unlocked unlocked;
        tally = render_sequence(scene->scene, settings, renderer, options, events, sink);
    }
    progress.rethrow();
    py::dict result;
    result["frames"] = tally.frames;
    result["kept"] = tally.kept;
    result["made"] = tally.made;
    result["stopped_in"] = tally.stopped_in;
    return result;
}

py::dict denoise_files(const std::vector<std::filesystem::path>& frames,
                       const std::vector<std::filesystem::path>& outputs, std::optional<int> near,
                       const SettingTexts& texts, const RendererOptions& renderer, const OutputOptions& output,
                       bool overwrite, const std::vector<std::string>& accept_sources, py::object function,
                       py::object log) {
    const ViewTransform view = settings_of(texts, {}).view;  // throws for unknown names
    for (const auto& [name, value] : texts)
        if (setting(name).group != "Colour")
            throw Error("settings", "{} was decided when the frames were rendered", name);
    Callback progress(std::move(function));
    const Log sink = log_to(std::move(log));
    DenoiseTally tally;
    {
        const Unlocked unlocked;
        tally = denoise_frames(
            {.frames = frames,
             .outputs = outputs,
             .near = near,
             .view = view,
             .output = output,
             .overwrite = overwrite,
             .accept_sources = accept_sources,
             .colors = renderer.colors,
             .context = renderer.context},
            [&](std::size_t done, std::size_t all) { return progress([&] { return py::make_tuple(done, all); }); },
            sink);
    }
    progress.rethrow();
    py::dict result;
    result["frames"] = tally.frames;
    result["kept"] = tally.kept;
    result["made"] = tally.made;
    return result;
}

}  // namespace

void bind_renderer(py::module_& module) {
    py::class_<OutputOptions>(module, "OutputOptions").def(py::init(&output_of));
    py::class_<RendererOptions>(module, "RendererOptions").def(py::init(&options_of));
    py::class_<PyRenderer>(module, "Renderer")
        .def(py::init(&make_renderer))
        .def("render", [](PyRenderer& r, std::optional<FrameNumber> frame, py::object progress,
                          py::object log) { return r.render(frame, std::move(progress), log_to(std::move(log))); })
        .def("find_estimator", &PyRenderer::find_estimator)
        .def("change", &PyRenderer::change)
        .def_property_readonly("frame", [](const PyRenderer& r) { return r.renderer.settings().frame; })
        .def_property_readonly("device", [](const PyRenderer& r) { return r.renderer.context().renderer(); });
    module.def("render_files", &render_files);
    module.def("denoise_files", &denoise_files);
    module.def("parse_frames", [](const std::string& list) { return parse_frames("frames", list); });
    module.def("settings", [] {
        py::list rows;
        for (const Setting& s : known_settings()) rows.append(py::make_tuple(s.name, s.metavar, s.help, s.values));
        return rows;
    });
    module.def("layers", [] {
        py::list rows;
        for (const AovInfo& a : known_aovs())
            rows.append(py::make_tuple(a.name, a.channels, a.description, a.debug(), a.in_all()));
        return rows;
    });
    module.def("devices", [] {
        check_driver_not_forked();
        py::list rows;
        for (const gpu::DeviceAttempt& d : gpu::Context::probe())
            rows.append(py::make_tuple(d.name, d.taken, d.reason));
        return rows;
    });
}

}  // namespace halflight::python
