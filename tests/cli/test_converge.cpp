// Tests `halflight converge` as a command: reports, kept references, errors, Ctrl-C.
#include <fmt/format.h>
#include <signal.h>

#include <cmath>
#include <map>
#include <regex>
#include <set>

#include "tests/cli/command_test.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

const std::string kCornell = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";
// The least that a report needs.
const char* const kQuick = "--samples 1 --seeds 1 --method plain --reference-samples 2";

class Converge : public CommandTest {
  protected:
    /// Returns the command that measures the Cornell box at 32 x 32 pixels by CPU time, because the machine may be
    /// shared.
    template <class... Parts>
    Strings command(const Parts&... more) const {
        return words("converge", kCornell, "-o", out, "--width 32 --height 32 --clock cpu --cache", file("cache"),
                     more...);
    }
    template <class... Parts>
    Json report_of(const Parts&... more) const {
        done(command(more...));
        return report();
    }
    Json report() const { return json_file(out + "/report.json"); }
    static Strings methods(const Json& report) {
        Strings names;
        for (const Json& method : report["methods"]) names.push_back(method["method"]);
        return names;
    }
    /// Returns a figure of a method after a budget.
    static double figure(const Json& report, int method, int budget, const char* name) {
        return report["methods"][method]["points"][budget][name]["value"];
    }
    /// Returns an external renderer that is the program itself, with the given options.
    static std::string renderer(const std::string& name, const std::string& options) {
        return name +
               "=" HALFLIGHT_PROGRAM " render {scene} {output} --samples {samples} --seed {seed} --width {width}" +
               " --height {height} --quiet --device " + test_device() + " " + options;
    }

    std::string out = file("out");
};

TEST_F(Converge, ClampShowsAsBias) {
    const Strings common = words("--samples 4,16 --seeds 4 --method plain --reference-samples 512");
    const Json plain = report_of(common), clamped = report_of(common, "--clamp 0.02");
    EXPECT_TRUE(plain["biases"].empty());
    ASSERT_EQ(clamped["biases"].size(), 1u);
    expect_has(clamped["biases"][0], "luminance of 0.02");
    const Json& bias = clamped["methods"][0]["points"][1]["relative_bias"];
    EXPECT_LT(bias["value"].get<double>() + bias["half_width"].get<double>(), -0.02);
    EXPECT_EQ(clamped["reference"]["samples_found"], 512) << "a reference is never clamped";
    EXPECT_EQ(clamped["reference"]["file"], plain["reference"]["file"]);
}

TEST_F(Converge, TakesEdits) {
    const Strings common = words("--spp 1 --seeds 2 --method plain --reference-samples 8");
    const Json plain = report_of(common), red = report_of(common, "--material *.base_color=#f00");
    EXPECT_NE(plain["reference"]["file"], red["reference"]["file"]);
    EXPECT_NE(plain["runs"][0]["mse"], red["runs"][0]["mse"]);
}

TEST_F(Converge, SeedsAndFilterAreUsed) {
    const Strings common = words("--samples 1 --seeds 2 --method plain --reference-samples 8");
    const Json usual = report_of(common), other = report_of(common, "--seed 2"),
               last = report_of(common, "--seed 2147483647"), soft = report_of(common, "--filter blackman-harris");
    EXPECT_EQ(usual["runs"][0]["seed"], 1);
    EXPECT_EQ(other["plan"]["first_seed"], 2);
    EXPECT_EQ(other["runs"][0]["seed"], 2);
    EXPECT_EQ(usual["runs"][1]["mse"], other["runs"][0]["mse"]) << "the same seed makes the same picture";
    EXPECT_NE(usual["runs"][0]["mse"], other["runs"][0]["mse"]);
    EXPECT_EQ(last["runs"][0]["seed"], 2147483647);
    EXPECT_EQ(last["runs"][1]["seed"], 1) << "seeds of references are beyond";
    EXPECT_EQ(soft["filter"], (Json{{"shape", "blackman-harris"}, {"radius", 1.5}}));
    EXPECT_NE(soft["reference"]["file"], usual["reference"]["file"]);
    EXPECT_GT(figure(usual, 0, 0, "blurred_mse"), 0);
    EXPECT_LT(figure(usual, 0, 0, "blurred_mse"), figure(usual, 0, 0, "mse"));
}

TEST_F(Converge, ReportsEveryMethodAndContinuesReferences) {
    const Json json = report_of("--samples 1,4,16 --seeds 4 --reference-samples 256");
    EXPECT_EQ(json["reference"]["maker"], "oracle");
    EXPECT_EQ(json["reference"]["samples"], 256);
    EXPECT_EQ(json["reference"]["samples_found"], 0);
    ASSERT_EQ(json["methods"].size(), 4u);
    EXPECT_EQ(json["runs"].size(), 48u);
    EXPECT_EQ(json["same_pictures"], (Json{{"compared", 24}, {"different", 0}}));
    for (const Json& method : json["methods"]) {
        SCOPED_TRACE(method["method"]);
        const double by_samples = method["slope_by_samples"]["slope"]["value"];
        EXPECT_LT(method["slope"]["slope"]["value"], -0.4);
        EXPECT_LT(by_samples, -0.7);
        EXPECT_GT(by_samples, -1.6);
        EXPECT_EQ(method["passes"].empty(), method["method"] == "Halflight (oracle)");
        for (const Json& finding : method["findings"]) EXPECT_NE(finding["kind"], "bias") << finding["text"];
    }
    // The tracing method changes neither a picture nor its error.
    std::map<int, std::set<double>> of_seed;
    for (const Json& run : json["runs"])
        if (run["method"] != "Halflight (oracle)") of_seed[run["seed"]].insert(run["mse"].get<double>());
    EXPECT_EQ(of_seed.size(), 12u);
    for (const auto& [seed, errors] : of_seed) EXPECT_EQ(errors.size(), 1u) << seed;
    for (const char* file : {"report.html", "report.json", "report.csv"})
        EXPECT_GT(std::filesystem::file_size(out + "/" + file), 1000u) << file;

    const Json second = report_of("--samples 1 --seeds 2 --method plain --reference-samples 320");
    EXPECT_EQ(second["reference"]["samples"], 320);
    EXPECT_EQ(second["reference"]["samples_found"], 256);
}

/// The program stands in for another renderer: its pictures equal those of `plain`, except for the precision of .exr.
TEST_F(Converge, OtherRenderersAreMethods) {
    const std::string again = "again=sh -c '\"$@\" && echo \"{\\\"seconds\\\": 2, \\\"cpu_seconds\\\": 4}\"' sh " +
                              renderer("", "--bounces {bounces} --camera {camera}").substr(1);
    const Json json = report_of("--samples 1,2 --seeds 2 --method plain --reference-samples 64 --external", again);
    EXPECT_EQ(methods(json), (Strings{"Halflight (plain)", "again"}));
    EXPECT_EQ(json["plan"]["external"], again.substr(6));
    for (int budget = 0; budget < 2; ++budget) {
        const double plain = figure(json, 0, budget, "mse");
        EXPECT_NEAR(figure(json, 1, budget, "mse"), plain, 1e-6 * plain);
        const Json& other = json["methods"][1]["points"][budget];
        EXPECT_EQ(other["seconds"], (Json{{"wall", 2}, {"cpu", 4}}));
        EXPECT_TRUE(other["components_mse"].is_null());
    }
    EXPECT_EQ(json["methods"][1]["seconds_to_the_error_of"]["again"]["mse"], 4);
    expect_has(read_text(out + "/report.html"), "Agreement of again with Halflight (plain)");
    expect_has(read_text(out + "/report.csv"), "\r\nHalflight (plain),");
    ASSERT_EQ(json["agreements"].size(), 1u);
    const Json& agreement = json["agreements"][0];
    EXPECT_EQ(agreement["verdict"], "undecided") << "two pictures of two samples are too noisy";
    EXPECT_EQ(agreement["agrees"], false);
    EXPECT_EQ(agreement["blocks"].size(), 4u);
    EXPECT_LT(std::abs(agreement["difference"].get<double>()), 1e-4);
    EXPECT_NEAR(figure(json, 1, 1, "paths_per_second"), 32 * 32 * 2 / 4.0, 1e-6);
}

TEST_F(Converge, RefusesRenderersThatCannotRun) {
    const std::string copy = "a=cp x {samples} {seed} {output}";
    const std::tuple<int, const char*, std::string, const char*> rows[] = {
        {2, "", "a=cp x {output} {samples}", "{seed}"},
        {2, "", "plain=cp {samples} {seed} {output}", "'plain'"},
        {2, "", "Halflight (plain)=cp {samples} {seed} {output}", "'Halflight (plain)'"},
        {2, "--filter blackman-harris", copy, "--filter"},
        {2, "--hide 40,135", copy, "--external: "},
        {2, "--variant 40,135", copy, "--external: "},
        {2, "--sky 40,135", copy, "--external: "},
        {1, "--quiet --env 1,1,1", copy, "a: its command lacks {environment}"},
        {1, "--quiet --look-from 0,0,1 --look-at 0,0,0", copy, "a: its command lacks {look-from} or {look-at}"},
        {1, "--quiet", "a=ls /no/such/scene {samples} {seed} {output}", "a: exit status 2; it says: ls: "}};
    for (const auto& [status, options, external, element] : rows) {
        const Outcome outcome = run_program(command(kQuick, options, "--external", external));
        EXPECT_EQ(outcome.status, status) << external << outcome.err;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        expect_has(outcome.err, element);
        EXPECT_FALSE(std::filesystem::exists(out));
    }
}

TEST_F(Converge, FailsWhereAgreementIsRequiredAndMissing) {
    const Strings arguments = words("--samples 4 --method plain --reference-samples 16 --require-agreement --external",
                                    renderer("direct", "--camera {camera} --bounces 1"));
    const Outcome outcome = run_program(command(arguments, "--seeds 2"));
    EXPECT_EQ(outcome.status, 1);
    expect_has(outcome.err, "direct and Halflight (plain) differ. The mean of direct differs by -");
    const Json json = report();
    EXPECT_EQ(json["agreements"][0]["verdict"], "differ") << "the report is written all the same";
    EXPECT_EQ(json["compared_by"], "variance");
    EXPECT_FALSE(json["methods"][1]["points"][0].contains("bias_squared"));
    EXPECT_EQ(run_program(command("--require-agreement --samples 1")).status, 2);
    EXPECT_EQ(run_program(command(arguments, "--seeds 1")).status, 2) << "one seed tells no noise";
}

TEST_F(Converge, OtherRenderersTakeCamerasOfTheCommandLine) {
    const std::string again =
        renderer("again", "--bounces {bounces} --look-from={look-from} --look-at={look-at} --vfov={vfov}");
    const Json json = report_of("--samples 4 --seeds 1 --method plain --reference-samples 16 --look-from 0.5,1.5,3",
                                "--look-at 0,1,0 --vfov 50 --external", again);
    EXPECT_NEAR(figure(json, 0, 0, "mse"), figure(json, 1, 0, "mse"), 1e-4 * figure(json, 0, 0, "mse"));
}

/// A method with all light differs from a file with direct light only, and with direct light only it does not.
TEST_F(Converge, DifferencesFromAFileAreFlagged) {
    const std::string direct = file("direct.exr");
    done(words("render", kCornell, direct, "--width 32 --height 32 --bounces 1 --samples 256 --quiet"));
    const Strings arguments = words("converge", kCornell, "-o", out, "--width 32 --height 32 --clock cpu --seeds 4",
                                    "--samples 1,4,16 --method plain --reference", direct);
    expect_has(done(arguments).err, "Halflight (plain): difference");
    const Json method = report()["methods"][0];
    EXPECT_EQ(method["findings"][0]["kind"], "difference") << "another program may have made the file";
    EXPECT_GT(method["points"][2]["relative_difference"]["value"], 0.1);
    done(words(arguments, "--bounces 1"));
    EXPECT_LT(std::abs(figure(report(), 0, 2, "relative_difference")), 0.06);
}

TEST_F(Converge, EstimatorsAreCompared) {
    const Json json = report_of("--samples 4,16 --seeds 2 --method plain,compute,oracle --reference-samples 32",
                                "--estimator lights=power --estimator lights=tree");
    EXPECT_EQ(methods(json),
              (Strings{"Halflight (plain lights=power)", "Halflight (plain lights=tree)",
                       "Halflight (compute lights=power)", "Halflight (compute lights=tree)", "Halflight (oracle)"}));
    // All tracing methods give equal pictures with equal estimators; other estimators give other pictures.
    EXPECT_EQ(json["same_pictures"], (Json{{"compared", 8}, {"different", 0}}));
    EXPECT_NE(figure(json, 0, 1, "mse"), figure(json, 1, 1, "mse"));
    EXPECT_EQ(figure(json, 0, 1, "mse"), figure(json, 2, 1, "mse"));
    // The reference does not depend on the estimator.
    const Json again = report_of("--samples 1 --seeds 1 --method plain --reference-samples 32");
    EXPECT_EQ(again["reference"]["samples_found"], 32);
}

TEST_F(Converge, ReportsThePilotsChoice) {
    const Json pilots = report_of(kQuick, "--estimator auto --estimator camera=2")["pilots"];
    ASSERT_EQ(pilots.size(), 1u) << "nothing was left open by the other one";
    const std::regex form(".*reuse=(off|[0-9]+),camera=[0-9]+,shadow=[0-9]+,.* for .*reuse=auto,camera=auto,.*");
    EXPECT_TRUE(std::regex_match(pilots[0].get<std::string>(), form)) << pilots;
}

TEST_F(Converge, DenoisedPicturesAreCompared) {
    const Json json = report_of("--samples 2,16 --seeds 4 --method compute,plain --reference-samples 512",
                                "--denoise none --denoise on");
    EXPECT_EQ(methods(json), (Strings{"Halflight (compute denoise=none)", "Halflight (compute denoise=on)",
                                      "Halflight (plain denoise=none)", "Halflight (plain denoise=on)"}));
    EXPECT_EQ(json["biases"].size(), 2u);
    EXPECT_EQ(json["same_pictures"], (Json{{"compared", 16}, {"different", 0}}));
    const auto point = [&](int method, const char* name) { return figure(json, method, 1, name); };
    EXPECT_LT(point(1, "relative_mse"), point(0, "relative_mse"));
    EXPECT_NE(point(1, "variance"), point(0, "variance"));
    EXPECT_NE(point(1, "bias_squared"), point(0, "bias_squared"));
    EXPECT_EQ(point(1, "bias_squared"), point(3, "bias_squared"));
    for (const char* other : {"--samples 1,2", "--preview filter", "--seconds 1"}) {
        const Outcome outcome = run_program(command("--denoise on", other));
        EXPECT_NE(outcome.status, 0);
        expect_has(outcome.err, words(other)[0]);
    }
}

TEST_F(Converge, PreviewsAreCompared) {
    const Strings common = words("--samples 2,64 --seeds 2 --method plain,oracle --reference-samples 32",
                                 "--preview none --preview cache");
    const Json cold = report_of(common), warm = report_of(common, "--warm-up 8");
    EXPECT_EQ(methods(cold),
              (Strings{"Halflight (plain preview=none)", "Halflight (plain preview=cache)", "Halflight (oracle)"}));
    EXPECT_EQ(cold["biases"].size(), 1u);
    EXPECT_EQ(cold["same_pictures"]["compared"], 0);
    EXPECT_EQ(figure(warm, 0, 0, "mse"), figure(cold, 0, 0, "mse"));
    EXPECT_NE(figure(warm, 1, 0, "mse"), figure(cold, 1, 0, "mse"));
    EXPECT_EQ(figure(warm, 1, 1, "mse"), figure(cold, 1, 1, "mse")) << "both have been handed over";
}

TEST_F(Converge, BudgetsOfSeconds) {
    const Json json =
        report_of("--seconds 0.05,0.4 --seeds 2 --method plain,oracle --reference gl --reference-samples 64");
    EXPECT_EQ(json["reference"]["maker"], "gl");
    for (const Json& method : json["methods"]) {
        EXPECT_GT(method["points"][1]["samples"], method["points"][0]["samples"]) << method["method"];
        EXPECT_EQ(method["points"][1]["budget"]["seconds"], 0.4);
    }
}

TEST_F(Converge, FilesThatCannotBeUsedAreNamed) {
    const std::string other = file("other.exr"), taken = file("file");
    done(words("render", kCornell, other, "--width 8 --height 8 --samples 1 --quiet"));
    write_text(taken, "");
    const Strings usual = words("converge", kCornell, "--width 32 --height 32");
    refused(1, words("converge", file("missing.glb"), "-o", out), "missing.glb: ");
    refused(1, words(usual, "-o", out, "--reference", other), "8 x 8");
    refused(1, words(usual, "-o", out, "--reference", file("none.exr")), "none.exr: ");
    refused(1, words(usual, "-o", out, kQuick, "--cache", taken), "file: cannot be made");
    refused(1, words(usual, "-o /proc/none/reports", kQuick), "/proc/none");
    refused(1, words(usual, "-o", taken, kQuick), "file: ");
    refused(1, words(usual, "-o", out, kQuick, "--camera nobody"), "nobody");
    refused(1, words(usual, "-o", out, kQuick, "--hide nobody"), "nobody");
    EXPECT_EQ(read_text(taken), "");
}

TEST_F(Converge, CreatesFoldersAndRemovesThem) {
    const std::string parent = out;
    out += "/of/reports";
    EXPECT_EQ(run_program(command("--camera nobody")).status, 1);
    EXPECT_FALSE(std::filesystem::exists(parent));
    expect_has(done(command(kQuick)).err, "Halflight (plain): slope none");
    EXPECT_EQ(report()["runs"].size(), 1u);
}

TEST_F(Converge, InterruptedWritesNothingButKeepsTheReference) {
    bool sent = false;
    const auto interrupt = [&](pid_t child, const std::string& err) {
        if (!sent && has(err, "pictures: 10 %")) sent = kill(child, SIGINT) == 0;
    };
    const Outcome outcome =
        run_program(command("--samples 128 --seeds 16 --method plain --reference-samples 64"), {.watch = interrupt});
    EXPECT_TRUE(sent);
    EXPECT_EQ(outcome.status, 128 + SIGINT) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(out));
    const Json json = report_of("--samples 1 --seeds 1 --method plain --reference-samples 64");
    EXPECT_EQ(json["reference"]["samples_found"], 64);
}

}  // namespace
}  // namespace halflight::test
