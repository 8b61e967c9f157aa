#include "renderer/sample_queue.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/context.h"

namespace halflight {
namespace {

/// Upper limit of the values of a path and sample in one counter; a shadow ray has three for each of two lobes.
constexpr std::uint64_t kMostCounts = 64;

}  // namespace

SampleQueue::SampleQueue(std::size_t paths)
    : hits_bytes_(paths * sizeof(shared::Hit)),
      most_uncounted_(std::max<std::uint64_t>(std::numeric_limits<std::uint32_t>::max() / (kMostCounts * paths), 1)) {}

SampleQueue::~SampleQueue() {
    for (const Slot& slot : slots_) glDeleteSync(slot.fence);  // glDeleteSync ignores null
}

void SampleQueue::push(const gpu::Buffer* hits, Mattes* mattes) {
    Slot& slot = slots_[next_];
    slot.mattes = hits ? mattes : nullptr;
    if (hits) {
        if (!slot.hits) slot.hits.emplace("hits of camera rays", hits_bytes_);
        glCopyNamedBufferSubData(hits->id(), slot.hits->id(), 0, 0, static_cast<GLsizeiptr>(hits_bytes_));
    }
    slot.fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (!slot.fence) {  // a slot without a fence counts as empty, and its mattes would be lost
        gpu::check_not_lost("rendering");
        throw Error("rendering", "the driver failed to make a fence for a sample");
    }
    glFlush();  // software drivers begin their work here
    next_ = (next_ + 1) % kInFlight;
    retire(slots_[next_]);
    if (++uncounted_ >= most_uncounted_) read_bad_values();
}

void SampleQueue::wait() {
    for (std::size_t i = 0; i < kInFlight; ++i) retire(slots_[(next_ + i) % kInFlight]);
}

void SampleQueue::drain() {
    wait();
    if (uncounted_ > 0) read_bad_values();
}

void SampleQueue::reset() {
    for (Slot& slot : slots_) glDeleteSync(std::exchange(slot.fence, nullptr));
    bad_values_.clear();
    counted_.reset();
    uncounted_ = 0;
}

void SampleQueue::retire(Slot& slot) {
    if (!slot.fence) return;
    constexpr GLuint64 kSecond = 1'000'000'000;
    GLenum state = GL_TIMEOUT_EXPIRED;
    while (state == GL_TIMEOUT_EXPIRED) {
        state = glClientWaitSync(slot.fence, GL_SYNC_FLUSH_COMMANDS_BIT, kSecond);
        gpu::check_not_lost("rendering");
    }
    glDeleteSync(std::exchange(slot.fence, nullptr));
    if (state == GL_WAIT_FAILED) throw Error("rendering", "the driver failed to wait for a sample");
    if (slot.mattes) slot.mattes->add(slot.hits->read<shared::Hit>());
}

void SampleQueue::read_bad_values() {
    counted_.add(std::span<const std::uint32_t, kBadValueCounts>(bad_values_.read<std::uint32_t>()));
    bad_values_.clear();
    uncounted_ = 0;
}

}  // namespace halflight
