// Tests that reports of `halflight converge` are well-formed and self-contained, and hold the figures.
#include <expat.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/unit/tools/converge_fakes.h"
#include "tools/measure/converge/conclusions.h"
#include "tools/measure/converge/maps.h"
#include "tools/measure/converge/report.h"

namespace halflight::converge::test {
namespace {

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
}

/// Expects well-formed XML.
void expect_xml(const std::string& text) {
    const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate("UTF-8"),
                                                                              XML_ParserFree);
    EXPECT_EQ(XML_Parse(parser.get(), text.data(), static_cast<int>(text.size()), 1), XML_STATUS_OK)
        << XML_ErrorString(XML_GetErrorCode(parser.get())) << " in\n"
        << text;
}

class ConvergeReport : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        measured = measure_fakes({}, {.bias = 0.1f});
        reference = fake_reference(4096);
    }
    static Subject subject(const Plan& plan = kPlan, const std::string& scene = "a.glb") {
        return {"halflight", scene, "'<front>'", "none", "a & b", {kWidth, kHeight, {}, 8}, plan, Clock::cpu};
    }
    static std::string html(const Subject& subject, const Reference& reference, const Measurement& measured) {
        return report_html(subject, reference, measured, ColorConfig::load().view({}));
    }
    static inline Measurement measured;
    static inline Reference reference;
};

TEST_F(ConvergeReport, JsonHoldsAllFigures) {
    const auto json = nlohmann::json::parse(report_json(subject(), reference, measured).dump());
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
    const auto& biased = json["methods"].at(1);
    EXPECT_EQ(biased["method"], "Halflight (oracle)");
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
    const struct {
        Interval gain, lead;
        const char* advice;
    } cases[] = {{{1.5, 0.1}, {0.9, 0.15}, "most for sky"},
                 {{0.9, 0.05}, {0.9, 0.15}, "does not pay off"},
                 {{0.95, 0.1}, {0.9, 0.15}, "undecided"},  // an advantage within the confidence interval
                 {{1.5, 0.1}, {0.9, 1.0}, "undecided"}};
    for (const auto& c : cases) {
        method.stages[0].gain = c.gain, method.stage_lead = c.lead;
        EXPECT_NE(advice(subject(), one).at(0).find(c.advice), std::string::npos) << c.advice;
    }
    Measurement noisy = measured;  // an error below the reference's noise
    noisy.methods[1].points.back().mse.value = -1e-6, noisy.methods[1].efficiency = 0;
    EXPECT_NE(advice(subject(), noisy).at(0).find("is not known"), std::string::npos);
}

TEST_F(ConvergeReport, MethodsWithinTheNoiseOfTheirTimesAreNotToldApart) {
    Measurement two;
    for (const double rate : {1.0, 0.95}) {  // the pictures are the same
        MethodResult& m = two.methods.emplace_back();
        m.name = fmt::format("m{}", two.methods.size());
        m.efficiency = rate;
        Point& point = m.points.emplace_back();
        point.mse = {1, 0.1}, point.paths_per_second = {rate, 0.05};
    }
    const std::string alike = advice(subject(), two).at(0);
    EXPECT_TRUE(alike.starts_with("No difference shows")) << alike;
    EXPECT_EQ(alike.find("lowers"), std::string::npos) << alike;
    for (MethodResult& m : two.methods) m.points[0].paths_per_second.half_width = 0.001;
    const std::string differ = advice(subject(), two).at(0);
    EXPECT_TRUE(differ.starts_with("m1 lowers the error most")) << differ;
}

TEST_F(ConvergeReport, AgreementWithAnExternalRendererIsShown) {
    Plan plan = kPlan;
    plan.methods[1] = Method::external, plan.external = {"o<t>her", "render it"};
    const Measurement with = measure_fakes({}, {.bias = 0.1f}, plan), alike = measure_fakes({}, {}, plan);
    const std::string page = html(subject(plan), reference, with);
    expect_xml(page);
    for (const char* part : {"o&lt;t&gt;her: difference.", "efficiency by variance", "difference² / MSE",
                             "Variance and squared difference, o&lt;t&gt;her", "structure in it is difference from"})
        EXPECT_NE(page.find(part), std::string::npos) << part;
    EXPECT_EQ(page.find("o&lt;t&gt;her: bias"), std::string::npos);
    EXPECT_EQ(conclusions(subject(plan), with)[0].label, "o<t>her and Halflight (plain) differ.");
    EXPECT_NE(conclusions(subject(plan), with)[0].text.find("% of the MSE of o<t>her is squared difference"),
              std::string::npos);
    EXPECT_EQ(conclusions(subject(plan), alike)[0].label, "o<t>her and Halflight (plain) agree.");
    EXPECT_NE(advice(subject(plan), with)[0].find("variance"), std::string::npos);
    EXPECT_EQ(advice(subject(plan), alike)[0].find("variance"), std::string::npos);
    const auto json = nlohmann::json::parse(report_json(subject(plan), reference, with).dump());
    ASSERT_EQ(json["agreements"].size(), 1u);
    const auto& found = json["agreements"][0];
    EXPECT_EQ(found["method"], "Halflight (plain)");
    EXPECT_EQ(found["other"], "o<t>her");
    EXPECT_EQ(found["verdict"], "differ");
    EXPECT_EQ(json["compared_by"], "variance");
    EXPECT_GT(found["squared_difference_share"], 0.5);
    EXPECT_TRUE(json["methods"][0]["points"][0].contains("relative_bias"));
    EXPECT_TRUE(json["methods"][1]["points"][0].contains("relative_difference"));
    EXPECT_NEAR(found["difference"].get<double>(), 0.1 / 1.5, 0.01);
    EXPECT_EQ(found["blocks"].size(), 2u);
    EXPECT_EQ(found["blocks_beyond"], 2);
    EXPECT_GT(json["methods"][1]["points"][0]["paths_per_second"]["value"], 0);
}

TEST_F(ConvergeReport, UnknownValuesAreNull) {
    Plan plan = kPlan;
    plan.seeds = 1;
    plan.budgets.resize(2);
    const auto json = report_json(subject(plan), reference, measure_fakes({}, {}, plan));
    EXPECT_TRUE(json["methods"][0]["points"][0]["mse"]["half_width"].is_null());
    EXPECT_TRUE(json["methods"][0]["slope"]["slope"]["value"].is_null());
    EXPECT_EQ(json.dump().find("inf"), std::string::npos);
}

TEST_F(ConvergeReport, CsvHasARowForEachRun) {
    std::istringstream csv(report_csv(subject(), measured));
    std::string line;
    std::getline(csv, line);
    const auto columns = count(line, ",");
    int rows = 0;
    for (; std::getline(csv, line); ++rows) EXPECT_EQ(count(line, ","), columns) << line;
    EXPECT_EQ(rows, 64);
    EXPECT_EQ(csv_field("plain lights=tree"), "plain lights=tree");
    EXPECT_EQ(csv_field("plain lights=tree,filter=box"), "\"plain lights=tree,filter=box\"");
    EXPECT_EQ(csv_field("a\r\n\"b\""), "\"a\r\n\"\"b\"\"\"");
}

TEST_F(ConvergeReport, PageIsWellFormedAndSelfContained) {
    Measurement hostile = measured;
    hostile.methods[1].name = "a<b>&\"'\x01 größe";
    const std::string page = html(subject(kPlan, "<script>alert('&')</script>.glb"), reference, hostile);
    expect_xml(page);
    for (const char* absent : {"<script", "a<b>", "src=\"http", "href=", "url(", "@import"})
        EXPECT_EQ(page.find(absent), std::string::npos) << absent;
    EXPECT_EQ(count(page, "<svg"), 8u);            // four per method, plus two per method with pictures of its own
    EXPECT_EQ(count(page, "data:image/png"), 9u);  // the reference, and four per method
    const std::pair<const char*, const char*> codes[] = {
        {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"\xff\xfe\xfd", "//79"}};
    for (const auto& [bytes, code] : codes) EXPECT_EQ(base64(bytes), code);  // RFC 4648, section 10
}

TEST_F(ConvergeReport, ReferencesWithoutComponentsAreReportedToo) {
    Reference file = reference;
    file.has_components = false;
    file.halves_differ = false;
    file.samples = 0;
    for (auto* picture : {&file.halves[0], &file.halves[1], &file.mean}) picture->components = {};
    const Measurement without = measure_fakes({}, {}, kPlan, file);
    EXPECT_TRUE(without.methods[0].stages.empty());
    expect_xml(html(subject(), file, without));
    const auto json = report_json(subject(), file, without);
    EXPECT_TRUE(json["runs"][0]["components_mse"].is_null());
    EXPECT_TRUE(json["reference"]["samples"].is_null());
}

}  // namespace
}  // namespace halflight::converge::test
