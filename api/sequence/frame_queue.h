// Makes the frames of a sequence in an order that processes share.
#pragma once

#include <cstddef>
#include <exception>
#include <set>
#include <vector>

#include "api/sequence/frame_maker.h"

namespace halflight {

/// Makes the frames of `todo`. A movie gets all frames in their order, existing ones included. Processes with the same
/// frames share them, unless frames depend on earlier ones of this process. Throws Stopped.
class FrameQueue {
  public:
    /// claims: claims of the frames; null: all are made by this process.
    FrameQueue(const SequenceOptions& o, const SequenceEvents& events, const Log& log, const FrameFiles& files,
               FileClaims* claims)
        : options_(o), events_(events), log_(log), files_(files), claims_(claims) {}

    /// Makes the frames of `todo`, which are some of `frames`. maker: null if there are none. Throws Stopped, and Error
    /// if frames have failed.
    void make(const std::vector<FrameNumber>& frames, const std::vector<FrameNumber>& todo, FrameMaker* maker,
              Movie* movie, SequenceTally& tally);

  private:
    /// Throws Error if another process has written other files of a frame since frames_to_make() looked.
    void check_replaceable(FrameNumber frame) const;
    void add_failure_of(FrameNumber frame, const std::exception& error, SequenceTally& tally) const;

    const SequenceOptions& options_;
    const SequenceEvents& events_;
    const Log& log_;
    static constexpr std::size_t kRun = 8;  // frames of which another process is taken to make the next ones, too
    const FrameFiles& files_;
    FileClaims* const claims_;
    std::set<FrameNumber> open_;  // frames that are not made yet
    bool noted_ = false;
};

}  // namespace halflight
