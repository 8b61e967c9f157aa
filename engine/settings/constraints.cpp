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
constexpr Feature cache{"the preview mode cache", {"--preview"}, [](S s, O) { return s.preview.cache; }, "cache"};
constexpr Feature checkpoint{"a checkpoint", {"--checkpoint"}, [](S, O o) { return o.checkpoint; }};
constexpr Feature denoise{"denoising", {"--denoise", "--keep-noisy"}, [](S s, O) { return has_halves(s); }};
constexpr Feature filtered{"a denoised picture", {"--denoise"}, [](S s, O) { return s.denoise; }};
constexpr Feature denoise_error{
    "an error of the denoised picture", {"--denoise-error"}, [](S s, O) { return s.denoise_error > 0; }};
constexpr Feature denoise_frames{
    "denoising over frames", {"--denoise-frames"}, [](S s, O) { return neighbour_frames(s) > 0; }};
constexpr Feature asked_frames{"denoising over frames", {"--denoise-frames"}, [](S s, O o) {
                                   return o.asked && s.denoise_frames.value_or(0) > 0;
                               }};
constexpr Feature denoiser_layer{
    "the layer denoiser",
    {"--aov"},
    [](S s, O o) { return o.asked && std::ranges::find(s.aovs, "denoiser") != s.aovs.end(); },
    "denoiser"};
constexpr Feature error{"an error target", {"--error"}, [](S s, O) { return s.error.has_value(); }};
constexpr Feature few_held_out{"an error of the denoised picture from fewer than 16 samples",
                               {"--denoise-error"},
                               [](S s, O) { return s.denoise_error > 0 && s.denoise_error < kLeastEstimatedSamples; }};
// Settings of a finished picture have `camera`, which follows from the others.
constexpr Feature lens{"depth of field", {"--focus", "--fstop", "--aperture"}, [](S s, O o) {
                           return s.camera.lens.blurs() || (o.asked && s.view.camera.lens.blurs());
                       }};
constexpr Feature light_groups{
    "light groups", {"--light-group"}, [](S s, O o) { return o.light_groups || has_light_groups(s); }};
constexpr Feature links{"light links", {"--light-link", "--shadow-link"}, [](S, O o) { return o.links; }};
constexpr Feature moved_surfaces{
    "edits of surfaces", {"--node", "--hide", "--shadow-catcher", "--ground"}, [](S, O o) { return o.moved_surfaces; }};
constexpr Feature optics{"another projection or two eyes", {"--projection", "--stereo"}, [](S s, O o) {
                             return s.camera.optics.traced() || (o.asked && s.optics.traced());
                         }};
constexpr Feature own_checkpoint{
    "a checkpoint of a single picture", {"--checkpoint"}, [](S, O o) { return o.own_checkpoint; }};
constexpr Feature pages{"a page file", {"--pages"}, [](S, O o) { return o.pages; }};
constexpr Feature parts{"parts of the samples", {"--part", "--sample-parts"}, [](S s, O) { return s.parts > 1; }};
constexpr Feature part_of_sequence{"a part of a sequence", {"--part"}, [](S, O o) { return o.part_of_sequence; }};
constexpr Feature preview{"a preview mode", {"--preview"}, [](S s, O) { return s.preview.any(); }};
constexpr Feature projection{"a panorama or fisheye", {"--projection"}, [](S s, O o) {
                                 return s.camera.optics.projection != Projection::camera ||
                                        (o.asked && s.optics.projection != Projection::camera);
                             }};
constexpr Feature raster{
    "rasterized camera rays", {"--primary"}, [](S s, O) { return s.primary == PrimaryVisibility::raster; }, "raster"};
constexpr Feature sequence{"frames of a sequence", {"--frames"}, [](S, O o) { return o.sequence || !o.asked; }};
constexpr Feature shutter{"motion blur", {"--shutter"}, [](S, O o) { return o.shutter; }};
constexpr Feature sixteen_samples{"at least 16 samples, in each part", {"--samples"}, [](S s, O) {
                                      const int in_run = s.part > 0 ? 1 : std::max(s.parts, 1);
                                      return s.samples / in_run >= kLeastEstimatedSamples;
                                  }};
constexpr Feature stereo_views{
    "stereo views",
    {"--stereo"},
    [](S s, O o) { return s.camera.optics.stereo == Stereo::views || (o.asked && s.optics.stereo == Stereo::views); },
    "views"};
constexpr Feature temporal{
    "the preview mode temporal", {"--preview"}, [](S s, O) { return s.preview.temporal; }, "temporal"};
constexpr Feature two_samples{
    "at least two samples", {"--samples"}, [](S s, O o) { return !o.finished || s.samples >= 2; }};
constexpr Feature window{"crop or overscan", {"--crop", "--overscan"}, [](S s, O) { return has_window(s); }};
constexpr Feature overscan{"overscan", {"--overscan", "--crop"}, [](S s, O) { return has_overscan(s); }};

constexpr Constraint kConstraints[] = {
    {denoise, excludes, preview, mathematics, "the denoiser knows the noise of unbiased samples only"},
    {denoise, needs, two_samples, mathematics, "it compares two halves of the samples"},
    {denoise_error, needs, filtered, mathematics, "it is the error of the filtered picture"},
    {few_held_out, excludes, adaptive, mathematics, "the further pictures are sampled adaptively, too"},
    {error, excludes, preview, mathematics, "an error is known for the unbiased mean only"},
    {error, needs, sixteen_samples, mathematics, "8 replicates of two samples tell the error"},
    {adaptive, needs, sixteen_samples, mathematics, "pilot samples tell the noise of a block"},
    {adaptive, excludes, cache, mathematics, "its light gives way by a number of samples that all pixels share"},
    {parts, excludes, cache, mathematics, "its light depends on all samples before, whoever renders them"},
    {parts, excludes, asked_frames, not_built, "the frames around have no parts"},
    {asked_frames, needs, denoise, mathematics, "the filter takes light from the frames around"},
    {denoiser_layer, needs, denoise, mathematics, "it has the weights of the filter"},
    {window, excludes, cache, mathematics, "paths of all pixels fill its cells"},
    {window, excludes, temporal, mathematics, "light of earlier pictures comes from pixels outside, too"},
    {window, excludes, denoise_frames, not_built, "the frames around are rendered whole"},
    {window, excludes, stereo_views, not_built, "both views share their pixels"},
    {light_groups, excludes, cache, mathematics, "its cells hold the light of all lights together"},
    {temporal, needs, sequence, mathematics, "it reuses light of earlier frames"},
    {temporal, excludes, optics, not_built, "it needs the projection of the camera itself, without stereo"},
    {temporal, excludes, lens, mathematics, "blurred surfaces have no single place in the last frame"},
    {temporal, excludes, shutter, mathematics, "it has the surfaces of one time"},
    {cache, excludes, shutter, mathematics, "it has the light of one time"},
    {temporal, excludes, part_of_sequence, mathematics, "frames depend on all earlier frames"},
    {checkpoint, excludes, cache, mathematics, "its light depends on all samples before, in the same process"},
    {own_checkpoint, excludes, denoise_frames, not_built, "it holds one frame"},
    {raster, excludes, optics, mathematics, "a rasterizer projects onto the plane of one camera"},
    {raster, excludes, lens, mathematics, "a rasterizer sees from a single point"},
    {raster, excludes, overscan, not_built, "it draws the pixels of the picture"},
    {lens, excludes, projection, mathematics, "a lens has one axis, and they look around it"},
    {pages, excludes, moved_surfaces, mathematics, "its pages hold where surfaces are"},
    {pages, excludes, links, not_built, "its pages do not tell which object a triangle belongs to"},
};

/// Returns how the table of docs names a feature: its name, with the options.
std::string cell(const Feature& f) {
    std::string options;
    for (const char* option : f.options)
        if (option)
            options += fmt::format("{}`{}{}{}`", options.empty() ? "" : ", ", option, *f.value ? " " : "", f.value);
    return fmt::format("{} ({})", f.name, options);
}

}  // namespace

bool Constraint::broken_by(const RenderSettings& s, const Occasion& o) const {
    return one.on(s, o) && other.on(s, o) == (relation == excludes);
}

std::string Constraint::text(const char* option) const {
    return fmt::format("{} {} {}{}: {}", one.name, relation == needs ? "needs" : "cannot be combined with", other.name,
                       option ? fmt::format(" ({})", option) : "", reason);
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
    for (const Constraint& c : kConstraints)
        text += fmt::format("| {} | {} | {} | {} | {} |\n", cell(c.one), c.relation == needs ? "needs" : "excludes",
                            cell(c.other), c.reason, c.kind == mathematics ? "mathematics" : "not built");
    return text;
}

}  // namespace halflight
