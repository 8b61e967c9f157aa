// Tests that reports of `halflight converge` are well-formed and complete, and agree with the figures.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <sstream>

#include "tests/unit/tools/converge_fakes.h"
#include "tests/unit/tools/xml.h"
#include "tools/measure/converge/conclusions.h"
#include "tools/measure/converge/maps.h"
#include "tools/measure/converge/plot.h"
#include "tools/measure/converge/report.h"

namespace halflight::converge::test {
namespace {

using halflight::test::xml_error;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
}

TEST(ConvergePlot, IsWellFormedWhateverItShows) {
    const std::string hostile = "<b> & \"quoted\" 'text' \x01 größe";
    const Curve usual{hostile, {{0.1, 1e-2, 0.9e-2, 1.1e-2}, {1, 1e-3, 0.8e-3, 1.2e-3}}};
    for (const std::vector<Curve>& curves :
         {std::vector<Curve>{},
          {{"empty", {}}},
          {usual},
          {usual, {"one", {{2, 3, 1, kInfinite}}}},
          {{"nothing to draw", {{0, 1, 0, 1}, {1, 0, -1, 1}, {1, -2, -3, 1}, {kInfinite, 1, 0, 2}}}},
          {{"wide", {{1e-9, 1e-30, 0, 1}, {1e9, 1e30, 0, 1e31}}}},
          {{"no width", {{5, 5, 5, 5}, {5, 5, 5, 5}}}}}) {
        const std::string text = svg({hostile, hostile, hostile, curves, -1});
        EXPECT_EQ(xml_error(text), "") << text;
        EXPECT_EQ(text.find("nan"), std::string::npos) << text;
        EXPECT_EQ(text.find("inf"), std::string::npos) << text;
    }
    EXPECT_NE(xml_error("<svg>"), "");
}

/// Returns the centres of the circles that mark the points of the first curve; the last circle belongs to the legend.
std::vector<std::pair<double, double>> circles(const std::string& svg_text) {
    std::vector<std::pair<double, double>> centres;
    for (std::size_t at = svg_text.find("<circle"); at != std::string::npos; at = svg_text.find("<circle", at + 1)) {
        const auto value = [&](const char* name) {
            return std::stod(svg_text.substr(svg_text.find(name, at) + std::string(name).size()));
        };
        centres.push_back({value("cx=\""), value("cy=\"")});
    }
    return centres;
}

TEST(ConvergePlot, DecadesHaveEqualLength) {
    const auto at =
        circles(svg({"", "", "", {{"a", {{0.1, 1, 1, 1}, {1, 0.1, 0.1, 0.1}, {10, 0.01, 0.01, 0.01}}}}, 0}));
    ASSERT_EQ(at.size(), 4u);
    EXPECT_GT(at[1].first, at[0].first);
    EXPECT_GT(at[1].second, at[0].second);  // y grows downwards, so a smaller error has a larger y
    EXPECT_NEAR(at[2].first - at[1].first, at[1].first - at[0].first, 0.02);
    EXPECT_NEAR(at[2].second - at[1].second, at[1].second - at[0].second, 0.02);
}

TEST(ConvergePlot, BarsBelowZeroEndAtTheAxis) {
    const std::string text = svg({"", "", "", {{"a", {{1, 1, -5, 2}, {2, 0.5, 0.4, 0.6}}}}, 0});
    EXPECT_EQ(count(text, " 358.00V"), 1u) << text;  // 358 is the bottom of the frame
    // A value that is not positive has a bar but no marker; one of the circles belongs to the legend.
    const std::string none = svg({"", "", "", {{"a", {{1, -1, -5, 2}, {2, 0.5, 0.4, 0.6}}}}, 0});
    EXPECT_EQ(circles(none).size(), 2u);
    EXPECT_EQ(count(none, " 358.00V"), 1u);
}

TEST(ConvergeMaps, Base64) {
    EXPECT_EQ(base64(""), "");  // RFC 4648, section 10
    EXPECT_EQ(base64("f"), "Zg==");
    EXPECT_EQ(base64("fo"), "Zm8=");
    EXPECT_EQ(base64("foo"), "Zm9v");
    EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
    EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(ConvergeMaps, SignedErrorsHaveColours) {
    Image image(3, 1, 3), reference(3, 1, 3);
    reference.pixels.assign(9, 1);
    image.pixels = {1, 1, 1, 2, 2, 2, 0, 0, 0};
    const Image map = signed_error_picture(image, reference, 1);
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(map.at(0, 0)[c], 1);  // equal: white
    EXPECT_GT(map.at(1, 0)[0], map.at(1, 0)[2]);                      // brighter: red
    EXPECT_LT(map.at(2, 0)[0], map.at(2, 0)[2]);                      // darker: blue
    EXPECT_NEAR(error_scale(image, reference, 1), 1, 1e-6);
    EXPECT_GT(error_scale(image, image), 0);
}

TEST(ConvergeMaps, ShrunkPicturesAreMeans) {
    Image image(5, 3, 1);
    for (int i = 0; i < 15; ++i) image.pixels[static_cast<std::size_t>(i)] = static_cast<float>(i);
    const Image small = shrink(image, 3);
    EXPECT_EQ(small.width, 2);
    EXPECT_EQ(small.height, 1);
    EXPECT_FLOAT_EQ(small.pixels[0], (0 + 1 + 5 + 6) / 4.0f);
    EXPECT_EQ(shrink(image, 5).pixels, image.pixels);
}

class ConvergeReport : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        measured = measure_fakes({}, {.bias = 0.1f});
        reference = fake_reference(4096);
    }
    static Subject subject(const std::string& scene) {
        return {.program = "halflight",
                .scene = scene,
                .camera = "'<front>'",
                .environment = "none",
                .device = "a & b",
                .view = {kWidth, kHeight, {}, 8},
                .plan = kPlan,
                .clock = Clock::cpu};
    }
    static std::string html(const std::string& scene) {
        return report_html(subject(scene), reference, measured, ColorConfig::load().view({}));
    }
    static inline Measurement measured;
    static inline Reference reference;
};

TEST_F(ConvergeReport, JsonHoldsAllFigures) {
    const auto json = nlohmann::json::parse(report_json(subject("a.glb"), reference, measured).dump());
    EXPECT_EQ(json["schema"], kSchema);
    EXPECT_EQ(json["plan"]["seeds"], 8);
    EXPECT_EQ(json["plan"]["clock"], "cpu");
    EXPECT_EQ(json["reference"]["samples"], 4096);
    ASSERT_EQ(json["runs"].size(), 64u);
    for (const auto& run : json["runs"]) {
        for (const char* key : {"mse", "relative_mse", "hdr_flip", "trimmed_mse", "blurred_mse"})
            EXPECT_GT(run[key], 0) << key;
        EXPECT_EQ(run["components_mse"].size(), kComponents.size());
        EXPECT_GT(run["seconds"]["cpu"], 0);
    }
    ASSERT_EQ(json["methods"].size(), 2u);
    const auto& biased = json["methods"][1];
    EXPECT_EQ(biased["method"], "oracle");
    EXPECT_EQ(biased["findings"][0]["kind"], "bias");
    ASSERT_EQ(biased["points"].size(), 4u);
    EXPECT_NEAR(biased["points"][3]["bias_squared"]["value"], 0.01, 0.001);
    EXPECT_EQ(json["methods"][0]["stages"].size(), 3u);
    EXPECT_EQ(json["advice"].size(), 3u);  // one for the methods, one for each method's stages
}

TEST_F(ConvergeReport, AdviceFollowsTheStages) {
    Measurement one;
    MethodResult& method = one.methods.emplace_back();
    method.stages = {{"sky", 1, 0.2, 0.9, {1.5, 0.1}}, {"sea", 4, 0.8, 0.1, {0.6, 0.1}}};
    method.stage_lead = {0.9, 0.15};
    const auto line = [&] {
        const auto lines = advice(subject("a.glb"), one);
        EXPECT_EQ(lines.size(), 1u);
        return lines.at(0);
    };
    EXPECT_NE(line().find("most for sky, with 90 % of the error and 20 % of the time"), std::string::npos);
    EXPECT_NE(line().find("1.50 ± 0.10"), std::string::npos) << line();
    method.stages[0].gain = {0.9, 0.05};
    EXPECT_NE(line().find("does not pay off"), std::string::npos);
    // An advantage within the confidence interval is undecided.
    method.stages[0].gain = {0.95, 0.1};
    EXPECT_NE(line().find("undecided"), std::string::npos);
    method.stages[0].gain = {1.5, 0.1};
    method.stage_lead = {0.9, 1.0};
    EXPECT_NE(line().find("undecided"), std::string::npos);
    EXPECT_NE(line().find("for sea by 0.60 ± 0.10"), std::string::npos) << line();
}

TEST_F(ConvergeReport, NoMethodIsBestWhereAnErrorIsBelowTheReferencesNoise) {
    Measurement noisy = measured;
    noisy.methods[1].points.back().mse.value = -1e-6, noisy.methods[1].efficiency = 0;
    const auto lines = advice(subject("a.glb"), noisy);
    EXPECT_NE(lines.at(0).find("is not known"), std::string::npos) << lines.at(0);
    const std::string page = report_html(subject("a.glb"), reference, noisy, ColorConfig::load().view({}));
    EXPECT_EQ(page.find("± −"), std::string::npos) << "half widths are positive";
}

TEST_F(ConvergeReport, EqualPicturesHaveOneConclusion) {
    Measurement same = measured;
    same.methods[1] = same.methods[0];
    same.methods[1].name = "again";
    same.methods[0].findings = {{Finding::Kind::inconclusive, "open"}, {Finding::Kind::bias, "grey"}};
    same.methods[1].findings = {{Finding::Kind::bias, "grey"}};
    const std::string names = same.methods[0].name + " = again";
    const auto told = [&](const std::string& text) {
        const auto all = conclusions(subject("a.glb"), same);
        return std::ranges::count_if(
            all, [&](const Conclusion& c) { return (c.label + " " + c.text).find(text) != std::string::npos; });
    };
    EXPECT_EQ(told("open"), 0) << "the other method settles it";
    EXPECT_EQ(told(names + ": bias. grey"), 1);
    EXPECT_EQ(told(names + ". These methods make the same pictures"), 1);
    same.methods[1].findings.push_back({Finding::Kind::inconclusive, "open"});
    EXPECT_EQ(told(names + ": inconclusive. open"), 1);
    same.methods[0].findings = same.methods[1].findings = {};
    EXPECT_EQ(told(names + ": no findings."), 1);
    const std::string page = report_html(subject("a.glb"), reference, same, ColorConfig::load().view({}));
    EXPECT_EQ(xml_error(page), "");
    EXPECT_LT(page.find("<h2>Conclusions"), page.find("<table"));
    EXPECT_LT(page.find("<h2>Methods"), page.find("<table"));
}

TEST_F(ConvergeReport, MethodNamesAreEscaped) {
    Measurement hostile = measured;
    hostile.methods[1].name = "a<b>&\"";
    const std::string page = report_html(subject("a.glb"), reference, hostile, ColorConfig::load().view({}));
    EXPECT_EQ(page.find("a<b>"), std::string::npos);
    EXPECT_GT(count(page, "a&lt;b&gt;&amp;"), 5u);
}

TEST_F(ConvergeReport, AgreementWithAnExternalRendererIsShown) {
    Subject external = subject("a.glb");
    external.plan.methods[1] = Method::external, external.plan.external = {"o<t>her", "render it"};
    const Measurement with = measure_fakes({}, {.bias = 0.1f}, external.plan);
    const std::string page = report_html(external, reference, with, ColorConfig::load().view({}));
    EXPECT_EQ(xml_error(page), "");
    EXPECT_NE(page.find("Agreement of o&lt;t&gt;her with plain"), std::string::npos);
    EXPECT_NE(page.find("The renderers do not agree."), std::string::npos);
    EXPECT_EQ(count(page, "data:image/png"), 13u);  // four of these show the agreement
    const auto json = nlohmann::json::parse(report_json(external, reference, with).dump());
    ASSERT_EQ(json["agreements"].size(), 1u);
    const auto& found = json["agreements"][0];
    EXPECT_EQ(found["method"], "plain");
    EXPECT_EQ(found["agrees"], false);
    EXPECT_NEAR(found["difference"].get<double>(), 0.1 / 1.5, 0.01);
    EXPECT_EQ(found["blocks"].size(), 2u);
    EXPECT_EQ(found["blocks_beyond"], 2);
    EXPECT_GT(json["methods"][1]["points"][0]["paths_per_second"]["value"], 0);
}

TEST_F(ConvergeReport, UnknownValuesAreNull) {
    Plan plan = kPlan;
    plan.seeds = 1;
    Subject one = subject("a.glb");
    one.plan = plan;
    const auto json = report_json(one, reference, measure_fakes({}, {}, plan));
    EXPECT_TRUE(json["methods"][0]["points"][0]["mse"]["half_width"].is_null());
    EXPECT_FALSE(json["methods"][0]["slope"]["slope"]["value"].is_null());  // four budgets determine the slope
    plan.budgets.resize(2);
    one.plan = plan;
    const auto two = report_json(one, reference, measure_fakes({}, {}, plan));
    EXPECT_TRUE(two["methods"][0]["slope"]["slope"]["value"].is_null());
    EXPECT_EQ(json.dump().find("inf"), std::string::npos);
}

TEST_F(ConvergeReport, CsvHasARowForEachRun) {
    std::istringstream csv(report_csv(subject("a.glb"), measured));
    std::string line;
    std::getline(csv, line);
    const auto columns = count(line, ",");
    EXPECT_EQ(line.substr(0, 14), "method,budget_");
    EXPECT_TRUE(line.ends_with(",indirect_glossy_mse,non_finite\r"));
    int rows = 0;
    for (; std::getline(csv, line); ++rows) {
        EXPECT_EQ(count(line, ","), columns) << line;
        EXPECT_TRUE(line.ends_with(",0\r")) << line;  // the last field counts values that are not finite
    }
    EXPECT_EQ(rows, 64);
}

TEST(ConvergeCsv, FieldsAreQuotedWhereNecessary) {
    EXPECT_EQ(csv_field("plain lights=tree"), "plain lights=tree");
    EXPECT_EQ(csv_field("plain lights=tree,filter=box"), "\"plain lights=tree,filter=box\"");
    EXPECT_EQ(csv_field("a \"b\""), "\"a \"\"b\"\"\"");
    EXPECT_EQ(csv_field("a\r\nb"), "\"a\r\nb\"");
    EXPECT_EQ(csv_field(""), "");
}

TEST_F(ConvergeReport, PageIsWellFormedAndSelfContained) {
    const std::string page = html("<script>alert('&')</script>.glb");
    EXPECT_EQ(xml_error(page), "");
    EXPECT_EQ(page.find("<script"), std::string::npos);
    for (const char* outside : {"src=\"http", "href=", "url(", "@import"})
        EXPECT_EQ(page.find(outside), std::string::npos) << outside;
    EXPECT_EQ(count(page, "<svg"), 8u);            // four per method, plus two per method with pictures of its own
    EXPECT_EQ(count(page, "data:image/png"), 9u);  // the reference, and four per method
    EXPECT_NE(page.find("More samples do not reduce it"), std::string::npos);  // the bias is reported
}

TEST_F(ConvergeReport, ReferencesWithoutComponentsAreReportedToo) {
    Reference file = fake_reference(4096);
    file.has_components = false;
    file.halves_differ = false;
    file.samples = 0;
    for (auto* picture : {&file.halves[0], &file.halves[1], &file.mean}) picture->components = {};
    const Measurement without = measure_fakes({}, {}, kPlan, file);
    EXPECT_TRUE(without.methods[0].stages.empty());
    EXPECT_EQ(xml_error(report_html(subject("a.glb"), file, without, ColorConfig::load().view({}))), "");
    const auto json = report_json(subject("a.glb"), file, without);
    EXPECT_TRUE(json["runs"][0]["components_mse"].is_null());
    EXPECT_TRUE(json["reference"]["samples"].is_null());
    EXPECT_EQ(count(report_csv(subject("a.glb"), without), ",,,,,,0\r\n"), 64u);
}

}  // namespace
}  // namespace halflight::converge::test
