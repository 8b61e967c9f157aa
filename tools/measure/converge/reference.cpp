#include "tools/measure/converge/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "engine/core/error.h"
#include "engine/io/exr.h"
#include "tools/measure/converge/fingerprint.h"

namespace halflight::converge {
namespace {

using Maker = ReferenceOrder::Maker;

constexpr std::uint64_t kOracleSeed = std::uint64_t{1} << 40;  // lies beyond the seeds of methods, which have 32 bits
constexpr std::uint32_t kGlSeed = kSeedsOfMethods;

/// Returns the view of a small picture, which identifies a renderer's code and takes little time.
View probe_view(View view) {
    view.width = view.height = 8;
    return view;
}

/// A renderer of samples, and the size of its portions.
struct Samples {
    AddSamples add;
    Picture probe;
    Portion portion;
    std::string name;
};

Samples oracle_source(const ReferenceScene& scene, const View& view, const Pulse& pulse) {
    // Portions of some ten thousand paths take about a second.
    const int largest = std::max(1, static_cast<int>(200000 / (std::int64_t{view.width} * view.height)));
    const auto add = [&scene, view, pulse](int half, std::int64_t first, int count) {
        pulse();
        return oracle_samples(scene, view, kOracleSeed + static_cast<std::uint64_t>(half), static_cast<int>(first),
                              count);
    };
    return {add, oracle_samples(scene, probe_view(view), kOracleSeed, 0, 4), {.largest = largest}, "oracle"};
}

/// Renders each portion with a seed of its own: samples of one picture are stratified, so that ranges of one sequence
/// would not be independent.
Samples gl_source(PreparedScene& scene, const ColorConfig& colors, const View& view, const Pulse& pulse) {
    const auto painter = [&](const View& v) { return gl_painter(scene, colors, v, Method::compute); };
    const auto add = [painter = std::shared_ptr(painter(view)), pulse](int half, std::int64_t first, int count) {
        const auto seed = kGlSeed + static_cast<std::uint32_t>(2 * first + half);
        return painter->paint({.samples = count}, seed, pulse).picture;
    };
    return {add, painter(probe_view(view))->paint({.samples = 4}, kGlSeed, pulse).picture, {.largest = 256}, "gl"};
}

bool is_rec709(const Chromaticities& c) {
    constexpr double kRounding = 1e-6;  // relative rounding error of the file's floats
    const auto near = [](const dvec2& a, const dvec2& b) { return glm::distance(a, b) < kRounding; };
    return near(c.red, kRec709.red) && near(c.green, kRec709.green) && near(c.blue, kRec709.blue) &&
           near(c.white, kRec709.white);
}

Reference read_reference(const std::filesystem::path& path, const View& view) {
    const ExrFile exr = read_exr(path, limits_of_renders());
    const ivec2 size = exr.attributes.display.value();
    if (size != ivec2(view.width, view.height))
        throw Error(path.string(), "the reference has {} x {} pixels, the pictures are to have {} x {}", size.x, size.y,
                    view.width, view.height);
    if (exr.attributes.chromaticities && !is_rec709(*exr.attributes.chromaticities))
        throw Error(path.string(), "the reference is not in linear Rec.709");
    const auto planes = [&](const std::string& layer) {
        return std::vector<std::string>{layer + "R", layer + "G", layer + "B"};
    };
    Reference reference;
    reference.maker = path.string();
    reference.reason = "it was requested; its noise is not known and counts as error of the methods";
    reference.file = path;
    reference.halves_differ = false;
    const auto picture = [&](const std::string& layer) { return exr.whole(path.string(), planes(layer)); };
    reference.mean.beauty = picture("");
    for (std::size_t i = 0; i < kComponents.size(); ++i) {
        const std::string layer = std::string(kComponents[i]) + ".";
        reference.has_components = reference.has_components && exr.find(layer + "R") != nullptr;
        if (reference.has_components) reference.mean.components[i] = picture(layer);
    }
    reference.halves = {reference.mean, reference.mean};
    return reference;
}

}  // namespace

std::string name_of(const Reference& reference) {
    return reference.samples > 0 ? "Halflight (" + reference.maker + ")" : reference.maker;
}

std::pair<Maker, std::string> choose_maker(const Scene& scene, Maker wanted) {
    if (wanted != Maker::automatic) return {wanted, "it was requested"};
    constexpr std::size_t kMostTriangles = 20'000'000;  // the oracle takes about 150 B for each, instances flattened
    std::size_t triangles = 0;
    for (const Instance& instance : scene.instances)
        triangles += scene.meshes[static_cast<std::size_t>(instance.mesh)].triangles.size();
    if (triangles > kMostTriangles)
        return {Maker::gl, fmt::format("{} triangles with every instance counted are too many for the oracle: a bias "
                                       "that all methods share does not show",
                                       triangles)};
    return {Maker::oracle, "it shares no code with the engine, so that a bias of either shows"};
}

Halves continue_halves(const std::filesystem::path& path, std::uint64_t fingerprint, const View& view,
                       std::int64_t samples_of_each, const AddSamples& more, const Portion& portion,
                       const std::function<void(double)>& progress,
                       const std::function<void(const std::string&)>& note) {
    Halves halves{PictureSums(view.width, view.height), PictureSums(view.width, view.height)};
    try {
        if (auto kept = load_halves(path, fingerprint, view.width, view.height)) halves = std::move(*kept);
    } catch (const Error& error) {
        note(fmt::format("{}: begun anew", error.what()));
    }
    if (std::min(halves[0].samples, halves[1].samples) >= samples_of_each) return halves;
    prepare_to_save(path);
    const auto held = [&] { return halves[0].samples + halves[1].samples; };
    const std::int64_t before = held();
    std::int64_t saved = before;
    const auto save = [&] {
        if (held() == saved) return;
        try {
            save_halves(path, fingerprint, halves);
            saved = held();
        } catch (const Error& error) {  // the samples can be used even if they cannot be saved
            note(error.what());
        }
    };
    Stopwatch since_saved;
    try {
        for (;;) {
            const int half = halves[1].samples < halves[0].samples ? 1 : 0;
            PictureSums& sums = halves[static_cast<std::size_t>(half)];
            if (sums.samples >= samples_of_each) break;
            const auto count = std::min<std::int64_t>(portion.largest, samples_of_each - sums.samples);
            sums.add(more(half, sums.samples, static_cast<int>(count)));
            progress(static_cast<double>(held() - before) / static_cast<double>(2 * samples_of_each - before));
            if (since_saved.seconds() > portion.save_every) {
                save();
                since_saved = {};
            }
        }
    } catch (...) {
        save();
        if (saved > 0) note(fmt::format("reference: {} samples are kept", saved));
        throw;
    }
    save();
    return halves;
}

Reference make_reference(const ReferenceOrder& order, const Scene& scene, const View& view, const ColorConfig& colors,
                         const std::function<PreparedScene&()>& gl, const ReferenceHooks& hooks) {
    const auto [maker, reason] = choose_maker(scene, order.maker);
    if (maker == Maker::file) return read_reference(order.file, view);

    std::optional<ReferenceScene> oracle_scene;
    if (maker == Maker::oracle) oracle_scene.emplace(scene);
    const Samples source =
        oracle_scene ? oracle_source(*oracle_scene, view, hooks.pulse) : gl_source(gl(), colors, view, hooks.pulse);
    Reference reference;
    reference.maker = source.name;
    reference.reason = reason;
    reference.fingerprint = reference_fingerprint(scene_fingerprint(scene), view, source.name, source.probe);
    reference.file = reference_path(order.folder, reference.fingerprint);

    std::int64_t made = 0;
    const CpuStopwatch watch;
    const auto counted = [&](int half, std::int64_t first, int count) {
        const Picture picture = source.add(half, first, count);
        if (picture.non_finite > 0)
            hooks.note(fmt::format("reference: {} values were not finite and are left out", picture.non_finite));
        made += count;
        return picture;
    };
    const Halves halves = continue_halves(reference.file, reference.fingerprint, view, (order.samples + 1) / 2, counted,
                                          source.portion, hooks.progress, hooks.note);
    reference.time = watch.seconds();
    reference.samples = halves[0].samples + halves[1].samples;
    reference.found = reference.samples - made;
    PictureSums both = halves[0];
    both.add(halves[1]);
    reference.mean = both.mean();
    reference.halves = {halves[0].mean(), halves[1].mean()};
    return reference;
}

}  // namespace halflight::converge
