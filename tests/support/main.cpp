// Runs the tests of a program, or those of some source files (select_tests.h).
#include <gtest/gtest.h>

#include "tests/support/select_tests.h"

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    return halflight::test::select_tests(argc, argv) ? RUN_ALL_TESTS() : 1;
}
