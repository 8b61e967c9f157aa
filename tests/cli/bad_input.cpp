#include "tests/cli/bad_input.h"

#include <fmt/format.h>

#include <csignal>
#include <cstdlib>
#include <map>
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

/// Limit of CPU time, seconds. With sanitizers it is four times as long, as those of whole tests are
/// (tests/CMakeLists.txt).
#ifdef HALFLIGHT_SANITIZED
constexpr double kMaxCpuSeconds = 40;
#else
constexpr double kMaxCpuSeconds = 10;
#endif
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;  // limit of resident memory, bytes

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

Verdict judge(const std::string& name, const Strings& arguments) {
    const Outcome outcome = run_program(arguments, limited());
    if (outcome.status == 127) throw std::runtime_error("the program cannot be run");  // prlimit's own status
    Verdict verdict{fate_of(outcome), outcome.err};
    while (verdict.line.ends_with('\n')) verdict.line.pop_back();
    records().add(name, verdict, outcome);
    return verdict;
}

Strings with_scene(const std::string& scene) {
    return words("render", scene, records().picture("exr"), "--width 4 --height 4 --samples 1 --bounces 1 --quiet");
}

Strings with_environment(const std::string& map) {
    return words(with_scene(room()), "--env", map);
}

Strings with_config(const std::string& config) {
    return words(with_scene(room()), records().picture("png"), "--ocio", config);
}

std::vector<std::size_t> prefix_lengths(std::size_t size) {
    return {0, std::min<std::size_t>(20, size / 4), size - 1};
}

Strings reading(const Strings& arguments) {
    const auto quiet = std::ranges::find(arguments, "--quiet");
    for (const char* option : {"--ocio", "--memory"})
        if (std::ranges::count(arguments, option) > 0) return arguments;
    return words("info", arguments[1], Strings(quiet + 1, arguments.end()));
}

void expect_refused(const std::string& name, const Strings& arguments, const Strings& parts) {
    const Verdict verdict = judge(name, reading(arguments));
    EXPECT_EQ(verdict.fate, Fate::refused) << name << ": " << verdict.line;
    for (const std::string& part : parts)
        EXPECT_TRUE(has(verdict.line, part)) << name << ": " << verdict.line << "\nlacks " << part;
}

void expect_loaded(const std::string& name, const Strings& arguments) {
    const Verdict verdict = judge(name, arguments);
    EXPECT_EQ(verdict.fate, Fate::loaded) << name << ": " << verdict.line;
}

}  // namespace halflight::test
