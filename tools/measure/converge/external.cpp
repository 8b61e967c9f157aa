#include "tools/measure/converge/external.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>

#include "engine/core/error.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"

namespace halflight::converge {
namespace {

constexpr std::uint64_t kMostSaid = 64 << 20;  // bytes of stdout or stderr

std::string quoted(const std::string& text) {
    std::string out = "'";
    for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
    return out + "'";
}

/// Names in braces that are no key stay as they are.
std::string filled(std::string command, const std::map<std::string, std::string>& values) {
    std::string out;
    for (std::size_t at = 0; at < command.size();) {
        const std::size_t end = command[at] == '{' ? command.find('}', at) : std::string::npos;
        const auto found = end == std::string::npos ? values.end() : values.find(command.substr(at + 1, end - at - 1));
        out += found == values.end() ? std::string(1, command[at]) : found->second;
        at = found == values.end() ? at + 1 : end + 1;
    }
    return out;
}

class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "halflight-XXXXXX").string();
        if (!mkdtemp(name.data())) throw Error(name, "cannot be made: {}", std::generic_category().message(errno));
        path_ = name;
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder() {
        std::error_code stays;
        std::filesystem::remove_all(path_, stays);
    }
    std::filesystem::path operator/(const char* name) const { return path_ / name; }

  private:
    std::filesystem::path path_;
};

struct Ended {
    int status = 0;  // as of wait()
    Seconds time;    // of the process and those that it has waited for
};

/// A command of the shell in a process group of its own, which does not outlive this.
class Process {
  public:
    Process(const std::string& command, const std::filesystem::path& out, const std::filesystem::path& err) {
        std::string shell = "sh", option = "-c", text = command;
        char* argv[] = {shell.data(), option.data(), text.data(), nullptr};
        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        constexpr int kNew = O_WRONLY | O_CREAT | O_TRUNC;
        posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out.c_str(), kNew, 0600);
        posix_spawn_file_actions_addopen(&files, STDERR_FILENO, err.c_str(), kNew, 0600);
        posix_spawnattr_t attributes;
        posix_spawnattr_init(&attributes);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
        posix_spawnattr_setpgroup(&attributes, 0);
        const int error = posix_spawnp(&id_, "sh", &files, &attributes, argv, environ);
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&files);
        if (error != 0) throw Error("sh", "cannot be started: {}", std::generic_category().message(error));
    }
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;
    ~Process() {
        if (id_ < 0) return;
        kill(-id_, SIGKILL);
        waitpid(id_, nullptr, 0);
    }

    Ended wait(const Pulse& pulse) {
        using namespace std::chrono_literals;
        for (Ended ended;; pulse()) {
            rusage used{};
            const pid_t found = wait4(id_, &ended.status, WNOHANG, &used);
            if (found < 0 && errno != EINTR)  // as where SIGCHLD is ignored
                throw Error("sh", "cannot be waited for: {}", std::generic_category().message(errno));
            if (found == id_) {
                kill(-std::exchange(id_, -1), SIGKILL);  // what it has left running
                const auto seconds = [](const timeval& t) {
                    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
                };
                ended.time = {watch_.seconds().wall, seconds(used.ru_utime) + seconds(used.ru_stime)};
                return ended;
            }
            std::this_thread::sleep_for(1ms);
        }
    }

  private:
    pid_t id_ = -1;
    CpuStopwatch watch_;
};

std::string last_line(const std::filesystem::path& file) {
    std::string text = read_file(file, kMostSaid);
    text.erase(text.find_last_not_of(" \r\n") + 1);
    return text.substr(text.find_last_of('\n') + 1);
}

/// What a renderer prints of itself, where it does.
Seconds told(const std::filesystem::path& out, Seconds time) {
    std::istringstream lines(read_file(out, kMostSaid));
    for (std::string line; std::getline(lines, line);) {
        const auto json = nlohmann::json::parse(line, nullptr, false);
        if (!json.is_object()) continue;
        const auto take = [&](const char* key, double& value) {
            if (json.contains(key) && json[key].is_number() && json[key] > 0) value = json[key];
        };
        take("seconds", time.wall);
        take("cpu_seconds", time.cpu);
    }
    return time;
}

class ExternalPainter final : public Painter {
  public:
    ExternalPainter(const External& external, const ExternalScene& scene, const View& view)
        : external_(external), view_(view) {
        if (external.command.find("{environment}") == std::string::npos && !scene.environment.black())
            throw Error(external.name, "its command lacks {environment}, and the scene has one");
        if (scene.camera.empty())
            throw Error(external.name, "can be told of a camera by its name alone, and this one has none");
        const std::filesystem::path environment = folder_ / "environment.exr";
        Image map = scene.environment.map;
        if (map.pixels.empty()) {
            map = Image(2, 1, 3);
            for (std::size_t i = 0; i < map.pixels.size(); ++i)
                map.pixels[i] = scene.environment.color[static_cast<glm::length_t>(i % 3)];
        }
        write_exr(environment, {{{"R", "G", "B"}, std::move(map)}}, {});
        values_ = {{"scene", quoted(std::filesystem::absolute(scene.file).string())},
                   {"camera", quoted(scene.camera)},
                   {"environment", quoted(environment.string())},
                   {"output", quoted(output_.string())},
                   {"width", std::to_string(view.width)},
                   {"height", std::to_string(view.height)},
                   {"bounces", std::to_string(view.bounces)}};
    }

    Painted paint(const Budget& budget, std::uint32_t seed, const Pulse& pulse) override {
        values_["samples"] = std::to_string(budget.samples);
        values_["seed"] = std::to_string(seed);
        const std::filesystem::path out = folder_ / "out", err = folder_ / "err";
        std::error_code none;
        std::filesystem::remove(output_, none);
        const Ended ended = Process(filled(external_.command, values_), out, err).wait(pulse);
        const std::string complaint = last_line(err), said = complaint.empty() ? last_line(out) : complaint;
        const std::string words = said.empty() ? "" : fmt::format("; it says: {}", said);
        if (WIFSIGNALED(ended.status))
            throw Error(external_.name, "was ended by signal {}{}", WTERMSIG(ended.status), words);
        if (WEXITSTATUS(ended.status) != 0)
            throw Error(external_.name, "exit status {}{}", WEXITSTATUS(ended.status), words);
        if (!std::filesystem::exists(output_)) throw Error(external_.name, "has written no picture{}", words);
        Painted painted{{}, told(out, ended.time)};
        painted.picture.samples = budget.samples;
        try {
            painted.picture.beauty = read_exr(output_).image({"R", "G", "B"});
        } catch (const Error& error) {
            throw Error(external_.name, "its picture cannot be used: {}{}", error.what(), words);
        }
        Image& beauty = painted.picture.beauty;
        if (beauty.width != view_.width || beauty.height != view_.height)
            throw Error(external_.name, "its picture is of {}x{} pixels, not of {}x{}", beauty.width, beauty.height,
                        view_.width, view_.height);
        for (float& value : beauty.pixels) {
            if (std::isfinite(value)) continue;
            value = 0;
            ++painted.picture.non_finite;
        }
        return painted;
    }

    std::vector<PassTime> passes(const Budget&, std::uint32_t, const Pulse&) override { return {}; }
    Seconds preparation() const override { return {}; }

  private:
    External external_;
    View view_;
    TemporaryFolder folder_;
    std::filesystem::path output_ = folder_ / "picture.exr";
    std::map<std::string, std::string> values_;
};

}  // namespace

void check_external(const External& external) {
    for (const char* needed : {"{output}", "{samples}", "{seed}"})
        if (external.command.find(needed) == std::string::npos)
            throw Error(external.name, "its command lacks {}", needed);
}

std::unique_ptr<Painter> external_painter(const External& external, const ExternalScene& scene, const View& view) {
    check_external(external);
    return std::make_unique<ExternalPainter>(external, scene, view);
}

}  // namespace halflight::converge
