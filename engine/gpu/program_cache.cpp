#include "engine/gpu/program_cache.h"

#include <epoxy/egl.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/steps.h"
#include "engine/gpu/context.h"
#include "engine/gpu/device.h"

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

bool is(const char* variable, std::string_view value) {
    const char* const found = std::getenv(variable);
    return found != nullptr && found == value;
}

/// Returns whether another thread and context can do the driver's work.
bool can_work_ahead() {
    const auto* const renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    return renderer != nullptr && std::string_view(renderer).starts_with("llvmpipe") &&
           eglGetCurrentContext() != EGL_NO_CONTEXT &&
           std::thread::hardware_concurrency() > 1 && !is("LP_NUM_THREADS", "1") &&
           !is("MESA_SHADER_CACHE_DISABLE", "true");
}

}  // namespace

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
            for (Item& item : items_)
                if (item.state == State::waiting) item.state = State::taken;
        }
        thread_.join();
    }

    /// Returns the program of the key. Returns null where the caller has to compile it, and from then on.
    std::unique_ptr<Program> take(const std::string& key) {
        // Mesa writes machine code to disk on a thread of its own, a few milliseconds after the dispatch.
        constexpr std::chrono::milliseconds kWriting{15};
        std::unique_lock lock(mutex_);
        const auto item = std::ranges::find(items_, key, &Item::key);
        if (item == items_.end()) return nullptr;
        const bool waits = item->state == State::running;
        changed_.wait(lock, [&] { return item->state != State::running; });
        item->state = State::taken;
        if (waits && item->program) std::this_thread::sleep_for(kWriting);
        return std::move(item->program);
    }

  private:
    enum class State : std::uint8_t { waiting, running, done, taken };
    struct Item {
        std::string key;
        ExpectedProgram wanted;
        State state = State::waiting;
        std::unique_ptr<Program> program = nullptr;
    };

    /// Returns whether the item waits no more because this thread compiles it now.
    bool claim(Item& item) {
        const std::lock_guard lock(mutex_);
        return item.state == State::waiting && (item.state = State::running, true);
    }
    void finish(Item& item, std::unique_ptr<Program> program) {
        const std::lock_guard lock(mutex_);
        item.program = std::move(program);
        item.state = State::done;
        changed_.notify_all();
    }

    void run() {
        try {
            const ExpectedProgram& first = items_.front().wanted;
            if (binaries_.has(program_text({first.source}, first.defines))) return;
            const EglContext context(display_, context_);
            const Buffer no_groups = Buffer::from("no groups", std::vector<std::uint32_t>(3, 0));
            glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, no_groups.id());
            for (Item& item : items_) {
                if (!claim(item)) continue;
                std::unique_ptr<Program> program;
                try {
                    program = std::make_unique<Program>(
                        Program::compute(item.wanted.source, item.wanted.defines, &binaries_));
                    item.wanted.bind(*program);
                    glUseProgram(program->id());
                    glDispatchComputeIndirect(0);
                } catch (const Error&) {
                    program = nullptr;  // the caller meets the error as well
                }
                finish(item, std::move(program));
            }
            gpu::finish();
        } catch (const Error&) {
            // Without another context, the caller compiles all.
        }
    }

    EGLDisplay display_;
    EGLContext context_;
    const ProgramBinaries& binaries_;
    std::vector<Item> items_;
    std::mutex mutex_;  // guards states and programs of items
    std::condition_variable changed_;
    std::thread thread_;
};

ProgramCache::ProgramCache(const ProgramBinaries* binaries) : binaries_(binaries) {}
ProgramCache::~ProgramCache() = default;

std::unique_ptr<Program> ProgramCache::made(const std::string& key, const Entry& entry) {
    begin_step("compiling shaders");
    std::unique_ptr<Program> program;
    seconds_ += timed([&] {
        if (ahead_) program = ahead_->take(key);
        if (program) return;
        program = std::make_unique<Program>(
            entry.stages.size() == 1 ? Program::compute(entry.stages[0], entry.defines, binaries_)
                                     : Program::graphics(entry.stages[0], entry.stages[1], entry.defines, binaries_));
    });
    end_step();
    return program;
}

template <class... Stages>
const Program& ProgramCache::get(const Defines& defines, const Stages&... stages) {
    std::string key = key_of(defines, stages...);
    if (const auto found = entries_.find(key); found != entries_.end()) return *found->second.program;
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
    if (binaries_ == nullptr || !can_work_ahead()) return;
    std::vector<std::pair<std::string, ExpectedProgram>> fresh;
    for (ExpectedProgram& program : programs) {
        std::string key = key_of(program.defines, program.source);
        const bool known = entries_.contains(key) ||
                           std::ranges::find(fresh, key, &std::pair<std::string, ExpectedProgram>::first) != fresh.end();
        if (!known) fresh.emplace_back(std::move(key), std::move(program));
    }
    if (fresh.size() < 2) return;
    // Programs with the most defines take the longest, and are the least likely to be stored.
    std::ranges::stable_sort(fresh, std::ranges::greater{},
                             [](const auto& each) { return each.second.defines.values().size(); });
    ahead_ = std::make_unique<Ahead>(std::move(fresh), *binaries_);
}

void ProgramCache::end_ahead() {
    ahead_.reset();
}

std::size_t ProgramCache::reload() {
    std::vector<std::pair<Program*, std::unique_ptr<Program>>> changed;
    for (const auto& [key, entry] : entries_)
        if (program_text(entry.stages, entry.defines) != entry.program->text())
            changed.emplace_back(entry.program.get(), made(key, entry));
    for (auto& [old, program] : changed) *old = std::move(*program);
    return changed.size();
}

}  // namespace halflight::gpu
