// Checkpoints of a picture: the sums of its bands in files, from which a later run goes on to the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/stopwatch.h"

namespace halflight {

/// A band when it was saved.
struct SavedBand {
    int y = 0;                              // first row of the picture, pixels
    int rows = 0;                           // number of rows of the picture, pixels
    int samples = 0;                        // number of samples of each pixel, > 0
    int first_half = 0;                     // number of samples of the first half
    bool complete = false;                  // the band gets no further samples
    double seconds = 0;                     // time of the picture so far, earlier runs and other bands included
    std::vector<std::uint64_t> bad_values;  // BadValueSums of the picture so far
    std::vector<std::uint64_t> plan{};      // place in the plan of samples
};

/// Another process has the folder of a checkpoint open.
class CheckpointBusy : public Error {
    using Error::Error;
};

/// The checkpoint of one picture: a folder with a file for each band. Files appear complete or not at all. The folder
/// is locked while the object lives; the destructor removes an empty folder.
class Checkpoint {
  public:
    using Bytes = std::vector<std::byte>;

    enum class Use : std::uint8_t {
        go_on,  // makes the folder, or goes on from the files of earlier runs
        anew,   // makes the folder, and removes the files of earlier runs
        merge,  // reads the files of a folder, which must exist
    };

    /// Makes or opens the folder. fingerprint: text that tells scene, settings and frame apart (key_text.h). interval:
    /// seconds between two saves, > 0. wait: seconds to wait for another process that has the folder open. Throws
    /// CheckpointBusy if it keeps it, and Error if the folder cannot be written, and if a file is damaged or has
    /// another fingerprint.
    Checkpoint(std::filesystem::path folder, std::string fingerprint, double interval, Use use = Use::go_on,
               double wait = 5);
    Checkpoint(const Checkpoint&) = delete;
    Checkpoint& operator=(const Checkpoint&) = delete;
    ~Checkpoint();

    const std::filesystem::path& folder() const { return folder_; }
    /// Returns whether the interval has passed since the last save.
    bool due() const { return since_save_.seconds() >= interval_; }
    /// Returns the seconds of earlier runs.
    double earlier_seconds() const { return earlier_seconds_; }
    /// Returns the samples per pixel that earlier runs have saved, as a mean over `height` rows.
    double earlier_samples(int height) const;

    /// Returns the samples per pixel in the files, as a mean over `height` rows.
    double saved_samples(int height) const;
    /// Returns whether the files hold all samples of rows 0 to `height` - 1.
    bool complete(int height) const;

    /// Saves a band, whose arrays are number 0 to `arrays` - 1 of `array`. Sets SavedBand::seconds. If that fails,
    /// for example on a full disk, the last file of the band stays, and problem() says why.
    void save(SavedBand band, std::size_t arrays, const std::function<Bytes(std::size_t)>& array);
    /// Returns the last failure of save() for the first band that was not saved since; empty: none.
    std::string problem() const { return problems_.empty() ? std::string() : problems_.begin()->second; }
    /// Returns a band that an earlier run has saved; none if there is none. Calls `take` with each array, whose number
    /// is `arrays` of the band. Throws Error if the file is damaged, or if bands had another number of rows.
    std::optional<SavedBand> load(int y, int rows, const std::function<std::size_t(const SavedBand&)>& arrays,
                                  const std::function<void(std::size_t, Bytes)>& take) const;

    /// Removes all files and the folder, after the picture was written.
    void remove();
    /// Removes all files and a folder that is not open, unless another process has it open.
    static void discard(const std::filesystem::path& folder);

  private:
    std::filesystem::path file_of(int y) const;
    /// Returns the bands that have files, by their first rows. Throws Error for a file of another picture.
    std::map<int, SavedBand> bands() const;
    /// Returns advice for the user about a file that cannot be used.
    const char* advice() const;

    std::filesystem::path folder_;
    std::string fingerprint_;
    double interval_;
    Use use_;
    int lock_ = -1;  // descriptor of the folder
    std::map<int, SavedBand> earlier_;
    double earlier_seconds_ = 0;
    std::map<int, std::string> problems_;  // last failures of save(), by the first rows of bands
    Stopwatch watch_, since_save_;
};

}  // namespace halflight
