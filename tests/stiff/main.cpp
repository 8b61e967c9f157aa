// Runs the stiff cases. If --table or --json is the only argument, prints their records instead of gtest's log.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string_view>

#include "tests/stiff/stiff.h"
#include "tests/support/select_tests.h"

namespace halflight::test {
namespace {

std::string number(double value) {
    return fmt::format("{:.3g}", value);
}

void print_table(int skipped) {
    std::size_t width = 0;
    std::ptrdiff_t failed = 0;
    for (const StiffCase& c : stiff_cases()) {
        width = std::max(width, c.name.size());
        failed += !c.holds();
    }
    std::string theme;
    for (const StiffCase& c : stiff_cases()) {
        if (c.theme != theme)
            fmt::print("\n{:<{}}  {:>9}  {:>9}  {:<16}  because\n", theme = c.theme, width, "figure", "bound", "of");
        fmt::print("{:<{}}  {:>9}  {:>9}  {:<16}  {}{}\n", c.name, width, number(c.figure), number(c.bound), c.unit,
                   c.reason, c.holds() ? "" : "  <-- BEYOND");
    }
    fmt::print("\n{} cases, {} beyond their bounds, {} tests skipped\n", stiff_cases().size(), failed, skipped);
}

void print_json(int skipped) {
    nlohmann::ordered_json list = nlohmann::json::array();
    for (const StiffCase& c : stiff_cases()) {
        list.push_back({{"theme", c.theme},
                        {"name", c.name},
                        {"figure", c.figure},
                        {"bound", c.bound},
                        {"unit", c.unit},
                        {"reason", c.reason},
                        {"holds", c.holds()}});
    }
    fmt::print("{}\n", nlohmann::ordered_json{{"cases", list}, {"tests_skipped", skipped}}.dump(2));
}

/// Prints to stderr the failures that are not recorded as cases.
class Failures : public testing::EmptyTestEventListener {
    void OnTestPartResult(const testing::TestPartResult& result) override {
        if (result.failed()) fmt::print(stderr, "{}\n", result.message());
    }
};

}  // namespace
}  // namespace halflight::test

int main(int argc, char** argv) {
    const std::string_view option = argc == 2 ? argv[1] : "";
    const bool table = option == "--table", json = option == "--json";
    testing::InitGoogleTest(&argc, argv);
    if (!halflight::test::select_tests(argc, argv)) return 1;
    testing::UnitTest& tests = *testing::UnitTest::GetInstance();
    if (table || json) {
        testing::TestEventListeners& listeners = tests.listeners();
        delete listeners.Release(listeners.default_result_printer());
        listeners.Append(new halflight::test::Failures);
    }
    const int status = RUN_ALL_TESTS();
    if (table) halflight::test::print_table(tests.skipped_test_count());
    if (json) halflight::test::print_json(tests.skipped_test_count());
    if ((table || json) && status != 0)
        fmt::print(stderr, "stiff-report: {} tests failed\n", tests.failed_test_count());
    return status;
}
