// Tests that pictures which go on from a checkpoint have the bits of pictures that were never stopped. Parts of the
// samples, rendered apart and merged, must make the picture of one renderer.
#include <gtest/gtest.h>

#include <chrono>
#include <list>
#include <memory>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/core/interruption.h"
#include "renderer/checkpoint.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"
#include "tests/support/process.h"

namespace halflight::test {
namespace {

/// Saves a band of 16 rows without arrays.
void save(Checkpoint& to, int y, bool complete = true) {
    to.save({.y = y, .rows = 16, .samples = complete ? 4 : 1, .complete = complete, .bad_values = {}}, 0, {});
}

class CheckpointTest : public GpuTest {
  protected:
    CheckpointTest() {
        scene.light_groups = {"lamp", "rest"};
        for (Material& m : scene.materials)
            if (m.emission != vec3(0)) m.light_group = 0;
        prepared.emplace(context, scene);
    }
    /// Returns settings of 45 x 60 pixels in four bands, 7 samples, with layers of light groups.
    RenderSettings settings(bool denoise = false) const {
        RenderSettings s = all_settings(scene, 45, 60, 7);
        s.aovs.insert(s.aovs.end(), {"light_lamp", "light_rest"});
        s.band_pixels = 48 * 16;
        s.denoise = denoise;
        if (denoise) s.aovs.emplace_back("noisy");
        return s;
    }
    /// Renders with a checkpoint, and stops after `calls` calls of the callback; 0: does not stop.
    RenderResult render(const RenderSettings& s, int calls = 0) { return render(s, s, path(), calls); }
    RenderResult render(const RenderSettings& s, const FrameSettings& frame, const std::filesystem::path& at,
                        int calls) {
        Checkpoint checkpoint(at, "cornell", 1e9);
        int count = 0;
        RenderResult result =
            Renderer(*prepared, colors, s).render(frame, {.checkpoint = &checkpoint}, [&](const RenderProgress&) {
                return ++count != calls;
            });
        EXPECT_EQ(checkpoint.problem(), "");
        return result;
    }
    RenderResult whole(const RenderSettings& s) { return Renderer(*prepared, colors, s).render(); }
    std::filesystem::path path() const { return folder / "a.checkpoint"; }
    std::filesystem::path band(const char* rows) const { return path() / fmt::format("rows-{}.sums", rows); }
    /// Expects an error about the file or folder `at`, in one line.
    template <class F>
    static void expect_refusal(const std::filesystem::path& at, const F& f) {
        const std::string message = error_message(f);
        EXPECT_TRUE(message.starts_with(at.string() + ": ")) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }

    TemporaryFolder folder;
    Scene scene = shiny_cornell();
    std::optional<PreparedScene> prepared;
    ColorConfig colors = ColorConfig::load();
};

TEST_F(CheckpointTest, StoppedPicturesGoOnToTheSameBits) {
    for (const bool denoise : {false, true}) {
        const RenderSettings s = settings(denoise);
        const RenderResult expected = whole(s);
        // Stops are in the first band, at the end of a band, and in the last band.
        for (const int calls : {3, 11, 2}) {
            const RenderResult part = render(s, calls);
            EXPECT_TRUE(part.stats.interrupted);
            EXPECT_FALSE(same_bits(part.beauty, expected.beauty));
        }
        EXPECT_TRUE(std::filesystem::exists(band("00032"))) << "16 of 28 samples were rendered";
        const RenderResult result = render(s);
        expect_same(result, expected);
        EXPECT_EQ(result.stats.samples, 7);
        // All bands are complete now: nothing is rendered.
        expect_same(render(s, 1), expected);
        Checkpoint(path(), "cornell", 1).remove();
        EXPECT_FALSE(std::filesystem::exists(path()));
    }
}

/// A plan of samples: settings that decide who takes how many.
struct Plan {
    const char* name;
    bool adaptive = false;
    double error = 0;
    double time = 0;
    int parts = 1;
    int samples = 64;
    void set(RenderSettings& s) const {
        s.adaptive = adaptive, s.time_limit = time, s.parts = parts, s.samples = samples;
        if (error > 0) s.error = ErrorTarget{ErrorMetric::relmse, error};
    }
};
constexpr double kNoLimit = 1e6;  // seconds, so that time decides nothing

// Stops are in a pilot, in a replicate, among the samples of all pixels, among those of listed blocks, and in any part.
TEST_F(CheckpointTest, StoppedPlansGoOnToTheSameBits) {
    for (const Plan& plan :
         {Plan{"error", false, 0.1, 0, 1, 256}, Plan{"adaptive", true, 0, 0, 1, 24},
          Plan{"adaptive error", true, 0.15, 0, 1, 160}, Plan{"adaptive time", true, 0, kNoLimit, 1, 24},
          Plan{"parts", false, 0, 0, 3, 20}, Plan{"adaptive parts", true, 0, 0, 2, 33},
          Plan{"parts to an error", true, 0.15, 0, 2, 256}}) {
        RenderSettings s = settings(true);
        plan.set(s);
        const RenderResult expected = whole(s);
        for (const int calls : {3, 21, 9, 12, 27}) {
            SCOPED_TRACE(fmt::format("{}, {} calls", plan.name, calls));
            EXPECT_TRUE(render(s, calls).stats.interrupted);
        }
        SCOPED_TRACE(plan.name);
        const RenderResult result = render(s);
        expect_same(result, expected);
        EXPECT_EQ(result.stats.samples, expected.stats.samples);
        if (s.error) {
            EXPECT_EQ(result.stats.error->estimate.bound, expected.stats.error->estimate.bound);
        }
        expect_same(render(s, 1), expected);
        Checkpoint(path(), "cornell", 1).remove();
    }
}

// A run that is killed while it saves the bands leaves some of them at an earlier place of the plan.
TEST_F(CheckpointTest, BandsThatAreBehindCatchUp) {
    RenderSettings s = settings();
    s.samples = 160, s.adaptive = true, s.error = ErrorTarget{ErrorMetric::relmse, 0.005};
    const RenderResult expected = whole(s);
    EXPECT_TRUE(render(s, 16 + 20).stats.interrupted);  // the pilot of four bands, then the first look
    const std::string early = read_text(band("00016"));
    EXPECT_TRUE(render(s, 100).stats.interrupted);
    EXPECT_NE(read_text(band("00016")), early);
    write_text(band("00016"), early);
    expect_same(render(s), expected);
}

// The time that is left belongs to the next run.
TEST_F(CheckpointTest, PicturesWithATimeLimitGoOn) {
    RenderSettings s = settings();
    s.time_limit = 1000;
    const RenderResult expected = whole(s);
    for (const int calls : {3, 6}) EXPECT_TRUE(render(s, calls).stats.interrupted);
    const RenderResult result = render(s);
    expect_same(result, expected);
    EXPECT_EQ(result.stats.samples, 7);
}

/// The hash of a file tells of damage, and not of a head that another program has written.
TEST_F(CheckpointTest, HeadsWithImpossibleNumbersAreRefused) {
    save(*std::make_unique<Checkpoint>(path(), "cornell", 1), 0);
    const std::string text = read_text(band("00000"));
    for (const auto& [from, to] : {std::pair("\"samples\":4", "\"samples\":-4"),
                                   {"\"samples\":4", "\"samples\":0"},
                                   {"\"samples\":4", "\"samples\":1e9"},
                                   {"\"first_half\":0", "\"first_half\":5"},
                                   {"\"first_half\":0", "\"first_half\":-1"},
                                   {"\"rows\":16", "\"rows\":0"},
                                   {"\"rows\":16", "\"rows\":4294967312"},
                                   {"\"y\":0", "\"y\":1e300"},
                                   {"\"y\":0", "\"y\":2147483647"},
                                   {"\"bad_values\":[]", "\"bad_values\":[-1]"}}) {
        std::string forged = text.substr(0, text.size() - sizeof(std::uint64_t));
        ASSERT_NE(forged.find(from), std::string::npos) << from;
        forged.replace(forged.find(from), std::string_view(from).size(), to);
        const std::uint64_t hash = hash_of(forged);
        write_text(band("00000"), forged + std::string(reinterpret_cast<const char*>(&hash), sizeof hash));
        SCOPED_TRACE(to);
        expect_refusal(band("00000"), [&] { Checkpoint(path(), "cornell", 1); });
    }
}

// Whichever batch of rays of the sixth sample ends the work, nothing of this sample is in the sums.
TEST_F(CheckpointTest, InterruptedSamplesKeepTheEarlierOnes) {
    struct Stop {};
    RenderSettings s = settings();
    s.band_pixels = 48 * 64;  // one band
    Scene caught = scene;     // the rays of shadow catchers are the last ones of a sample
    caught.instances[0].catcher = true;
    PunctualLight& sun = caught.lights.emplace_back();
    sun.type = LightType::directional;
    sun.direction = {0, -0.8, -0.6};
    sun.intensity = vec3(2);
    for (const Scene* of : {&scene, &caught}) {
        PreparedScene own_scene(context, *of);
        const RenderResult expected = Renderer(own_scene, colors, s).render();
        int last = 1;
        for (bool stopped = true; stopped; last += 2) {
            SCOPED_TRACE(fmt::format("{}, point {}", of == &caught ? "catcher" : "no catcher", last));
            int samples = 0, points = 0;
            {
                Checkpoint checkpoint(path(), "cornell", 1e9);
                const Interruptible stops([&] {
                    if (samples == 5 && ++points == last) throw Stop();
                });
                Renderer renderer(own_scene, colors, s);
                stopped = false;
                try {
                    renderer.render(s, {.checkpoint = &checkpoint},
                                    [&](const RenderProgress&) { return ++samples < 6; });
                } catch (const Stop&) {
                    stopped = true;
                }
            }
            Checkpoint checkpoint(path(), "cornell", 1e9);
            EXPECT_EQ(checkpoint.earlier_samples(60), stopped ? 5 : 6);
            expect_same(Renderer(own_scene, colors, s).render(s, {.checkpoint = &checkpoint}), expected);
            checkpoint.remove();
        }
        EXPECT_GT(last, 12) << "a sample has a batch for each length of paths, and shadow rays";
    }
}

TEST_F(CheckpointTest, LostBandsAreReportedUntilTheyAreSaved) {
    Checkpoint checkpoint(path(), "cornell", 1);
    std::filesystem::create_directories(band("00000") / "obstacle");
    save(checkpoint, 0);
    save(checkpoint, 16);
    EXPECT_NE(checkpoint.problem().find("rows-00000.sums"), std::string::npos) << checkpoint.problem();
    EXPECT_FALSE(checkpoint.complete(32));
    std::filesystem::remove_all(band("00000"));
    save(checkpoint, 0, false);
    EXPECT_EQ(checkpoint.problem(), "");
    EXPECT_FALSE(checkpoint.complete(32)) << "a band lacks samples";
    save(checkpoint, 0);
    EXPECT_TRUE(checkpoint.complete(32));
    EXPECT_TRUE(checkpoint.complete(20)) << "the last band may reach beyond the picture";
    EXPECT_FALSE(checkpoint.complete(33)) << "the last band is missing";
}

TEST_F(CheckpointTest, FoldersThatWereRemovedDuringTheWaitAreMadeAgain) {
    std::string error;
    auto first = std::make_unique<Checkpoint>(path(), "cornell", 1);
    std::thread other([&] {
        error = error_message([&] {
            Checkpoint second(path(), "cornell", 1);
            save(second, 0);
            EXPECT_EQ(second.problem(), "");
        });
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(120));  // `other` waits for the lock
    first.reset();                                                // removes the empty folder
    other.join();
    EXPECT_EQ(error, "");
    EXPECT_TRUE(std::filesystem::exists(band("00000")));
}

TEST_F(CheckpointTest, FoldersThatWereRemovedMeanwhileNeedNoRemoval) {
    {
        Checkpoint checkpoint(path(), "cornell", 1);
        save(checkpoint, 0);
        std::filesystem::remove_all(path());
        expect_refusal(path(), [&] { checkpoint.complete(16); });
        checkpoint.remove();
    }
    {
        Checkpoint checkpoint(path(), "cornell", 1);
        std::filesystem::remove_all(path());
        Checkpoint other(path(), "cornell", 1);
        save(other, 0);
        checkpoint.remove();
        EXPECT_TRUE(other.complete(16));
    }
}

TEST_F(CheckpointTest, CountsSamplesAndTimeOfEarlierRuns) {
    render(settings(), 10);  // 7 samples of 16 rows, then 3
    double seconds = 0;
    {
        Checkpoint checkpoint(path(), "cornell", 1);
        EXPECT_DOUBLE_EQ(checkpoint.earlier_samples(60), (7 * 16 + 3 * 16) / 60.0);
        EXPECT_GT(seconds = checkpoint.earlier_seconds(), 0);
        save(checkpoint, 0);
        expect_refusal(path(), [&] { Checkpoint second(path(), "cornell", 1); });  // stands for another process
    }
    EXPECT_GT(Checkpoint(path(), "cornell", 1).earlier_seconds(), seconds) << "the time of all runs";
}

TEST_F(CheckpointTest, OtherPicturesAreRefused) {
    render(settings(), 10);
    expect_refusal(path(), [&] { Checkpoint other(path(), "room", 1); });
    RenderSettings wide = settings();
    wide.band_pixels = 48 * 32;
    expect_refusal(path(), [&] { render(wide); });
    RenderSettings to_error = settings();
    to_error.preview.cache = true;
    const std::string refusal = error_message([&] { render(to_error); });
    EXPECT_NE(refusal.find("cannot be combined"), std::string::npos) << refusal;
    { Checkpoint fresh(path(), "room", 1, Checkpoint::Use::anew); }
    EXPECT_FALSE(std::filesystem::exists(path())) << "an empty folder stays";
}

TEST_F(CheckpointTest, DamagedFilesAreRefused) {
    render(settings(), 5);
    const std::string good = read_text(band("00000"));
    const auto expect_damage = [&](const std::string& bytes) {
        write_text(band("00000"), bytes);
        expect_refusal(band("00000"), [&] { render(settings()); });
    };
    for (const std::size_t size : {std::size_t{0}, std::size_t{10}, std::size_t{100}, good.size() / 2, good.size() - 1})
        expect_damage(good.substr(0, size));
    expect_damage(good + "x");
    for (const std::size_t at : {std::size_t{5}, std::size_t{40}, good.size() / 2, good.size() - 1}) {
        std::string bad = good;
        bad[at] = static_cast<char>(bad[at] ^ 1);
        expect_damage(bad);
    }
    write_text(band("00000"), good);
    const std::filesystem::path unfinished = path() / ".halflight-0123456789abcdef-1-2-34567890.sums";
    write_text(unfinished, "");
    expect_same(render(settings()), whole(settings()));
    EXPECT_FALSE(std::filesystem::exists(unfinished)) << "a killed process has left it";
}

class SampleParts : public CheckpointTest {
  protected:
    RenderSettings in_parts(bool denoise) const {
        RenderSettings s = settings(denoise);
        s.samples = 11, s.parts = 4;  // parts of 2, 3, 3 and 3 samples
        s.band_pixels = 48 * 32;
        return s;
    }
    std::filesystem::path folder_of(int part) const { return folder / fmt::format("{}", part); }
    /// Renders a part with a renderer of its own, and stops after `calls` calls of the callback; 0: does not stop.
    void render_part(const RenderSettings& s, int part, int calls = 0) {
        render(s, settings_of_part(s, part, s.adaptive), folder_of(part), calls);
    }
    RenderResult merged(const RenderSettings& s) {
        std::list<Checkpoint> parts;
        std::vector<const Checkpoint*> all;
        for (int part = 1; part <= s.parts; ++part)
            all.push_back(&parts.emplace_back(folder_of(part), "cornell", 1e9, Checkpoint::Use::merge));
        return Renderer(*prepared, colors, s).render(s, {.merged = all});
    }
};

TEST_F(SampleParts, MergedPartsAreThePictureOfOneRenderer) {
    for (const bool denoise : {false, true}) {
        const RenderSettings s = in_parts(denoise);
        const RenderResult expected = whole(s);
        EXPECT_EQ(expected.stats.samples, 11);
        render_part(s, 3, 4);  // stops within the second band, and goes on later
        for (const int part : {4, 2, 3, 1}) render_part(s, part);
        const RenderResult result = merged(s);
        expect_same(result, expected);
        EXPECT_EQ(result.stats.samples, 11);
        for (int part = 1; part <= 4; ++part) Checkpoint(folder_of(part), "cornell", 1).remove();
    }
}

// The noise of its own pilot and replicates decides about the samples of a part.
TEST_F(SampleParts, PartsOfPlansAreMergedToTheSameBits) {
    for (const Plan& plan : {Plan{"time", false, 0, kNoLimit, 2, 6}, Plan{"error", false, 0.1, 0, 2, 256},
                             Plan{"adaptive", true, 0, 0, 3, 50}, Plan{"adaptive error", true, 0.15, 0, 2, 256},
                             Plan{"adaptive time", true, 0, kNoLimit, 2, 32}}) {
        SCOPED_TRACE(plan.name);
        RenderSettings s = settings(true);
        plan.set(s);
        const RenderResult expected = whole(s);
        render_part(s, 2, 20);
        for (int part = plan.parts; part > 0; --part) render_part(s, part);
        const RenderResult result = merged(s);
        expect_same(result, expected);
        EXPECT_EQ(result.stats.samples, expected.stats.samples);
        if (s.error) {
            EXPECT_EQ(result.stats.error->estimate.value, expected.stats.error->estimate.value);
            EXPECT_LT(result.stats.error->estimate.value, plan.error);
        }
        for (int part = 1; part <= plan.parts; ++part) Checkpoint(folder_of(part), "cornell", 1).remove();
    }
}

TEST_F(SampleParts, SumsOfPartsDifferFromASingleSumByRoundingAlone) {
    RenderSettings s = in_parts(false);
    const RenderResult parts = whole(s);
    s.parts = 1;
    const RenderResult one = whole(s);
    for (std::size_t i = 0; i < one.beauty.pixels.size(); ++i)
        EXPECT_NEAR(parts.beauty.pixels[i], one.beauty.pixels[i], 1e-7 * one.beauty.pixels[i]);
}

TEST_F(SampleParts, IncompletePartsAreRefused) {
    const RenderSettings s = in_parts(false);
    for (const int part : {1, 2, 4}) render_part(s, part);
    render_part(s, 3, 4);
    expect_refusal(folder_of(3), [&] { merged(s); });
    RenderSettings many = s;
    many.parts = 12;
    EXPECT_THROW(whole(many), Error) << "more parts than samples";
}

TEST_F(SampleParts, RangesCoverAllSamplesOnce) {
    FrameSettings s;
    for (const int samples : {1, 7, 64, 1000003}) {
        for (const int parts : {1, 3, 64}) {
            s.samples = samples, s.parts = parts;
            int next = 0;
            for (int part = 1; part <= parts; ++part) {
                const FrameSettings own = settings_of_part(s, part, false);
                EXPECT_EQ(own.first_sample, next);
                EXPECT_EQ(own.of_samples, samples);
                EXPECT_GE(own.samples, samples / parts);
                next += own.samples;
            }
            EXPECT_EQ(next, samples);
        }
    }
}

}  // namespace
}  // namespace halflight::test
