#include <algorithm>

#include "engine/core/names.h"
#include "tools/halflight/converge_options.h"
#include "tools/measure/converge/external.h"

namespace halflight {
namespace {

using converge::Budget, converge::Method;

constexpr int kMaxSeeds = 1 << 16;
constexpr std::size_t kMaxBudgets = 1 << 10;         // kMaxBudgets * kMaxSeeds < converge::kSeedsOfMethods
constexpr double kShortest = 0.001, kLongest = 1e9;  // limits of budgets, seconds

/// Parses a comma list of growing budgets.
std::vector<Budget> budgets(const std::string& option, const std::string& list,
                            const std::function<Budget(const std::string&)>& parse) {
    std::vector<Budget> ladder;
    for (const std::string& text : split_names(list)) {
        const Budget next = parse(text);
        if (!ladder.empty() && next.samples + next.seconds <= ladder.back().samples + ladder.back().seconds)
            throw UsageError(option, "expects growing budgets, not '{}'", list);
        ladder.push_back(next);
    }
    if (ladder.size() > kMaxBudgets) throw UsageError(option, "expects at most {} budgets", kMaxBudgets);
    return ladder;
}

std::vector<Method> methods(const std::string& option, const std::string& list) {
    std::vector<Method> wanted;
    for (const std::string& text : split_names(list)) {
        const auto method = converge::method_named(text);
        if (!method) throw UsageError(option, "expects some of {}, not '{}'", converge::known_methods(), text);
        if (std::ranges::find(wanted, *method) != wanted.end()) throw UsageError(option, "'{}' is given twice", text);
        wanted.push_back(*method);
    }
    return wanted;
}

converge::External external(const std::string& option, const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
        throw UsageError(option, "expects NAME=COMMAND, not '{}'", text);
    converge::External made{text.substr(0, equals), text.substr(equals + 1)};
    if (converge::method_named(made.name)) throw UsageError(option, "'{}' is the name of another method", made.name);
    try {
        converge::check_external(made);
    } catch (const Error& error) {
        throw UsageError(option, "{}", error.what());
    }
    return made;
}

/// Parses each of several lists that newlines separate by one(option, list).
template <class One>
auto each_given(const std::string& option, const std::string& lists, const One& one) {
    std::vector<decltype(one(option, lists))> wanted;
    for (const std::string& list : split_names(lists, "\n")) {
        wanted.push_back(one(option, list));
        if (std::ranges::count(wanted, wanted.back()) > 1) throw UsageError(option, "'{}' is given twice", list);
    }
    return wanted;
}

bool is_on(const std::string& option, const std::string& text) {
    if (text != "on" && text != "none") throw UsageError(option, "expects on or none, not '{}'", text);
    return text == "on";
}

/// Returns all combinations of what is to be compared.
std::vector<converge::Technique> techniques(const ConvergeArguments& a) {
    const auto or_default = [](const auto& list) { return list.empty() ? std::decay_t<decltype(list)>(1) : list; };
    std::vector<converge::Technique> all;
    for (const Estimator& estimator : or_default(a.estimators))
        for (const Preview& preview : or_default(a.previews))
            for (const bool denoise : or_default(a.denoise)) all.push_back({estimator, preview, denoise});
    return all;
}

void set_reference(converge::ReferenceOrder& order, const std::string& text) {
    using enum converge::ReferenceOrder::Maker;
    order.maker = text == "oracle" ? oracle : text == "gl" ? gl : file;
    if (order.maker == file) order.file = text;
}

}  // namespace

void add_converge_options(CLI::App& app, ConvergeArguments& a) {
    a.plan.methods.assign(std::begin(converge::kUsualMethods), std::end(converge::kUsualMethods));
    a.usual_width = 320;  // pixels; enough to measure error against time
    for (int samples = 1; samples <= 64; samples *= 2) a.plan.budgets.push_back({samples, 0});
    app.add_option("SCENE", a.choice.scene, "glTF 2.0 scene, .gltf or .glb")->type_name("")->required();
    app.add_option("-o,--output", a.folder, "folder for report.html, report.json and report.csv, created if missing")
        ->type_name("DIR")
        ->required();

    Options options(app);
    options.group("Measurement");
    options.value("--method", "NAME,...",
                  "methods that render pictures: " + converge::known_methods() + " (default: all but native)",
                  [&](const auto& name, const auto& text) { a.plan.methods = methods(name, text); });
    options
        .value("--estimator", "KEY=VALUE,...",
               "sampling techniques of the GL methods (give the option several times to compare them): " +
                   known_estimators(),
               [&](const auto& name, const auto& text) { a.estimators = each_given(name, text, estimator); })
        ->multi_option_policy(CLI::MultiOptionPolicy::Join);
    options
        .value("--preview", "NAME,...",
               "preview modes of the GL methods (give the option several times to compare them): none, " +
                   known_previews(),
               [&](const auto& name, const auto& text) { a.previews = each_given(name, text, preview); })
        ->multi_option_policy(CLI::MultiOptionPolicy::Join);
    options
        .value("--denoise", "on|none",
               "filters noise out of the pictures of the GL methods (give the option twice to compare both)",
               [&](const auto& name, const auto& text) { a.denoise = each_given(name, text, is_on); })
        ->multi_option_policy(CLI::MultiOptionPolicy::Join);
    options.value("--warm-up", "N",
                  "samples from a neighbouring camera that fill the radiance cache before each picture (default 0)",
                  [&](const auto& name, const auto& text) { a.plan.warm_up = whole(name, text, 0, kMaxSamples); });
    options.value(
        "--external", "NAME=COMMAND",
        "another renderer as one more method: a program and its arguments, quoted as for a shell but run without one. "
        "Placeholders: {scene} {output} {environment} {camera} {look-from} {look-at} {up} {vfov} {samples} {seed} "
        "{width} {height} {bounces} {bounces-1} {threads}. The program must write the .exr {output}",
        [&](const auto& name, const auto& text) { a.plan.external = external(name, text); });
    options.flag(
        "--require-agreement", a.require_agreement,
        "fails unless the external renderer's pictures agree with those of all methods. Means may differ by 1 %. "
        "Blocks of 16x16 pixels may differ by 2 % plus a standard error; as many as noise explains may differ more");
    options.value("--samples,-s,--spp", "N,...", "budgets in samples per pixel (default 1,2,4,... 64)",
                  [&](const auto& name, const auto& text) {
                      a.plan.budgets = budgets(name, text, [&](const std::string& one) {
                          return Budget{whole(name, one, 1, kMaxSamples), 0};
                      });
                  });
    options.value("--seconds", "S,...", "budgets in seconds of wall time per picture, instead of --samples",
                  [&](const auto& name, const auto& text) {
                      a.plan.budgets = budgets(name, text, [&](const std::string& one) {
                          return Budget{0, real(name, one, kShortest, kLongest)};
                      });
                  });
    options.value("--seeds", "K", "number of independent pictures for each method and budget (default 8)",
                  [&](const auto& name, const auto& text) { a.plan.seeds = whole(name, text, 1, kMaxSeeds); });
    options.value("--seed", "N", "first seed (default 1)", [&](const auto& name, const auto& text) {
        a.plan.first_seed = whole(name, text, 1u, converge::kSeedsOfMethods - 1);
    });
    options.setting(setting("clamp"), a.settings);
    options.value("--clock", "wall|cpu", "clock for run times; cpu suits shared machines (default wall)",
                  [&](const auto& name, const auto& text) {
                      if (text != "wall" && text != "cpu")
                          throw UsageError(name, "expects wall or cpu, not '{}'", text);
                      a.clock = text == "cpu" ? bench::Clock::cpu : bench::Clock::wall;
                  });
    options.group("Reference");
    options.value(
        "--reference", "oracle|gl|FILE",
        "renderer of the reference, or an .exr of the same size (default: the oracle, which shares no code with the "
        "engine)",
        [&](const auto& name, const auto& text) {
            if (text.empty()) throw UsageError(name, "expects oracle, gl or the name of a file");
            set_reference(a.reference, text);
        });
    options.value(
        "--reference-samples", "N",
        "minimum samples per pixel of the reference (default: 16 times the largest budget, at least 1024; 1024 with "
        "--seconds)",
        [&](const auto& name, const auto& text) { a.reference.samples = whole(name, text, 2, kMaxSamples); });
    options.value("--cache", "DIR",
                  "folder in which references are stored and refined (default: $XDG_CACHE_HOME/halflight/references)",
                  [&](const auto& name, const auto& text) {
                      if (text.empty()) throw UsageError(name, "expects the name of a folder");
                      a.reference.folder = text;
                  });
    add_camera_options(options, a);
    options.settings(a.settings, [](const Setting& s) { return s.group == "Camera"; });
    options.group("Picture");
    for (const char* name : {"width", "height", "filter", "filter-radius"}) options.setting(setting(name), a.settings);
    options.group("Light");
    options.settings(a.settings);
    add_environment_options(options, a.choice);
    add_variant_option(options, a.choice.variant);
    add_line_width_option(options, a.choice.line_width);
    add_edit_options(options, a);
    add_device_options(options, a);
    add_strict_option(options, a.choice);
    options.alternatives({"--samples", "--seconds"});
    // Commands get neither the seconds nor the filter, and they read the scene's own file.
    for (const char* other :
         {"--seconds", "--filter", "--light", "--material", "--node", "--hide", "--variant", "--line-width", "--sky"})
        options.alternatives({"--external", other});
}

void check_converge_options(const CLI::App& app, ConvergeArguments& a) {
    a.plan.clamp = a.settings.clamp;
    for (const Preview& preview : a.previews)
        if (preview.temporal)
            throw UsageError("--preview",
                             "temporal reuses light of earlier pictures, and converge renders single pictures");
    if (std::ranges::count(a.denoise, true)) {
        RenderSettings modes;
        modes.denoise = true;
        for (const Preview& preview : a.previews) modes.preview = preview, check_combinations(app, modes, {}, "");
        if (given(app, "--seconds"))
            throw UsageError("--denoise", "cannot be combined with --seconds: the filter takes at least two samples");
        if (app.count("--samples") == 0) std::erase_if(a.plan.budgets, [](const Budget& b) { return b.samples < 2; });
        if (a.plan.budgets.front().samples == 1) throw UsageError("--denoise", "needs at least two --samples");
    }
    converge::compare(a.plan, techniques(a));
    if (a.plan.warm_up > 0 && std::ranges::none_of(a.previews, &Preview::cache))
        throw UsageError("--warm-up", "needs a --preview with cache");
    if (!a.plan.external.name.empty()) {
        for (std::size_t m = 0; m < a.plan.methods.size(); ++m)
            if (a.plan.method_name(m) == a.plan.external.name)
                throw UsageError("--external", "'{}' is the name of another method", a.plan.external.name);
        a.plan.methods.push_back(converge::Method::external);
        a.plan.techniques.emplace_back();
    }
    if (a.require_agreement && (a.plan.external.name.empty() || a.plan.seeds < 2))
        throw UsageError("--require-agreement", "needs --external and at least two --seeds");
    for (const char* option : {"--shadow-catcher", "--ground", "--ground-height"})
        if (app.count(option) > 0) throw UsageError(option, "puts shadows into alpha, which converge does not measure");
    if (app.count("--light-group") > 0) throw UsageError("--light-group", "adds layers, which converge does not write");
    check_camera_options(app, a.view);
    check_optics_options(app, a);
    if (a.reference.maker == converge::ReferenceOrder::Maker::file)
        for (const char* option : {"--reference-samples", "--cache"})
            if (given(app, option)) throw UsageError(option, "has no meaning if --reference is a file");
}

}  // namespace halflight
