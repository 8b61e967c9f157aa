// Selects the tests of a program by the source files in which they stand.
#pragma once

namespace halflight::test {

/// Reads `--sources=FILE,FILE...`, where a FILE is the end of the path of a source, from the arguments that gtest left,
/// and makes its tests the ones that RUN_ALL_TESTS() runs. `--gtest_list_tests` lists them. Without the option all
/// tests run. Returns false, after a line on stderr, if a FILE contains no test.
bool select_tests(int argc, const char* const* argv);

}  // namespace halflight::test
