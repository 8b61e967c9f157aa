// Tests the table of settings that cannot be combined.
#include "engine/settings/constraints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "engine/core/error.h"

namespace halflight {
namespace {

struct Broken {
    const char *one, *other;  // names of the features of the row
    void (*change)(RenderSettings& settings, Occasion& occasion);
};

const Broken kBroken[] = {
    {"denoising", "a preview mode", [](auto& s, auto&) { s.denoise = s.preview.filter = true; }},
    {"denoising", "at least two samples", [](auto& s, auto& o) { s.denoise = o.finished = true, s.samples = 1; }},
    {"an error of the denoised picture", "a denoised picture", [](auto& s, auto&) { s.denoise_error = 16; }},
    {"an error of the denoised picture from fewer than 16 samples", "adaptive sampling",
     [](auto& s, auto&) { s.denoise = s.adaptive = true, s.denoise_error = 15; }},
    {"an error target", "a preview mode", [](auto& s, auto&) { s.error = ErrorTarget{}, s.preview.cache = true; }},
    {"an error target", "at least 16 samples, in each part",
     [](auto& s, auto&) { s.error = ErrorTarget{}, s.samples = 15; }},
    {"adaptive sampling", "at least 16 samples, in each part",
     [](auto& s, auto&) { s.adaptive = true, s.samples = 47, s.parts = 3; }},
    {"adaptive sampling", "the preview mode cache", [](auto& s, auto&) { s.adaptive = s.preview.cache = true; }},
    {"parts of the samples", "the preview mode cache", [](auto& s, auto&) { s.parts = 2, s.preview.cache = true; }},
    {"parts of the samples", "denoising over frames",
     [](auto& s, auto& o) { s.parts = 2, s.denoise = o.asked = true, s.denoise_frames = 1; }},
    {"denoising over frames", "denoising", [](auto& s, auto& o) { o.asked = true, s.denoise_frames = 1; }},
    {"the layer denoiser", "denoising", [](auto& s, auto& o) { o.asked = true, s.aovs = {"denoiser"}; }},
    {"crop or overscan", "the preview mode temporal",
     [](auto& s, auto&) { s.overscan = 2, s.preview.temporal = true; }},
    {"crop or overscan", "stereo views",
     [](auto& s, auto&) { s.overscan = 2, s.camera.optics.stereo = Stereo::views; }},
    {"light groups", "the preview mode cache", [](auto& s, auto&) { s.aovs = {"light_lamp"}, s.preview.cache = true; }},
    {"the preview mode temporal", "another projection or two eyes",
     [](auto& s, auto&) { s.camera.optics.projection = Projection::fisheye, s.preview.temporal = true; }},
    {"the preview mode temporal", "depth of field",
     [](auto& s, auto&) {
         s.camera.lens = {.aperture = 30, .focus = {.kind = Focus::Kind::point}}, s.preview.temporal = true;
     }},
    {"the preview mode cache", "motion blur", [](auto& s, auto& o) { s.preview.cache = o.shutter = true; }},
    {"the preview mode temporal", "a part of a sequence",
     [](auto& s, auto& o) { s.preview.temporal = o.part_of_sequence = true; }},
    {"the preview mode temporal", "frames of a sequence",
     [](auto& s, auto& o) { s.preview.temporal = o.asked = true; }},
    {"a checkpoint", "the preview mode cache", [](auto& s, auto& o) { s.preview.cache = o.checkpoint = true; }},
    {"a checkpoint of a single picture", "denoising over frames",
     [](auto& s, auto& o) { s.denoise = o.own_checkpoint = true, s.denoise_frames = 1; }},
    {"rasterized camera rays", "depth of field",
     [](auto& s, auto& o) {
         s.primary = PrimaryVisibility::raster, o.asked = true;
         s.view.camera.lens = {.aperture = 30, .focus = {.kind = Focus::Kind::point}};
     }},
    {"depth of field", "a panorama or fisheye",
     [](auto& s, auto& o) {
         s.optics.projection = Projection::panorama, o.asked = true;
         s.view.camera.lens = {.aperture = 30, .focus = {.kind = Focus::Kind::point}};
     }},
    {"a page file", "edits of surfaces", [](auto&, auto& o) { o.pages = o.moved_surfaces = true; }},
    {"a page file", "light links", [](auto&, auto& o) { o.pages = o.links = true; }},
};

TEST(Constraints, RowsAreBrokenByTheirFeatures) {
    EXPECT_NO_THROW(check_constraints({}));
    for (const Broken& broken : kBroken) {
        RenderSettings settings;
        Occasion occasion;
        broken.change(settings, occasion);
        const Constraint* const row = broken_constraint(settings, occasion);
        ASSERT_TRUE(row) << broken.one << ", " << broken.other;
        EXPECT_EQ(row->one.name, std::string(broken.one));
        EXPECT_EQ(row->other.name, std::string(broken.other));
        EXPECT_THROW(check_constraints(settings, occasion), Error);
    }
    RenderSettings all;  // what decides about samples combines
    all.adaptive = true, all.time_limit = 1, all.error = ErrorTarget{}, all.parts = 4, all.preview = {};
    all.estimator.sampler = SamplePoints::blue_noise, all.first_sample = 8, all.denoise = true, all.overscan = 4;
    EXPECT_NO_THROW(check_constraints(all, {.shutter = true, .checkpoint = true, .finished = true}));
}

TEST(Constraints, EachPairHasOneRow) {
    std::set<std::set<const Feature*>> pairs;
    for (const Constraint& row : known_constraints()) {
        EXPECT_TRUE(pairs.insert({&row.one, &row.other}).second) << row.text();
        EXPECT_NE(row.text("--here").find("(--here)"), std::string::npos);
        for (const Feature* feature : {&row.one, &row.other}) EXPECT_TRUE(feature->options[0]) << feature->name;
    }
}

}  // namespace
}  // namespace halflight
