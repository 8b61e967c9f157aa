#include "tests/cli/bad_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <map>
#include <set>
#include <stdexcept>

namespace halflight::test {
namespace {

const std::map<Fate, std::string> kFates = {{Fate::loaded, "loaded"}, {Fate::refused, "refused"},
                                            {Fate::untidy, "UNTIDY"}, {Fate::crashed, "CRASHED"},
                                            {Fate::hung, "HUNG"},     {Fate::greedy, "GREEDY"}};

/// Owns the table of cases, and the output file that every case overwrites.
class Records : public testing::Environment {
  public:
    void add(const std::string& name, const Verdict& verdict, const Outcome& outcome) {
        ++counts_[verdict.fate];
        rows_.push_back(fmt::format("{:<8}{:6.2f} s {:5} MiB  {}{}{}\n", kFates.at(verdict.fate), outcome.cpu_seconds,
                                    outcome.peak_bytes >> 20, name, verdict.line.empty() ? "" : ": ", verdict.line));
    }
    std::string picture(const std::string& extension) const { return folder_ / ("picture." + extension); }
    void TearDown() override {
        if (!std::getenv("HALFLIGHT_BAD_INPUT_TABLE")) return;
        fmt::print("\nfate        CPU    memory  case: what the program said\n");
        for (const std::string& row : rows_) fmt::print("{}", row);
        fmt::print("\n{} cases", rows_.size());
        for (const auto& [fate, name] : kFates) fmt::print(", {} {}", name, counts_[fate]);
        fmt::print("\n");
    }

  private:
    TemporaryFolder folder_;
    std::vector<std::string> rows_;
    std::map<Fate, std::size_t> counts_;
};

Records& records() {
    static Records& instance = *static_cast<Records*>(testing::AddGlobalTestEnvironment(new Records));
    return instance;
}

Records& at_start = records();  // gtest requires the registration before the first test

RunOptions limited() {
    RunOptions options;
    options.wrapper = {"prlimit", fmt::format("--cpu={}", kMaxCpuSeconds), "--core=0"};
#ifndef HALFLIGHT_SANITIZED  // shadow memory takes terabytes of addresses
    // The limit also counts address space that the program reserves without using it.
    options.wrapper.push_back(fmt::format("--as={}", 8 * kMaxBytes));
#endif
    options.most_seconds = 120;  // ends a program that waits forever without using the CPU
    return options;
}

Fate fate_of(const Outcome& outcome) {
    const auto lines = std::ranges::count(outcome.err, '\n');
    const bool one_line = lines == 1 && outcome.err.starts_with("halflight: ") && outcome.err.ends_with('\n');
    if (outcome.status == 128 + SIGXCPU || outcome.status == 128 + SIGKILL || outcome.status == 128 + SIGALRM)
        return Fate::hung;
    if (outcome.status > 2) return Fate::crashed;
#ifndef HALFLIGHT_SANITIZED
    if (outcome.peak_bytes > kMaxBytes) return Fate::greedy;
#endif
    if (outcome.err.starts_with("halflight: memory:")) return Fate::greedy;  // the limit on address space was reached
    if (outcome.status == 0) return Fate::loaded;
    return one_line ? Fate::refused : Fate::untidy;
}

std::string room() {
    return std::string(HALFLIGHT_SOURCE_DIR) + "/tests/cli/room/room.gltf";
}

}  // namespace

std::ostream& operator<<(std::ostream& out, Fate fate) {
    return out << kFates.at(fate);
}

Verdict judge(const std::string& name, const std::vector<std::string>& arguments) {
    const Outcome outcome = run_program(arguments, limited());
    if (outcome.status == 127) throw std::runtime_error("the program cannot be run");  // prlimit's own status
    Verdict verdict{fate_of(outcome), outcome.err};
    while (verdict.line.ends_with('\n')) verdict.line.pop_back();
    records().add(name, verdict, outcome);
    return verdict;
}

std::vector<std::string> with_scene(const std::string& scene) {
    return {
        "render", scene,    records().picture("exr"), "--width", "4", "--height", "4", "--samples", "1", "--bounces",
        "1",      "--quiet"};
}

std::vector<std::string> with_environment(const std::string& map) {
    std::vector<std::string> arguments = with_scene(room());
    arguments.insert(arguments.end(), {"--env", map});
    return arguments;
}

std::vector<std::string> with_config(const std::string& config) {
    std::vector<std::string> arguments = with_scene(room());
    arguments.insert(arguments.end(), {records().picture("png"), "--ocio", config});
    return arguments;
}

std::vector<std::size_t> prefix_lengths(std::size_t size) {
    return {0, 4, std::min<std::size_t>(20, size / 4), size / 2, size - 1};
}

void expect_refused(const std::string& name, const std::vector<std::string>& arguments,
                    const std::vector<std::string>& words) {
    const Verdict verdict = judge(name, arguments);
    EXPECT_EQ(verdict.fate, Fate::refused) << name << ": " << verdict.line;
    for (const std::string& word : words)
        EXPECT_NE(verdict.line.find(word), std::string::npos) << name << ": " << verdict.line << "\nlacks " << word;
}

void expect_loaded(const std::string& name, const std::vector<std::string>& arguments) {
    const Verdict verdict = judge(name, arguments);
    EXPECT_EQ(verdict.fate, Fate::loaded) << name << ": " << verdict.line;
}

}  // namespace halflight::test
