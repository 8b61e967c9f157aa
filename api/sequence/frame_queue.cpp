#include "api/sequence/frame_queue.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <thread>
#include <utility>

#include "api/halflight/frame_names.h"
#include "api/sequence/statistics_file.h"
#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/io/files.h"
#include "engine/io/png.h"

namespace halflight {
namespace {

/// Returns the picture that the movie would have shown. The .png is complete and made with these settings.
Image kept_view(const SequenceOptions& o, FrameNumber frame) {
    const auto png = std::ranges::find_if(o.outputs, [](const auto& path) { return has_extension(path, "png"); });
    const std::filesystem::path path = frame_path(*png, frame);
    return read_png(path.string(), read_file(path, std::uint64_t{1} << 40), kMaxSide);
}

/// Waits a moment for other processes.
void wait() {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
}

}  // namespace

void FrameQueue::make(const std::vector<FrameNumber>& frames, const std::vector<FrameNumber>& todo, FrameMaker* maker,
                      Movie* movie, SequenceTally& tally) {
    std::set<FrameNumber> missing(todo.begin(), todo.end());
    const std::vector<FrameNumber>& wanted = movie ? frames : todo;
    std::deque<FrameNumber> queue(wanted.begin(), wanted.end());
    open_ = missing;
    std::size_t passed = 0;  // number of claims in a row that other processes had
    std::size_t found = 0;   // number of frames that other processes have made
    while (!queue.empty()) {
        const FrameNumber frame = queue.front();
        tally.stopped_in = frame;
        if (passed >= (movie ? 1 : queue.size() + queue.size() / kRun)) wait();
        try {
            if (events_.go_on && !events_.go_on()) throw Stopped();
            if (missing.contains(frame) && claims_) {
                if (!claims_->take(frame)) {
                    if (!std::exchange(noted_, true)) log_.note("frame {}: another process makes it", frame);
                    // Processes take runs of frames, because frames that are denoised share their neighbours.
                    const bool skips = files_.denoises_near() && passed < queue.size() / kRun;
                    ++passed;
                    for (std::size_t i = 0; i < (movie ? 0 : skips ? kRun : 1); ++i)
                        queue.push_back(queue.front()), queue.pop_front();
                    continue;
                }
            }
            // Another process may have made the frame since frames_to_make() looked. A movie cannot show an .exr.
            if (missing.contains(frame)) {
                check_replaceable(frame);
                const bool shown = !movie || wants(options_, "png");
                if (claims_ && shown && files_.is_whole(frame)) {
                    missing.erase(frame), open_.erase(frame), ++tally.kept;
                    if (events_.found) events_.found(frame, ++found);
                }
            }
            passed = 0;
            queue.pop_front();
            if (missing.contains(frame))
                maker->make(frame, movie);
            else if (movie)
                movie->add(kept_view(options_, frame));
        } catch (const DiskError& error) {  // other frames would fail, too, after hours of rendering
            tally.failed.push_back(frame);
            if (events_.failed) events_.failed(frame, error.what());
            throw DiskError("", "{}: stopped in frame {}, {} of {} frames are there", error.what(), frame,
                            tally.kept + tally.made, tally.frames);
        } catch (const std::exception& error) {  // includes bad_alloc: other frames may need less memory
            if (!queue.empty() && queue.front() == frame) queue.pop_front();
            add_failure_of(frame, error, tally);
            if (options_.outputs.empty()) break;                       // the movie would have a gap
            if (dynamic_cast<const gpu::ContextLost*>(&error)) break;  // other frames would fail, too
            continue;
        }
        if (movie && movie->failed() && options_.outputs.empty()) break;
        if (!missing.contains(frame)) continue;
        ++tally.made;
        open_.erase(frame);
        if (claims_) files_.discard_exchanged({frame}, open_);
        if (events_.made) events_.made(frame, tally.made, tally.failed.size());
    }
    tally.stopped_in.reset();
    if (claims_) files_.discard_exchanged(frames, open_);
    if (!tally.failed.empty())
        throw Error(main_name(options_), "{} failed{}: {}",
                    frames_of_all(tally.failed, options_.frames.size(), options_.part),
                    options_.movie && !options_.outputs.empty() ? ", and there is no movie" : "", tally.reason);
}

void FrameQueue::check_replaceable(FrameNumber frame) const {
    if (options_.overwrite) return;
    if (const FrameFiles::State state = files_.examine(frame); state.other)
        throw Error(state.other->string(),
                    "was written meanwhile, and is not this frame of this scene with these settings and this "
                    "version: {}; --overwrite replaces it",
                    state.why);
}

void FrameQueue::add_failure_of(FrameNumber frame, const std::exception& error, SequenceTally& tally) const {
    const std::string what = dynamic_cast<const std::bad_alloc*>(&error) ? "there is not enough memory" : error.what();
    if (events_.failed) events_.failed(frame, what);
    log_.warn("frame {}: {}", frame, what);
    if (tally.failed.empty()) tally.reason = what;
    tally.failed.push_back(frame);
    if (options_.stats) add_failure(*options_.stats, frame, what, log_);
}

}  // namespace halflight
