#include "engine/gpu/program_cache.h"

#include <epoxy/egl.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "engine/core/steps.h"
#include "engine/gpu/context.h"
#include "engine/gpu/device.h"
#include "engine/gpu/driver_needs.h"
#include "engine/gpu/gl_string.h"

namespace halflight::gpu {
namespace {

/// Adds a source with its own text, if any, so that generated text is part of the key.
void add_to_key(std::string& key, const ShaderSource& source) {
    ((key += source.name) += '\0') += source.text;
    key += '\0';
}

void add_to_key(std::string& key, const Defines& defines) {
    for (const auto& [name, value] : defines.values()) {
        (((key += name) += '=') += value) += '\0';
    }
}

template <class... Stages>
std::string key_of(const Defines& defines, const Stages&... stages) {
    std::string key;
    (add_to_key(key, stages), ...);
    add_to_key(key, defines);
    return key;
}

/// Returns whether the driver may use one thread only.
bool has_one_thread() {
    const char* const asked = std::getenv("LP_NUM_THREADS");
    return std::thread::hardware_concurrency() < 2 || (asked != nullptr && std::string_view(asked) == "1");
}

}  // namespace

bool can_compile_ahead() {
    return gl_string(GL_RENDERER).starts_with("llvmpipe") && eglGetCurrentContext() != EGL_NO_CONTEXT &&
           !has_one_thread() && mesa_keeps_code();
}

/// Programs that a second thread compiles.
class ProgramCache::Ahead {
  public:
    Ahead(std::vector<std::pair<std::string, ExpectedProgram>> programs, const ProgramBinaries& binaries)
        : display_(eglGetCurrentDisplay()), context_(eglGetCurrentContext()), binaries_(binaries) {
        for (auto& [key, wanted] : programs) items_.push_back({std::move(key), std::move(wanted)});
        thread_ = std::thread([this] { run(); });
    }
    ~Ahead() {
        {
            const std::lock_guard lock(mutex_);
            ends_ = true;
        }
        changed_.notify_all();
        thread_.join();
    }

    /// Returns the program of the key. Returns null if the caller has to compile it, as for each later call with the
    /// key.
    std::unique_ptr<Program> take(const std::string& key) {
        std::unique_lock lock(mutex_);
        const auto item = std::ranges::find(items_, key, &Item::key);
        if (item == items_.end()) return nullptr;
        changed_.wait(lock, [&] { return item->state != State::running; });
        item->state = State::taken;
        std::unique_ptr<Program> program = std::move(item->program);
        lock.unlock();
        if (program) wait_for_mesa_code(item->cached, item->finished);
        return program;
    }

  private:
    enum class State : std::uint8_t { waiting, running, done, taken };
    struct Item {
        std::string key;
        ExpectedProgram wanted;
        State state = State::waiting;
        std::unique_ptr<Program> program = nullptr;
        std::chrono::steady_clock::time_point finished{};
        std::uint64_t cached = 0;  // mesa_cache_bytes() at that time
    };

    /// Returns whether this thread is to compile the item.
    bool claim(Item& item) {
        const std::lock_guard lock(mutex_);
        if (ends_ || item.state != State::waiting) return false;
        item.state = State::running;
        return true;
    }
    /// `program` is null if it could not be made.
    void finish(Item& item, std::unique_ptr<Program> program) {
        const std::lock_guard lock(mutex_);
        item.program = std::move(program);
        item.finished = std::chrono::steady_clock::now();
        item.cached = mesa_cache_bytes();
        item.state = State::done;
        changed_.notify_all();
    }
    /// Compiles a program. Returns null if that fails: the caller then meets the error as well.
    std::unique_ptr<Program> compiled(const ExpectedProgram& wanted) const {
        try {
            auto program = std::make_unique<Program>(Program::compute(wanted.source, wanted.defines, &binaries_));
            wanted.bind(*program);
            glUseProgram(program->id());
            glDispatchComputeIndirect(0);
            return program;
        } catch (const std::exception&) {
            return nullptr;
        }
    }

    void run() {
        try {
            const EglContext context(display_, context_);
            const Buffer no_groups = Buffer::from("no groups", std::vector<std::uint32_t>(3, 0));
            glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, no_groups.id());
            for (Item& item : items_)
                if (claim(item)) finish(item, compiled(item.wanted));
            gpu::finish();
            // The end of a context removes its code from all programs, which other threads must not use meanwhile.
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [&] { return ends_; });
        } catch (const std::exception&) {
            // Without another context, the caller compiles all.
        }
    }

    EGLDisplay display_;
    EGLContext context_;
    const ProgramBinaries& binaries_;
    std::vector<Item> items_;
    std::mutex mutex_;  // guards items' states and programs, and ends_
    bool ends_ = false;
    std::condition_variable changed_;
    std::thread thread_;
};

ProgramCache::ProgramCache(const ProgramBinaries* binaries) : binaries_(binaries) {}
ProgramCache::~ProgramCache() = default;

std::unique_ptr<Program> ProgramCache::made(const std::string& key, const Entry& entry) {
    begin_step("compiling shaders");
    std::unique_ptr<Program> program;
    bool compiled = true;
    const double seconds = timed([&] {
        if (ahead_) program = ahead_->take(key);
        if (program) return;
        const std::size_t misses = binaries_ ? binaries_->misses() : 0;
        program = std::make_unique<Program>(
            entry.stages.size() == 1 ? Program::compute(entry.stages[0], entry.defines, binaries_)
                                     : Program::graphics(entry.stages[0], entry.stages[1], entry.defines, binaries_));
        compiled = !binaries_ || binaries_->misses() > misses;
    });
    seconds_ += seconds;
    if (compiled) compile_seconds_ += seconds;
    end_step();
    return program;
}

template <class... Stages>
const Program& ProgramCache::get(const Defines& defines, const Stages&... stages) {
    std::string key = key_of(defines, stages...);
    if (const auto found = entries_.find(key); found != entries_.end()) {
        found->second.age = 0;
        return *found->second.program;
    }
    Entry entry{{stages...}, defines, nullptr};
    entry.program = made(key, entry);
    return *entries_.emplace(std::move(key), std::move(entry)).first->second.program;
}

const Program& ProgramCache::compute(const ShaderSource& source, const Defines& defines) {
    return get(defines, source);
}

const Program& ProgramCache::graphics(const ShaderSource& vertex, const ShaderSource& fragment,
                                      const Defines& defines) {
    return get(defines, vertex, fragment);
}

void ProgramCache::compile_ahead(std::vector<ExpectedProgram> programs) {
    end_ahead();
    if (binaries_ == nullptr || !can_compile_ahead()) return;
    std::vector<std::pair<std::string, ExpectedProgram>> fresh;
    for (ExpectedProgram& program : programs) {
        std::string key = key_of(program.defines, program.source);
        if (!entries_.contains(key) && tried_.insert(key).second)
            fresh.emplace_back(std::move(key), std::move(program));
    }
    if (fresh.size() < 2) return;
    // Programs with the most defines take the longest, and are the least likely to be stored.
    std::ranges::stable_sort(fresh, std::ranges::greater{},
                             [](const auto& each) { return each.second.defines.values().size(); });
    // The text depends on limits of the current context, so this thread looks.
    if (binaries_->has(program_text({fresh[0].second.source}, fresh[0].second.defines))) return;
    try {
        ahead_ = std::make_unique<Ahead>(std::move(fresh), *binaries_);
    } catch (const std::system_error&) {
        // Without another thread, the caller compiles all.
    }
}

void ProgramCache::end_ahead() {
    ahead_.reset();
}

void ProgramCache::end_period() {
    constexpr int kMostAge = 8;
    for (auto& [key, entry] : entries_) ++entry.age;
    remove_older(kMostAge);
}

void ProgramCache::remove_older(int age) {
    std::erase_if(entries_, [&](const auto& entry) {
        if (entry.second.age <= age) return false;
        tried_.erase(entry.first);
        return true;
    });
}

std::size_t ProgramCache::reload() {
    remove_older(0);
    std::vector<std::pair<Program*, std::unique_ptr<Program>>> changed;
    for (const auto& [key, entry] : entries_)
        if (program_text(entry.stages, entry.defines) != entry.program->text())
            changed.emplace_back(entry.program.get(), made(key, entry));
    for (auto& [old, program] : changed) *old = std::move(*program);
    return changed.size();
}

}  // namespace halflight::gpu
