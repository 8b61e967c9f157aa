// Makes the reference picture of all errors, or continues one from the cache.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "tools/measure/converge/painter.h"
#include "tools/measure/converge/reference_file.h"

namespace halflight::converge {

struct ReferenceOrder {
    enum class Maker : std::uint8_t { automatic, oracle, gl, file };
    Maker maker = Maker::automatic;
    std::filesystem::path file;    // file for Maker::file: an .exr in scene-linear Rec.709
    int samples = 0;               // minimum samples per pixel, both halves together; > 0 except for a file
    std::filesystem::path folder;  // cache of references
};

struct Reference {
    std::string maker;   // "oracle", "gl" or the file
    std::string reason;  // phrase that explains the choice of the maker
    std::filesystem::path file;
    std::uint64_t fingerprint = 0;  // fingerprint of the reference; 0 for a file
    std::int64_t samples = 0;       // samples per pixel, both halves together; 0: not known
    std::int64_t found = 0;         // number of these samples that earlier runs have made
    Seconds time;                   // time of the samples that this run has made
    std::array<Picture, 2> halves;  // halves, independent of each other; both are the same for a file
    Picture mean;
    bool halves_differ = true;   // false: the noise of the reference is not known
    bool has_components = true;  // false: components are empty
};

/// Returns "Halflight (oracle)", "Halflight (gl)" or the file.
std::string name_of(const Reference& reference);

/// Returns the maker and the reason for it. Maker::automatic becomes the oracle, which shares no code with the engine,
/// or the engine for scenes with more triangles than the oracle can flatten.
std::pair<ReferenceOrder::Maker, std::string> choose_maker(const Scene& scene, ReferenceOrder::Maker wanted);

/// Returns the mean of samples [first, first + count) of one half, which must be independent of all other samples.
using AddSamples = std::function<Picture(int half, std::int64_t first, int count)>;
struct Portion {
    int largest = 1;         // maximum number of samples per call
    double save_every = 20;  // time between writes of the file, seconds
};
/// Continues the halves in the file `path` until each has `samples_of_each`, and saves them, also if `more` throws.
/// A damaged file is replaced after a call of note(). Throws Error if more samples are wanted and the file cannot be
/// written; reports later failures to write it by note(). Calls progress() with the finished share, in [0, 1].
Halves continue_halves(const std::filesystem::path& path, std::uint64_t fingerprint, const View& view,
                       std::int64_t samples_of_each, const AddSamples& more, const Portion& portion,
                       const std::function<void(double)>& progress,
                       const std::function<void(const std::string&)>& note);

struct ReferenceHooks {
    Pulse pulse;
    std::function<void(double)> progress;
    std::function<void(const std::string&)> note;
};
/// Makes the reference. gl() returns the scene on the GPU and is called only when it is needed. Throws Error, also for
/// a file of another size.
Reference make_reference(const ReferenceOrder& order, const Scene& scene, const View& view, const ColorConfig& colors,
                         const std::function<PreparedScene&()>& gl, const ReferenceHooks& hooks);

}  // namespace halflight::converge
