#include "engine/settings/constraints.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/settings/layers.h"

namespace halflight {
namespace {

using enum Constraint::Kind;
using enum Constraint::Relation;
using S = const RenderSettings&;
using O = const Occasion&;

bool has_light_groups(const RenderSettings& settings) {
    return std::ranges::any_of(settings.aovs, [](const std::string& layer) {
        const AovInfo* const aov = find_aov(layer);
        return aov && aov->is_light_group();
    });
}

constexpr Feature adaptive{"adaptive sampling", {"--adaptive"}, [](S s, O) { return s.adaptive; }};
constexpr Feature all_parts{"a run that renders all parts of the samples", {"--sample-parts"}, [](S s, O o) {
                                return s.parts > 1 && s.part == 0 && !o.one_part;
                            }};
constexpr Feature cache{"the preview mode cache", {"--preview"}, [](S s, O) { return s.preview.cache; }};
constexpr Feature catchers{"shadow catchers", {"--shadow-catcher"}, [](S, O o) { return o.catchers; }};
constexpr Feature checkpoint{"a checkpoint", {"--checkpoint"}, [](S, O o) { return o.checkpoint; }};
constexpr Feature denoise{"denoising", {"--denoise", "--keep-noisy"}, [](S s, O) { return has_halves(s); }};
constexpr Feature filtered{"a denoised picture", {"--denoise"}, [](S s, O) { return s.denoise; }};
constexpr Feature denoise_error{
    "an error of the denoised picture", {"--denoise-error"}, [](S s, O) { return s.denoise_error > 0; }};
constexpr Feature denoise_frames{
    "denoising over frames", {"--denoise-frames"}, [](S s, O) { return neighbour_frames(s) > 0; }};
constexpr Feature asked_frames{
    "denoising over frames", {"--denoise-frames"}, [](S s, O o) { return o.asked && neighbour_frames(s) > 0; }};
constexpr Feature error{"an error target", {"--error"}, [](S s, O) { return s.error.has_value(); }};
constexpr Feature few_held_out{"an error of the denoised picture from fewer than 16 samples",
                               {"--denoise-error"},
                               [](S s, O) { return s.denoise_error > 0 && s.denoise_error < kLeastEstimatedSamples; }};
constexpr Feature from_first{"the first sample of the picture", {}, [](S s, O) { return s.first_sample == 0; }};
constexpr Feature in_turns{"samples of bands in turns", {}, [](S s, O) { return s.in_turns; }};
// Settings of a finished picture have `camera`, which follows from the others.
constexpr Feature lens{"depth of field", {"--focus", "--fstop", "--aperture"}, [](S s, O o) {
                           return s.camera.lens.blurs() || (o.asked && s.view.camera.lens.blurs());
                       }};
constexpr Feature light_groups{
    "light groups", {"--light-group"}, [](S s, O o) { return o.light_groups || has_light_groups(s); }};
constexpr Feature optics{"another projection or two eyes", {"--projection", "--stereo"}, [](S s, O o) {
                             return s.camera.optics.traced() || (o.asked && s.optics.traced());
                         }};
constexpr Feature own_checkpoint{
    "a checkpoint of a single picture", {"--checkpoint"}, [](S, O o) { return o.own_checkpoint; }};
constexpr Feature parts{"parts of the samples", {"--part", "--sample-parts"}, [](S s, O) { return s.parts > 1; }};
constexpr Feature part_of_sequence{"a part of a sequence", {"--part"}, [](S, O o) { return o.part_of_sequence; }};
constexpr Feature preview{"a preview mode", {"--preview"}, [](S s, O) { return s.preview.any(); }};
constexpr Feature shutter{"motion blur", {"--shutter"}, [](S, O o) { return o.shutter; }};
constexpr Feature sixteen_samples{
    "at least 16 samples", {"--samples"}, [](S s, O) { return s.samples >= kLeastEstimatedSamples; }};
constexpr Feature sobol{
    "the sampler sobol", {"--estimator"}, [](S s, O) { return s.estimator.sampler == SamplePoints::sobol; }};
constexpr Feature stereo_views{"stereo views", {"--stereo"}, [](S s, O o) {
                                   return s.camera.optics.stereo == Stereo::views ||
                                          (o.asked && s.optics.stereo == Stereo::views);
                               }};
constexpr Feature temporal{"the preview mode temporal", {"--preview"}, [](S s, O) { return s.preview.temporal; }};
constexpr Feature time{"a time limit", {"--time"}, [](S s, O) { return s.time_limit > 0; }};
constexpr Feature two_samples{
    "at least two samples", {"--samples"}, [](S s, O o) { return !o.finished || s.samples >= 2; }};
constexpr Feature window{"crop or overscan", {"--crop", "--overscan"}, [](S s, O) { return has_window(s); }};

constexpr Constraint kConstraints[] = {
    {denoise, excludes, preview, mathematics, "the denoiser knows the noise of unbiased samples only"},
    {denoise, needs, two_samples, mathematics, "it compares two halves of the samples"},
    {denoise_error, needs, filtered, mathematics, "it is the error of the filtered picture"},
    {few_held_out, excludes, adaptive, mathematics, "the further pictures are sampled adaptively, too"},
    {error, excludes, preview, mathematics, "an error is known for the unbiased mean only"},
    {error, needs, sixteen_samples, mathematics, "8 replicates of two samples tell the error"},
    {error, needs, from_first, not_built, "replicates are parts of the whole sequence"},
    {adaptive, excludes, preview, not_built, "modes fade out by a number of samples that all pixels share"},
    {adaptive, excludes, time, not_built, "samples are distributed among pixels before they are taken", nullptr,
     &error},
    {adaptive, needs, sixteen_samples, mathematics, "pilot samples tell the noise of a block"},
    {adaptive, needs, from_first, not_built, "its pilot samples come first"},
    {adaptive, needs, sobol, not_built, "blocks take different numbers of samples"},
    {parts, excludes, error, mathematics, "the numbers of samples must be known before all parts are there"},
    {parts, excludes, time, mathematics, "the numbers of samples must be known before all parts are there"},
    {parts, excludes, adaptive, mathematics, "the pilot samples of all parts decide the samples of each"},
    {parts, excludes, in_turns, not_built, "bands have one sum each"},
    {parts, excludes, preview, not_built, "modes need the samples in order"},
    {parts, excludes, asked_frames, not_built, "the frames around have no parts"},
    {all_parts, excludes, checkpoint, not_built, "a checkpoint holds the sums of one part"},
    {window, excludes, preview, not_built, "the filter of previews needs the whole picture"},
    {window, excludes, denoise_frames, not_built, "the frames around are rendered whole"},
    {window, excludes, stereo_views, not_built, "both views share their pixels"},
    {light_groups, excludes, cache, mathematics, "its cells hold the light of all lights together"},
    {temporal, excludes, optics, not_built, "it needs the projection of the camera itself, without stereo"},
    {temporal, excludes, lens, mathematics, "blurred surfaces have no single place in the last frame"},
    {temporal, excludes, shutter, mathematics, "it has the surfaces of one time"},
    {cache, excludes, shutter, mathematics, "it has the light of one time"},
    {temporal, excludes, part_of_sequence, mathematics, "frames depend on all earlier frames"},
    {checkpoint, excludes, adaptive, not_built, "the sums of all bands grow together", &error},
    {checkpoint, excludes, in_turns, not_built, "it holds bands one after the other"},
    {checkpoint, excludes, cache, not_built, "it holds sums of samples, not the cache"},
    {checkpoint, excludes, temporal, not_built, "it holds sums of samples, not earlier frames"},
    {own_checkpoint, excludes, denoise_frames, not_built, "it holds one frame"},
    {catchers, excludes, adaptive, not_built, "the noise of shadows is not measured"},
    {catchers, excludes, error, not_built, "the noise of shadows is not measured"},
};

/// Returns how the table of docs names a feature: its name, with the options.
std::string cell(const Feature& f) {
    std::string options;
    for (const char* option : f.options)
        if (option) options += fmt::format("{}`{}`", options.empty() ? "" : ", ", option);
    return options.empty() ? f.name : fmt::format("{} ({})", f.name, options);
}

}  // namespace

bool Constraint::broken_by(const RenderSettings& s, const Occasion& o) const {
    return one.on(s, o) && other.on(s, o) == (relation == excludes) && (!beside || beside->on(s, o)) &&
           !(unless && unless->on(s, o));
}

std::string Constraint::text(const char* option) const {
    return fmt::format("{} {} {}{}{}: {}", one.name, relation == needs ? "needs" : "cannot be combined with",
                       other.name, option ? fmt::format(" ({})", option) : "",
                       beside   ? fmt::format(" beside {}", beside->name)
                       : unless ? fmt::format(" without {}", unless->name)
                                : "",
                       reason);
}

std::span<const Constraint> known_constraints() {
    return kConstraints;
}

const Constraint* broken_constraint(const RenderSettings& settings, const Occasion& occasion) {
    const auto row =
        std::ranges::find_if(kConstraints, [&](const Constraint& c) { return c.broken_by(settings, occasion); });
    return row == std::end(kConstraints) ? nullptr : &*row;
}

void check_constraints(const RenderSettings& settings, const Occasion& occasion) {
    if (const Constraint* row = broken_constraint(settings, occasion))
        throw Error("render settings", "{}", row->text());
}

std::string constraints_markdown() {
    std::string text = "| Setting | Relation | Other setting | Because | Kind |\n|---|---|---|---|---|\n";
    for (const Constraint& c : kConstraints) {
        const std::string condition = c.beside   ? fmt::format(", beside {}", cell(*c.beside))
                                      : c.unless ? fmt::format(", without {}", cell(*c.unless))
                                                 : "";
        text += fmt::format("| {} | {} | {}{} | {} | {} |\n", cell(c.one), c.relation == needs ? "needs" : "excludes",
                            cell(c.other), condition, c.reason, c.kind == mathematics ? "mathematics" : "not built");
    }
    return text;
}

}  // namespace halflight
