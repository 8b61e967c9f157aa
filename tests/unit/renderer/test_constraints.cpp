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
    {"an error of the denoised picture", "denoising", [](auto& s, auto&) { s.denoise_error = 16; }},
    {"an error of the denoised picture from fewer than 16 samples", "adaptive sampling",
     [](auto& s, auto&) { s.denoise = s.adaptive = true, s.denoise_error = 15; }},
    {"an error target", "a preview mode", [](auto& s, auto&) { s.error = ErrorTarget{}, s.preview.cache = true; }},
    {"an error target", "at least 16 samples", [](auto& s, auto&) { s.error = ErrorTarget{}, s.samples = 15; }},
    {"an error target", "the first sample of the picture",
     [](auto& s, auto&) { s.error = ErrorTarget{}, s.first_sample = 8; }},
    {"adaptive sampling", "a preview mode", [](auto& s, auto&) { s.adaptive = s.preview.filter = true; }},
    {"adaptive sampling", "a time limit", [](auto& s, auto&) { s.adaptive = true, s.time_limit = 1; }},
    {"adaptive sampling", "at least 16 samples", [](auto& s, auto&) { s.adaptive = true, s.samples = 15; }},
    {"adaptive sampling", "the first sample of the picture",
     [](auto& s, auto&) { s.adaptive = true, s.first_sample = 16; }},
    {"adaptive sampling", "the sampler sobol",
     [](auto& s, auto&) { s.adaptive = true, s.estimator.sampler = SamplePoints::blue_noise; }},
    {"parts of the samples", "an error target", [](auto& s, auto&) { s.parts = 2, s.error = ErrorTarget{}; }},
    {"parts of the samples", "denoising over frames",
     [](auto& s, auto& o) { s.parts = 2, s.denoise = o.asked = true, s.denoise_frames = 1; }},
    {"a run that renders all parts of the samples", "a checkpoint",
     [](auto& s, auto& o) { s.parts = 2, o.checkpoint = true; }},
    {"crop or overscan", "a preview mode", [](auto& s, auto&) { s.overscan = 2, s.preview.filter = true; }},
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
    {"a checkpoint", "adaptive sampling",
     [](auto& s, auto& o) { s.error = ErrorTarget{}, s.adaptive = o.checkpoint = true; }},
    {"a checkpoint of a single picture", "denoising over frames",
     [](auto& s, auto& o) { s.denoise = o.own_checkpoint = true, s.denoise_frames = 1; }},
    {"shadow catchers", "an error target", [](auto& s, auto& o) { s.error = ErrorTarget{}, o.catchers = true; }},
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
    RenderSettings timed;  // an error target beside them allows both
    timed.adaptive = true, timed.time_limit = 1, timed.error = ErrorTarget{};
    EXPECT_NO_THROW(check_constraints(timed));
    RenderSettings saved;  // no error target forbids it
    saved.adaptive = true;
    EXPECT_NO_THROW(check_constraints(saved, {.checkpoint = true}));
}

TEST(Constraints, EachPairHasOneRow) {
    std::set<std::set<const Feature*>> pairs;
    for (const Constraint& row : known_constraints()) {
        EXPECT_TRUE(pairs.insert({&row.one, &row.other}).second) << row.text();
        EXPECT_NE(row.text("--here").find("(--here)"), std::string::npos);
    }
}

}  // namespace
}  // namespace halflight
