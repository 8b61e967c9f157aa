// Tests `halflight converge` as a command: reports, kept references, errors, Ctrl-C.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "tests/support/process.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;
using Strings = std::vector<std::string>;

const std::string kCornell = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";

class Converge : public testing::Test {
  protected:
    /// Measures the Cornell box at 32 x 32 pixels by CPU time, because the machine may be shared.
    Outcome converge(const Strings& more, const RunOptions& options = {}) {
        Strings arguments = {"converge", kCornell, "-o",      out,   "--width", "32",
                             "--height", "32",     "--clock", "cpu", "--cache", folder / "cache"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments, options);
    }
    Json report() const { return Json::parse(read_text(out + "/report.json")); }
    /// Expects an exit status, one line on stderr that contains `message`, and no files.
    void expect_refusal(const Outcome& outcome, int status, const std::string& message) const {
        EXPECT_EQ(outcome.status, status) << outcome.err;
        EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
        EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(out));
    }
    Json report_of(Strings common, const Strings& more) {
        common.insert(common.end(), more.begin(), more.end());
        const Outcome outcome = converge(common);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return report();
    }

    TemporaryFolder folder;
    std::string out = folder / "out";
};

TEST_F(Converge, ClampShowsAsBias) {
    const Strings common{"--samples", "4,16", "--seeds", "4", "--method", "plain", "--reference-samples", "512"};
    const auto run = [&](const Strings& more) { return report_of(common, more); };
    const Json plain = run({}), clamped = run({"--clamp", "0.02"});
    EXPECT_TRUE(plain["biases"].empty());
    ASSERT_EQ(clamped["biases"].size(), 1u);
    EXPECT_NE(clamped["biases"][0].get<std::string>().find("clamped to a luminance of 0.02"), std::string::npos);
    EXPECT_NE(read_text(out + "/report.html").find("Biased on request"), std::string::npos);
    const Json& bias = clamped["methods"][0]["points"][1]["relative_bias"];
    EXPECT_LT(bias["value"].get<double>() + bias["half_width"].get<double>(), -0.02);
    EXPECT_EQ(clamped["reference"]["samples_found"], 512) << "a reference is never clamped";
    EXPECT_EQ(clamped["reference"]["file"], plain["reference"]["file"]);
}

TEST_F(Converge, TakesEdits) {
    const Strings common{"--spp", "1", "--seeds", "2", "--method", "plain", "--reference-samples", "8"};
    const Json plain = report_of(common, {}), red = report_of(common, {"--material", "*.base_color=#f00"});
    EXPECT_NE(plain["reference"]["file"], red["reference"]["file"]);
    EXPECT_NE(plain["runs"][0]["mse"], red["runs"][0]["mse"]);
    std::filesystem::remove_all(out);
    expect_refusal(converge({"--hide", "nobody"}), 1, "nobody");
    for (const char* change : {"--hide", "--variant", "--sky"})
        expect_refusal(converge({change, "40,135", "--external", "a=cp x {samples} {seed} {output}"}), 2,
                       "--external: cannot be given together");
}

TEST_F(Converge, SeedsAndFilterAreUsed) {
    const Strings common{"--samples", "1", "--seeds", "2", "--method", "plain", "--reference-samples", "8"};
    const auto run = [&](const Strings& more) { return report_of(common, more); };
    const Json usual = run({}), other = run({"--seed", "2"}), last = run({"--seed", "2147483647"}),
               soft = run({"--filter", "blackman-harris"});
    EXPECT_EQ(usual["runs"][0]["seed"], 1);
    EXPECT_EQ(other["plan"]["first_seed"], 2);
    EXPECT_EQ(other["runs"][0]["seed"], 2);
    EXPECT_EQ(usual["runs"][1]["mse"], other["runs"][0]["mse"]) << "the same seed makes the same picture";
    EXPECT_NE(usual["runs"][0]["mse"], other["runs"][0]["mse"]);
    EXPECT_EQ(last["runs"][0]["seed"], 2147483647);
    EXPECT_EQ(last["runs"][1]["seed"], 1) << "seeds of references are beyond";
    EXPECT_EQ(soft["filter"], (Json{{"shape", "blackman-harris"}, {"radius", 1.5}}));
    EXPECT_NE(soft["reference"]["file"], usual["reference"]["file"]);
    EXPECT_GT(usual["methods"][0]["points"][0]["blurred_mse"]["value"], 0);
    EXPECT_LT(usual["methods"][0]["points"][0]["blurred_mse"]["value"],
              usual["methods"][0]["points"][0]["mse"]["value"]);
}

TEST_F(Converge, ReportsEveryMethodAndContinuesReferences) {
    const Outcome first = converge({"--samples", "1,4,16", "--seeds", "4", "--reference-samples", "256"});
    ASSERT_EQ(first.status, 0) << first.err;
    const Json json = report();
    EXPECT_EQ(json["reference"]["maker"], "oracle");
    EXPECT_EQ(json["reference"]["samples"], 256);
    EXPECT_EQ(json["reference"]["samples_found"], 0);
    ASSERT_EQ(json["methods"].size(), 4u);
    EXPECT_EQ(json["runs"].size(), 48u);
    EXPECT_EQ(json["same_pictures"], (Json{{"compared", 24}, {"different", 0}}));
    for (const Json& method : json["methods"]) {
        SCOPED_TRACE(method["method"]);
        const double slope = method["slope"]["slope"]["value"],
                     by_samples = method["slope_by_samples"]["slope"]["value"];
        EXPECT_LT(slope, -0.4);
        EXPECT_LT(by_samples, -0.7);
        EXPECT_GT(by_samples, -1.6);
        EXPECT_EQ(method["passes"].empty(), method["method"] == "oracle");
        for (const Json& finding : method["findings"]) EXPECT_NE(finding["kind"], "bias") << finding["text"];
    }
    // The tracing method changes neither a picture nor its error.
    std::map<int, std::set<double>> of_seed;
    for (const Json& run : json["runs"])
        if (run["method"] != "oracle") of_seed[run["seed"]].insert(run["mse"].get<double>());
    EXPECT_EQ(of_seed.size(), 12u);
    for (const auto& [seed, errors] : of_seed) EXPECT_EQ(errors.size(), 1u) << seed;

    for (const char* file : {"report.html", "report.json", "report.csv"})
        EXPECT_GT(std::filesystem::file_size(out + "/" + file), 1000u) << file;
    EXPECT_TRUE(read_text(out + "/report.html").ends_with("</html>\n"));

    const Outcome second =
        converge({"--samples", "1", "--seeds", "2", "--method", "plain", "--reference-samples", "320"});
    ASSERT_EQ(second.status, 0) << second.err;
    EXPECT_EQ(report()["reference"]["samples"], 320);
    EXPECT_EQ(report()["reference"]["samples_found"], 256);
}

TEST_F(Converge, OtherRenderersAreMethods) {
    // The program stands in for another renderer: its pictures equal those of `plain`, except for the precision of
    // .exr.
    const std::string again =
        "again=sh -c '\"$@\" && echo \"{\\\"seconds\\\": 2, \\\"cpu_seconds\\\": 4}\"' sh " HALFLIGHT_PROGRAM
        " render {scene} {output} --samples {samples} --seed {seed} --width {width} --height {height}"
        " --bounces {bounces} --camera {camera} --quiet --device " +
        test_device();
    const Outcome outcome = converge(
        {"--samples", "1,2", "--seeds", "2", "--method", "plain", "--reference-samples", "64", "--external", again});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json json = report();
    EXPECT_EQ(json["plan"]["methods"], (Json{"plain", "again"}));
    EXPECT_EQ(json["plan"]["external"], again.substr(6));
    for (int budget = 0; budget < 2; ++budget) {
        const Json &plain = json["methods"][0]["points"][budget], &other = json["methods"][1]["points"][budget];
        EXPECT_NEAR(plain["mse"]["value"].get<double>(), other["mse"]["value"].get<double>(),
                    1e-6 * plain["mse"]["value"].get<double>());
        EXPECT_EQ(other["seconds"], (Json{{"wall", 2}, {"cpu", 4}}));
        EXPECT_TRUE(other["components_mse"].is_null());
    }
    EXPECT_EQ(json["methods"][1]["seconds_to_the_error_of"]["again"]["mse"], 4);
    const std::string page = read_text(out + "/report.html");
    EXPECT_NE(page.find("again is the command"), std::string::npos);
    EXPECT_NE(page.find("Time to the same error off the edges of lights"), std::string::npos);
    EXPECT_NE(page.find("Agreement of again with plain"), std::string::npos);
    ASSERT_EQ(json["agreements"].size(), 1u);
    EXPECT_EQ(json["agreements"][0]["agrees"], true);
    EXPECT_EQ(json["agreements"][0]["blocks"].size(), 4u);
    EXPECT_LT(std::abs(json["agreements"][0]["difference"].get<double>()), 1e-4);
    EXPECT_NEAR(json["methods"][1]["points"][1]["paths_per_second"]["value"].get<double>(), 32 * 32 * 2 / 4.0, 1e-6);
}

TEST_F(Converge, RefusesRenderersThatCannotRun) {
    const auto refused = [&](int status, const Strings& more, const std::string& message) {
        Strings arguments{"--samples", "1", "--seeds", "1", "--method", "plain", "--reference-samples", "2"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_refusal(converge(arguments), status, message);
    };
    refused(2, {"--external", "blender"}, "expects NAME=COMMAND, not 'blender'");
    refused(2, {"--external", "a=cp x {output} {samples}"}, "its command lacks {seed}");
    refused(2, {"--external", "plain=cp {samples} {seed} {output}"}, "'plain' is the name of another method");
    const std::string copy = "a=cp x {samples} {seed} {output}";
    refused(2, {"--external", copy, "--filter", "blackman-harris"}, "--filter");
    refused(1, {"--quiet", "--external", copy, "--env", "1,1,1"}, "a: its command lacks {environment}");
    refused(1, {"--quiet", "--external", copy, "--look-from", "0,0,1", "--look-at", "0,0,0"},
            "a: its command lacks {look-from} or {look-at}, and the camera has no name");
    refused(1, {"--quiet", "--external", "a=ls /no/such/scene {samples} {seed} {output}"},
            "a: exit status 2; it says: ls: ");
}

TEST_F(Converge, FailsWhereAgreementIsRequiredAndMissing) {
    const std::string direct = "direct='" HALFLIGHT_PROGRAM
                               "' render {scene} {output} --samples {samples} --seed {seed} "
                               "--width {width} --height {height} --camera {camera} --bounces 1 --quiet --device " +
                               test_device();
    const Strings arguments{
        "--samples",           "4",          "--seeds", "2", "--method", "plain", "--reference-samples", "16",
        "--require-agreement", "--external", direct};
    const Outcome outcome = converge(arguments);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("direct does not agree with plain: The mean differs by -"), std::string::npos)
        << outcome.err;
    EXPECT_EQ(report()["agreements"][0]["agrees"], false) << "the report is written all the same";
    EXPECT_EQ(converge({"--require-agreement", "--samples", "1"}).status, 2);
    Strings one = arguments;
    one[3] = "1";
    EXPECT_EQ(converge(one).status, 2) << "one seed tells no noise";
}

TEST_F(Converge, OtherRenderersTakeCamerasOfTheCommandLine) {
    const std::string again =
        "again=" HALFLIGHT_PROGRAM
        " render {scene} {output} --samples {samples} --seed {seed} --width {width} --height {height}"
        " --bounces {bounces} --look-from={look-from} --look-at={look-at} --vfov={vfov} --quiet"
        " --device " +
        test_device();
    const Json json = report_of({"--samples", "4", "--seeds", "1", "--method", "plain", "--reference-samples", "16",
                                 "--look-from", "0.5,1.5,3", "--look-at", "0,1,0", "--vfov", "50", "--external", again},
                                {});
    const double plain = json["methods"][0]["points"][0]["mse"]["value"],
                 other = json["methods"][1]["points"][0]["mse"]["value"];
    EXPECT_NEAR(plain, other, 1e-4 * plain);
}

TEST_F(Converge, NamesInScenesAreNeverExecuted) {
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder.path);
    const std::string text = read_text(copy_room(folder.path));
    for (const std::string name : {"x'; id > pwned; '", "$(id > pwned)", "`id > pwned`; id > pwned"}) {
        const std::string scene = name + ".gltf";
        write_text(scene, std::regex_replace(text, std::regex("\"front\""), "\"" + name + "\""));
        const Outcome outcome = run_program(
            {"converge",
             scene,
             "-o",
             out,
             "--width",
             "8",
             "--height",
             "8",
             "--cache",
             "cache",
             "--samples",
             "1",
             "--seeds",
             "1",
             "--method",
             "plain",
             "--reference-samples",
             "2",
             "--camera",
             name,
             "--external",
             "again=" HALFLIGHT_PROGRAM " render {scene} {output} --samples {samples} --seed {seed} --width {width} "
             "--height {height} --camera {camera} --quiet --device " +
                 test_device()});
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(report()["camera"], "'" + name + "' of the scene");
        EXPECT_FALSE(std::filesystem::exists("pwned")) << name;
    }
    std::filesystem::current_path(before);
}

TEST_F(Converge, BiasIsFlagged) {
    // A method that renders direct light only is biased against a reference with all light.
    const std::string direct = folder / "direct.exr";
    const Outcome rendered = run_program({"render", kCornell, direct, "--width", "32", "--height", "32", "--bounces",
                                          "1", "--samples", "256", "--quiet"});
    ASSERT_EQ(rendered.status, 0) << rendered.err;
    Strings arguments{"converge", kCornell, "-o",       out,     "--width",     "32",
                      "--height", "32",     "--clock",  "cpu",   "--samples",   "1,4,16",
                      "--seeds",  "4",      "--method", "plain", "--reference", direct};
    const Outcome biased = run_program(arguments);
    ASSERT_EQ(biased.status, 0) << biased.err;
    const Json method = report()["methods"][0];
    EXPECT_EQ(method["findings"][0]["kind"], "bias");
    EXPECT_GT(method["points"][2]["relative_bias"]["value"], 0.1);
    EXPECT_NE(biased.err.find("plain: bias"), std::string::npos) << biased.err;

    // A method that renders direct light only is unbiased against a reference with direct light only.
    arguments.insert(arguments.end(), {"--bounces", "1"});
    ASSERT_EQ(run_program(arguments).status, 0);
    EXPECT_LT(std::abs(report()["methods"][0]["points"][2]["relative_bias"]["value"].get<double>()), 0.06);
}

TEST_F(Converge, EstimatorsAreCompared) {
    const Outcome outcome =
        converge({"--samples", "4,16", "--seeds", "2", "--method", "plain,compute,oracle", "--reference-samples", "32",
                  "--estimator", "lights=power", "--estimator", "lights=tree"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json json = report();
    Strings names;
    for (const Json& method : json["methods"]) names.push_back(method["method"]);
    EXPECT_EQ(names, (Strings{"plain lights=power", "plain lights=tree", "compute lights=power", "compute lights=tree",
                              "oracle"}));
    // All tracing methods give equal pictures with equal estimators; other estimators give other pictures.
    EXPECT_EQ(json["same_pictures"], (Json{{"compared", 8}, {"different", 0}}));
    EXPECT_NE(json["methods"][0]["points"][1]["mse"], json["methods"][1]["points"][1]["mse"]);
    EXPECT_EQ(json["methods"][0]["points"][1]["mse"], json["methods"][2]["points"][1]["mse"]);
    // The reference does not depend on the estimator.
    ASSERT_EQ(converge({"--samples", "1", "--seeds", "1", "--method", "plain", "--reference-samples", "32"}).status, 0);
    EXPECT_EQ(report()["reference"]["samples_found"], 32);
}

TEST_F(Converge, ReportsThePilotsChoice) {
    const Outcome outcome = converge({"--samples", "1", "--seeds", "1", "--method", "plain", "--reference-samples",
                                      "32", "--estimator", "auto", "--estimator", "camera=2"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json pilots = report()["pilots"];
    ASSERT_EQ(pilots.size(), 1u) << "nothing was left open by the other one";
    const std::string line = pilots[0];
    EXPECT_TRUE(
        std::regex_match(line, std::regex("A pilot has chosen .*reuse=(off|[0-9]+),camera=[0-9]+,shadow=[0-9]+,.* for "
                                          ".*reuse=auto,camera=auto,.*")))
        << line;
    EXPECT_NE(outcome.err.find(line), std::string::npos) << outcome.err;
}

TEST_F(Converge, DenoisedPicturesAreCompared) {
    const Outcome outcome = converge({"--samples", "2,16", "--seeds", "4", "--method", "compute,plain",
                                      "--reference-samples", "512", "--denoise", "none", "--denoise", "on"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json json = report();
    Strings names;
    for (const Json& method : json["methods"]) names.push_back(method["method"]);
    EXPECT_EQ(names, (Strings{"compute denoise=none", "compute denoise=on", "plain denoise=none", "plain denoise=on"}));
    EXPECT_EQ(json["biases"], (Json{"compute denoise=on is denoised.", "plain denoise=on is denoised."}));
    EXPECT_EQ(json["same_pictures"], (Json{{"compared", 16}, {"different", 0}}));
    const auto point = [&](int method, const char* figure) {
        return json["methods"][method]["points"][1][figure]["value"].get<double>();
    };
    EXPECT_LT(point(1, "relative_mse"), point(0, "relative_mse"));
    EXPECT_NE(point(1, "variance"), point(0, "variance"));
    EXPECT_NE(point(1, "bias_squared"), point(0, "bias_squared"));
    EXPECT_EQ(point(1, "bias_squared"), point(3, "bias_squared"));

    for (const auto& [options, message] :
         {std::pair{Strings{"--samples", "1,2"}, "needs at least two --samples"},
          std::pair{Strings{"--preview", "filter"}, "--preview"}, std::pair{Strings{"--seconds", "1"}, "--seconds"}}) {
        Strings all = options;
        all.insert(all.end(), {"--denoise", "on"});
        const Outcome refused = converge(all);
        EXPECT_NE(refused.status, 0);
        EXPECT_NE(refused.err.find(message), std::string::npos) << refused.err;
    }
}

TEST_F(Converge, PreviewsAreCompared) {
    const auto compared = [&](const Strings& more) {
        Strings options{"--samples",           "2,64", "--seeds",   "2",    "--method",  "plain,oracle",
                        "--reference-samples", "32",   "--preview", "none", "--preview", "cache"};
        options.insert(options.end(), more.begin(), more.end());
        const Outcome outcome = converge(options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return report();
    };
    const Json cold = compared({});
    Strings names;
    for (const Json& method : cold["methods"]) names.push_back(method["method"]);
    EXPECT_EQ(names, (Strings{"plain preview=none", "plain preview=cache", "oracle"}));
    EXPECT_EQ(cold["biases"], Json{"plain preview=cache is a preview."});
    EXPECT_EQ(cold["same_pictures"]["compared"], 0);
    const Json warm = compared({"--warm-up", "8"});
    const auto mse = [](const Json& json, int method, int budget) {
        return json["methods"][method]["points"][budget]["mse"];
    };
    EXPECT_EQ(mse(warm, 0, 0), mse(cold, 0, 0));
    EXPECT_NE(mse(warm, 1, 0), mse(cold, 1, 0));
    EXPECT_EQ(mse(warm, 1, 1), mse(cold, 1, 1)) << "both have been handed over";
}

TEST_F(Converge, BudgetsOfSeconds) {
    const Outcome outcome = converge({"--seconds", "0.05,0.4", "--seeds", "2", "--method", "plain,oracle",
                                      "--reference", "gl", "--reference-samples", "64"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json json = report();
    EXPECT_EQ(json["reference"]["maker"], "gl");
    for (const Json& method : json["methods"]) {
        EXPECT_GT(method["points"][1]["samples"], method["points"][0]["samples"]) << method["method"];
        EXPECT_EQ(method["points"][1]["budget"]["seconds"], 0.4);
    }
}

TEST_F(Converge, RefusesInvalidOptions) {
    const Strings quick{"--samples", "1", "--seeds", "1", "--reference-samples", "2"};
    const auto refused = [&](const Strings& more, const std::string& message, int status = 2) {
        Strings arguments = more;
        for (std::size_t i = 0; i < quick.size(); i += 2)
            if (std::ranges::find(more, quick[i]) == more.end())
                arguments.insert(arguments.end(), {quick[i], quick[i + 1]});
        expect_refusal(converge(arguments), status, message);
    };
    refused({"--method", "plain,fast"}, "--method: expects some of compute, raster, plain, native, oracle, not 'fast'");
    refused({"--method", "plain,plain"}, "--method: 'plain' is given twice");
    refused({"--estimator", "lights=tree", "--estimator", "lights=tree"}, "--estimator: 'lights=tree' is given twice");
    refused({"--estimator", "lights=sun"}, "--estimator: lights=sun: there is no lights=sun");
    refused({"--preview", "temporal,filter"},
            "--preview: temporal reuses light of earlier pictures, and converge renders single pictures");
    refused({"--warm-up", "8"}, "--warm-up: needs a --preview with cache");
    refused({"--warm-up", "8", "--preview", "filter"}, "--warm-up: needs a --preview with cache");
    refused({"--samples", "1,4,4"}, "--samples: expects growing budgets, not '1,4,4'");
    refused({"--samples", "1,,4"}, "--samples: expects a whole number from 1 to");
    refused({"--seconds", "1"}, "--samples: cannot be given together with --seconds");
    refused({"--seeds", "0"}, "--seeds: expects a whole number from 1 to");
    refused({"--camera", "nobody"}, "no camera 'nobody'", 1);
    expect_refusal(run_program({"converge", folder / "missing.glb", "-o", out}), 1, "missing.glb");
    expect_refusal(run_program({"converge", kCornell, "-o", out, "--clock", "sun"}), 2,
                   "--clock: expects wall or cpu, not 'sun'");
    expect_refusal(run_program({"converge", kCornell}), 2, "--output: is missing");
    EXPECT_EQ(run_program({"converge", kCornell, "-o", "/proc/none/reports"}).status, 1);
    write_text(folder / "cache", "");
    refused({}, "cache: cannot be made", 1);
    std::filesystem::remove(folder / "cache");

    write_text(folder / "file", "");
    const Outcome file = run_program({"converge", kCornell, "-o", folder / "file"});
    EXPECT_EQ(file.status, 1) << file.err;
    EXPECT_EQ(read_text(folder / "file"), "");
}

TEST_F(Converge, ReferencesOfOtherSizesAreRefused) {
    const std::string other = folder / "other.exr";
    ASSERT_EQ(
        run_program({"render", kCornell, other, "--width", "8", "--height", "8", "--samples", "1", "--quiet"}).status,
        0);
    expect_refusal(
        run_program({"converge", kCornell, "-o", out, "--width", "32", "--height", "32", "--reference", other}), 1,
        "the reference has 8 x 8 pixels, the pictures are to have 32 x 32");
    expect_refusal(run_program({"converge", kCornell, "-o", out, "--reference", folder / "none.exr"}), 1, "none.exr");
}

TEST_F(Converge, CreatesFoldersAndRemovesThem) {
    const std::string parent = out;
    out += "/of/reports";
    EXPECT_EQ(converge({"--camera", "nobody"}).status, 1);
    EXPECT_FALSE(std::filesystem::exists(parent));
    const Outcome outcome =
        converge({"--samples", "1", "--seeds", "1", "--method", "plain", "--reference-samples", "2"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("plain: slope none"), std::string::npos) << outcome.err;
    EXPECT_EQ(report()["runs"].size(), 1u);
}

TEST_F(Converge, InterruptedWritesNothingButKeepsTheReference) {
    bool sent = false;
    const auto interrupt = [&](pid_t child, const std::string& err) {
        if (!sent && err.find("pictures: 10 %") != std::string::npos) sent = kill(child, SIGINT) == 0;
    };
    const Strings arguments{"--samples", "128", "--seeds", "16", "--method", "plain", "--reference-samples", "64"};
    const Outcome outcome = converge(arguments, {.watch = interrupt});
    EXPECT_TRUE(sent);
    EXPECT_EQ(outcome.status, 128 + SIGINT) << outcome.err;
    EXPECT_NE(outcome.err.find("nothing was written"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(out));
    ASSERT_EQ(converge({"--samples", "1", "--seeds", "1", "--method", "plain", "--reference-samples", "64"}).status, 0);
    EXPECT_EQ(report()["reference"]["samples_found"], 64);
}

}  // namespace
}  // namespace halflight::test
