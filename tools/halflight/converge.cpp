#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "api/halflight/camera.h"
#include "api/halflight/loaded_scene.h"
#include "api/halflight/statistics.h"
#include "engine/gpu/driver_needs.h"
#include "engine/io/files.h"
#include "renderer/pilot.h"
#include "tools/cli/console.h"
#include "tools/cli/signals.h"
#include "tools/halflight/commands.h"
#include "tools/measure/converge/external.h"
#include "tools/measure/converge/report.h"

namespace halflight {
namespace {

using namespace converge;

constexpr const char* kReports[] = {"report.html", "report.json", "report.csv"};

/// The folder of the reports. Removes the folder and the parents that it made if nothing was written into them.
class ReportFolder {
  public:
    explicit ReportFolder(const std::filesystem::path& path) : path_(path) {
        std::error_code not_seen;
        for (std::filesystem::path p = std::filesystem::absolute(path);
             !std::filesystem::exists(p, not_seen) && p.has_relative_path(); p = p.parent_path())
            missing_.push_back(p);
        try {
            make();
            for (const char* report : kReports) check_writable(path / report);
        } catch (...) {
            remove();
            throw;
        }
    }
    ReportFolder(const ReportFolder&) = delete;
    ReportFolder& operator=(const ReportFolder&) = delete;
    ~ReportFolder() { remove(); }

    void make() const {
        std::error_code error;
        std::filesystem::create_directories(path_, error);
        if (error) throw Error(path_.string(), "cannot be made: {}", error.message());
    }

  private:
    void remove() const {
        for (const std::filesystem::path& folder : missing_) rmdir(folder.c_str());  // fails if it is not empty
    }
    std::filesystem::path path_;
    std::vector<std::filesystem::path> missing_;  // created folders, from path_ upwards
};

/// Prints a line on the console for each tenth of some work.
class Progress {
  public:
    Progress(const Console& console, std::string what) : console_(console), what_(std::move(what)) {}
    void operator()(double share) {
        const int tenths = static_cast<int>(share * 10 + 1e-9);
        if (tenths > tenths_) console_.note("{}: {} %", what_, 10 * tenths);
        tenths_ = std::max(tenths, tenths_);
    }

  private:
    const Console& console_;
    std::string what_;
    int tenths_ = 0;
};

/// Returns the samples per pixel of a reference that is much less noisy than any picture, for budgets in samples.
int usual_reference_samples(const Plan& plan) {
    constexpr int kLeast = 1024, kTimes = 16;
    return std::max(
        kLeast, static_cast<int>(std::min<std::int64_t>(std::int64_t{kTimes} * plan.budgets.back().samples, 1 << 24)));
}

}  // namespace

void run_converge(const ConvergeArguments& a) {
    gpu::prepare_process();
    const Console console(a.log.level);
    const ReportFolder folder(a.folder);
    const ColorConfig colors = ColorConfig::load();
    const ViewProcessor shown = colors.view({});

    SceneFile file(a.choice.scene, gltf_options(a.choice), 0, false);
    Scene scene = file.gltf().at_rest();
    for (const std::string& warning : scene.report.warnings) console.warn("{}", warning);
    set_environment(scene, a.choice.environment, console,
                    {.lamps = a.choice.lamps,
                     .camera = free_camera(scene, a.view),
                     .azimuth = a.choice.light_azimuth.value_or(azimuth_of_light(scene, a.view)),
                     .straight_glass = a.choice.edits.straight_glass});
    apply(a.choice.edits, scene, file.tree_at(0));
    CameraChoice choice = a.view;
    if (a.width && a.height) choice.aspect = eye_aspect(a.settings.optics, {*a.width, *a.height});
    const ChosenCamera chosen = choose_camera(scene, choice);
    const Camera camera = with_optics(with_lens(chosen.camera, a.settings.view.camera.lens), a.settings.optics);
    if (camera.lens.focus.kind == Focus::Kind::point)
        throw Error("focus", "the reference needs a distance, not a point of the picture");
    const ivec2 size = picture_size(a.width, a.height, a.usual_width, camera);
    Subject subject{
        .program = "halflight " HALFLIGHT_VERSION,
        .scene = a.choice.scene.string(),
        .camera = chosen.origin,
        .environment = environment_name(scene.environment),
        .device = {},
        .view = {size.x, size.y, camera, a.settings.bounces.value_or(default_bounces(scene)), a.settings.filter},
        .plan = a.plan,
        .clock = a.clock};
    ReferenceOrder order = a.reference;
    if (order.samples == 0) order.samples = usual_reference_samples(a.plan);
    if (order.folder.empty()) order.folder = default_reference_folder();

    std::optional<gpu::Context> context;
    std::vector<std::pair<Estimator, std::unique_ptr<PreparedScene>>> prepared;
    const auto gl = [&](const Estimator& estimator) -> PreparedScene& {
        if (!context) {
            context.emplace(gpu::Context::create({.device = a.device, .debug = a.gl_debug}));
            subject.device = context->renderer();
        }
        const auto same = std::ranges::find(prepared, estimator, [](const auto& p) { return p.first; });
        if (same != prepared.end()) return *same->second;
        prepared.emplace_back(estimator,
                              std::make_unique<PreparedScene>(*context, scene, PrepareOptions{.estimator = estimator}));
        PreparedScene& made = *prepared.back().second;
        if (leaves_open(estimator)) {
            RenderSettings settings;
            settings.width = subject.view.width, settings.height = subject.view.height;
            settings.camera = subject.view.camera;
            settings.bounces = subject.view.bounces;
            settings.filter = subject.view.filter;
            settings.clamp = a.plan.clamp;
            const auto go_on = [](double) { return stop_signal() == 0; };
            if (!find_estimator(made, colors, settings, go_on))
                throw Interrupted(stop_signal(), a.folder.string(), "nothing was written: interrupted");
            subject.pilots.push_back(
                fmt::format("A pilot has chosen {} for {}.", text(made.estimator()), text(estimator)));
            console.note("{}", subject.pilots.back());
        }
        subject.scene_seconds += made.seconds();
        return made;
    };
    const Pulse pulse = [&] {
        if (const int signal = stop_signal())
            throw Interrupted(signal, a.folder.string(), "nothing was written: interrupted");
    };
    const auto note = [&](const std::string& line) { console.note("{}", line); };
    std::unique_ptr<Painter> other;
    if (!a.plan.external.name.empty()) {
        other = external_painter(a.plan.external, {a.choice.scene, scene.environment}, subject.view);
        other->paint({1, 0}, 1, pulse);  // a command that fails does so before a long reference
    }
    const Reference reference =
        make_reference(order, scene, subject.view, colors, [&]() -> PreparedScene& { return gl({}); },
                       {pulse, Progress(console, "reference"), note});
    if (reference.samples > 0)
        console.note("reference: {}, {} samples, {} of them kept from earlier runs", name_of(reference),
                     reference.samples, reference.found);

    std::vector<std::unique_ptr<Painter>> painters;
    for (std::size_t m = 0; m < a.plan.methods.size(); ++m) {
        const Method method = a.plan.methods[m];
        if (method == Method::external) {
            painters.push_back(std::move(other));
            continue;
        }
        const converge::Technique technique = a.plan.technique(m);
        painters.push_back(uses_gl(method) ? gl_painter(gl(technique.estimator), colors, subject.view, method,
                                                        a.plan.clamp, technique, a.plan.warm_up)
                                           : oracle_painter(scene, subject.view));
    }
    const Measurement measured = measure(a.plan, painters, reference, a.clock, {pulse, Progress(console, "pictures")});
    if (context) context->check("rendering");

    const std::string html = report_html(subject, reference, measured, shown);
    const std::string json =
        report_json(subject, reference, measured).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    const std::string csv = report_csv(subject, measured);
    {
        const WritingFiles writing;
        folder.make();  // the folder may have been removed meanwhile
        write_file(a.folder / kReports[2], csv);
        write_file(a.folder / kReports[1], json);
        write_file(a.folder / kReports[0], html);
    }
    for (const std::string& bias : biases(a.plan)) console.note("biased on request: {}", bias);
    const auto sentences = [&](const MethodAgreement& found) {
        return verdict_text(found, measured.methods) + " " + reasons_text(found, measured.methods);
    };
    for (const MethodAgreement& found : measured.agreements) console.note("{}", sentences(found));
    for (const std::string& line : rankings(subject, measured)) console.note("{}", line);
    for (const MethodResult& m : measured.methods) {
        console.note("{}: slope {}", m.name, text(m.slope));
        for (const Finding& f : m.findings) console.note("{}: {}: {}", m.name, name(f.kind), f.text);
    }
    console.note("wrote {}", (a.folder / kReports[0]).string());
    if (measured.pictures_different > 0)
        throw Error(a.folder.string(), "{} of {} pictures depend on the method that traces",
                    measured.pictures_different, measured.pictures_compared);
    for (const MethodAgreement& found : measured.agreements)
        if (a.require_agreement && found.agreement.verdict() != Verdict::agree)
            throw Error(a.folder.string(), "agreement is required: {}", sentences(found));
}

}  // namespace halflight
