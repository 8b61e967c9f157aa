// Tests the references of `halflight converge`: fingerprints identify them, and their files can be continued.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <stdexcept>

#include "engine/core/error.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "tests/support/environment_variable.h"
#include "tests/support/scenes.h"
#include "tools/common/temporary_folder.h"
#include "tools/measure/converge/fingerprint.h"
#include "tools/measure/converge/reference.h"

namespace halflight::converge {
namespace {

namespace fs = std::filesystem;
using halflight::test::cornell_box, halflight::test::EnvironmentVariable;

class ConvergeReference : public testing::Test {
  protected:
    /// Makes samples that all have distinct values, and records the request.
    Picture make(int half, std::int64_t first, int count) {
        requests.push_back({half, first, count});
        PictureSums sums(view.width, view.height);
        Picture picture = sums.mean();
        picture.samples = count;
        double sum = 0;
        for (std::int64_t i = first; i < first + count; ++i) sum += static_cast<double>(10 * i + half);
        for (Image& component : picture.components)
            component.pixels.assign(component.pixels.size(), static_cast<float>(sum / count));
        return picture;
    }
    Halves continue_by(std::int64_t samples_of_each, const std::function<Picture(int, std::int64_t, int)>& more) {
        requests.clear(), notes.clear();
        return continue_halves(
            file, 7, view, samples_of_each, more, {.largest = 4}, [](double) {},
            [this](const std::string& note) { notes.push_back(note); });
    }
    Halves continue_to(std::int64_t samples_of_each) {
        return continue_by(samples_of_each,
                           [this](int half, std::int64_t first, int count) { return make(half, first, count); });
    }
    static void expect_samples(const Halves& halves, std::int64_t samples) {
        for (std::size_t half = 0; half < 2; ++half) {
            EXPECT_EQ(halves[half].samples, samples);
            const auto n = static_cast<double>(samples);
            for (const auto& plane : halves[half].sums)
                for (const double sum : plane)
                    EXPECT_DOUBLE_EQ(sum, 10 * n * (n - 1) / 2 + static_cast<double>(half) * n);
        }
    }

    struct Request {
        int half;
        std::int64_t first;
        int count;
    };
    std::vector<Request> requests;
    std::vector<std::string> notes;
    TemporaryFolder folder;
    const fs::path file = reference_path(folder / "cache", 7);
    View view{3, 2, {}, 8};
};

TEST_F(ConvergeReference, FilesShowTheirDisplayWindow) {
    const ReferenceOrder order{ReferenceOrder::Maker::file, folder / "reference.exr", 0, {}};
    const auto read = [&](const ivec2& origin) {
        Image image(5, 5, 3);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i);
        ExrAttributes attributes;
        attributes.origin = origin, attributes.display = ivec2(view.width, view.height);
        write_exr(order.file, {{{"R", "G", "B"}, image}}, attributes);
        return make_reference(order, {}, view, ColorConfig::load(), {}, {}).mean.beauty;
    };
    const Image beauty = read({-1, -2});
    ASSERT_EQ(ivec2(beauty.width, beauty.height), ivec2(view.width, view.height));
    EXPECT_EQ(beauty.pixels[0], 3 * (2 * 5 + 1));
    EXPECT_THROW(read({1, 0}), Error) << "pixels are missing";
}

TEST_F(ConvergeReference, MoreSamplesContinueWhatIsKept) {
    expect_samples(continue_to(6), 6);
    EXPECT_EQ(requests.size(), 4u);  // requests for 4 and for 2 samples per half
    expect_samples(continue_to(16), 16);
    ASSERT_EQ(requests.size(), 6u);
    for (const Request& a : requests) EXPECT_GE(a.first, 6);
    expect_samples(continue_to(16), 16);
    EXPECT_TRUE(requests.empty());
    expect_samples(continue_to(3), 16);  // more samples than requested are allowed
    EXPECT_TRUE(requests.empty());
    EXPECT_TRUE(notes.empty());
}

TEST_F(ConvergeReference, InterruptedReferencesAreKept) {
    const auto fails = [this](int half, std::int64_t first, int count) {
        if (first >= 8) throw Error("test", "stop");
        return make(half, first, count);
    };
    EXPECT_THROW(continue_by(16, fails), Error);
    EXPECT_EQ(notes.size(), 1u);
    expect_samples(continue_to(16), 16);
    ASSERT_FALSE(requests.empty());
    EXPECT_EQ(requests.front().first, 8);
}

TEST_F(ConvergeReference, DamagedFilesAreReplaced) {
    continue_to(4);
    const std::string good = read_file(file, 1 << 20);
    for (const std::string& bad :
         {good.substr(0, good.size() - 1), std::string("short"), good.substr(0, 60) + "x" + good.substr(61)}) {
        write_file(file, bad);
        EXPECT_THROW(load_halves(file, 7, 3, 2), Error);
        expect_samples(continue_to(4), 4);
        ASSERT_EQ(notes.size(), 1u);
        EXPECT_NE(notes[0].find("is damaged"), std::string::npos) << notes[0];
        EXPECT_EQ(read_file(file, 1 << 20), good);
    }
    EXPECT_THROW(load_halves(file, 8, 3, 2), Error);  // the file holds another reference
    EXPECT_THROW(load_halves(file, 7, 2, 3), Error);  // the number of pixels is the same
    EXPECT_FALSE(load_halves(folder / "none", 7, 3, 2));
}

TEST_F(ConvergeReference, UnwritableFoldersAreReportedBeforehand) {
    write_file(folder / "cache", "a file where the folder would be");
    EXPECT_THROW(continue_to(4), Error);
    EXPECT_TRUE(requests.empty());
}

TEST_F(ConvergeReference, SavesThatFailLaterAreNoted) {
    const auto loses_folder = [this](int half, std::int64_t first, int count) {
        if (first >= 4) throw std::runtime_error("interrupted");
        fs::remove_all(folder / "cache");
        write_file(folder / "cache", "a file where the folder was");
        return make(half, first, count);
    };
    const auto go = [&](std::int64_t samples_of_each) {
        fs::remove_all(folder / "cache");
        return continue_by(samples_of_each, loses_folder);
    };
    expect_samples(go(4), 4);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("cache"), std::string::npos) << notes[0];
    EXPECT_THROW(go(8), std::runtime_error);
    EXPECT_EQ(notes.size(), 1u);  // no file is reported as kept
}

TEST_F(ConvergeReference, FolderFollowsTheEnvironment) {
    const EnvironmentVariable cache("XDG_CACHE_HOME", folder.path.string()), home("HOME", "/home/somebody");
    EXPECT_EQ(default_reference_folder(), folder / "halflight" / "references");
    cache.set("relative");
    EXPECT_EQ(default_reference_folder(), "/home/somebody/.cache/halflight/references");
    cache.set({}), home.set({});
    EXPECT_THROW(default_reference_folder(), Error);
}

TEST(ConvergeFingerprint, ChangesWithEveryInput) {
    const Scene scene = cornell_box();
    const std::uint64_t usual = scene_fingerprint(scene);
    EXPECT_EQ(scene_fingerprint(cornell_box()), usual);
    const auto fingerprint_with = [&](void (*change)(Scene&)) {
        Scene other = scene;
        change(other);
        return scene_fingerprint(other);
    };
    EXPECT_EQ(fingerprint_with([](Scene& s) { s.name = "another"; }), usual);
    void (*const changes[])(Scene&) = {[](Scene& s) { s.materials[0].roughness += 0.01f; },
                                       [](Scene& s) { s.materials[0].base_color_texture.uv_transform[2].x = 0.5f; },
                                       [](Scene& s) { s.meshes[0].positions[0].x += 1e-6f; },
                                       [](Scene& s) { s.meshes[0].triangle_material[0] = 1; },
                                       [](Scene& s) { s.instances[0].object_to_world[3].x += 1e-12; },
                                       [](Scene& s) { s.lights.emplace_back(); },
                                       [](Scene& s) { s.environment.color = vec3(1); },
                                       [](Scene& s) {
                                           s.images.push_back({"", 1, 1, {1, 2, 3, 4}});
                                       }};
    for (std::size_t i = 0; i < std::size(changes); ++i) EXPECT_NE(fingerprint_with(changes[i]), usual) << i;

    const View view{8, 8, scene.cameras.at(0), 3};
    const ReferenceScene oracle(scene);
    const Picture probe = oracle_samples(oracle, view, 0, 0, 1);
    const std::uint64_t reference = reference_fingerprint(usual, view, "oracle", probe);
    void (*const inputs[])(View&, Picture&, std::string&) = {
        [](View& v, Picture&, std::string&) { v.bounces = 4; },
        [](View& v, Picture&, std::string&) { v.height = 9; },
        [](View& v, Picture&, std::string&) { v.camera.vertical_fov *= 1.001; },
        [](View& v, Picture&, std::string&) { v.camera.optics.eye_distance += 1e-9; },
        [](View& v, Picture&, std::string&) { v.camera.optics.stereo = Stereo::left; },
        [](View&, Picture& p, std::string&) { p.components[3].pixels[5] += 1e-3f; },
        [](View&, Picture&, std::string& maker) { maker = "gl"; }};
    for (std::size_t i = 0; i < std::size(inputs); ++i) {
        View v = view;
        Picture p = probe;
        std::string maker = "oracle";
        EXPECT_EQ(reference_fingerprint(usual, v, maker, p), reference);
        inputs[i](v, p, maker);
        EXPECT_NE(reference_fingerprint(usual, v, maker, p), reference) << i;
    }
}

TEST(ConvergeOracle, SampleCountsAreExact) {
    const Scene scene = cornell_box();
    const View view{8, 8, scene.cameras.at(0), 2};
    const auto painter = oracle_painter(scene, view);
    const Painted painted = painter->paint({37, 0}, 5, [] {});
    EXPECT_EQ(painted.picture.samples, 37);
    EXPECT_GT(painted.time.cpu, 0);
    // Samples made in portions equal samples made in one call.
    const Picture whole = oracle_samples(ReferenceScene(scene), view, 5, 0, 37);
    for (std::size_t i = 0; i < whole.beauty.pixels.size(); ++i)
        EXPECT_NEAR(painted.picture.beauty.pixels[i], whole.beauty.pixels[i], 1e-5 * (1 + whole.beauty.pixels[i]));
    const Painted timed = painter->paint({0, 0.05}, 5, [] {});
    EXPECT_GE(timed.picture.samples, 1);
    EXPECT_GE(timed.time.wall, 0.02);
}

TEST(ConvergeMaker, ManyTrianglesUseTheEngine) {
    using enum ReferenceOrder::Maker;
    Scene scene = cornell_box();
    EXPECT_EQ(choose_maker(scene, automatic).first, oracle);
    EXPECT_EQ(choose_maker(scene, gl).first, gl);
    scene.meshes[0].triangles.resize(20'000);
    scene.instances.resize(1'001 + scene.instances.size(), scene.instances[0]);
    EXPECT_EQ(choose_maker(scene, automatic).first, gl);
    EXPECT_EQ(choose_maker(scene, oracle).first, oracle);
}

}  // namespace
}  // namespace halflight::converge
