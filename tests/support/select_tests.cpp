#include "tests/support/select_tests.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>
#include <string>
#include <string_view>

namespace halflight::test {
namespace {

/// Returns the names of the tests in a file, each followed by ':'.
std::string tests_of(const std::string& file) {
    std::string names;
    const testing::UnitTest& all = *testing::UnitTest::GetInstance();
    for (int s = 0; s < all.total_test_suite_count(); ++s) {
        const testing::TestSuite& suite = *all.GetTestSuite(s);
        for (int t = 0; t < suite.total_test_count(); ++t) {
            const testing::TestInfo& info = *suite.GetTestInfo(t);
            if (std::string_view(info.file()).ends_with("/" + file))
                names += std::string(suite.name()) + "." + info.name() + ":";
        }
    }
    return names;
}

}  // namespace

bool select_tests(int argc, const char* const* argv) {
    constexpr std::string_view kOption = "--sources=";
    for (int i = 1; i < argc; ++i) {
        if (!std::string_view(argv[i]).starts_with(kOption)) continue;
        std::istringstream files(argv[i] + kOption.size());
        std::string filter;
        for (std::string file; std::getline(files, file, ',');) {
            const std::string names = tests_of(file);
            if (names.empty()) {
                std::fprintf(stderr, "--sources: there is no test in %s\n", file.c_str());
                return false;
            }
            filter += names;
        }
        GTEST_FLAG_SET(filter, filter);
    }
    return true;
}

}  // namespace halflight::test
