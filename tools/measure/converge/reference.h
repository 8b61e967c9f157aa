// The picture that errors are told against: made on demand, kept, continued.
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
    std::filesystem::path file;    // Maker::file: an .exr of scene-linear Rec.709
    int samples = 0;               // per pixel, of both halves together, at least; > 0 unless a file
    std::filesystem::path folder;  // where references are kept
};

struct Reference {
    std::string maker;   // "oracle", "gl" or the file
    std::string reason;  // a phrase: why this one
    std::filesystem::path file;
    std::uint64_t fingerprint = 0;  // 0: a file
    std::int64_t samples = 0;       // per pixel, of both halves; 0 where that is not known
    std::int64_t found = 0;         // of these, samples that were kept from earlier runs
    Seconds time;                   // of the others
    std::array<Picture, 2> halves;  // independent; a file is both
    Picture mean;
    bool halves_differ = true;   // else their noise is not known
    bool has_components = true;  // else those are empty
};

/// Whom Maker::automatic stands for, and why: the oracle, which shares no code with the engine, but for scenes of more
/// triangles than it should flatten.
std::pair<ReferenceOrder::Maker, std::string> choose_maker(const Scene& scene, ReferenceOrder::Maker wanted);

/// Adds samples [first, first + count) to one half, which must be independent of all others.
using AddSamples = std::function<Picture(int half, std::int64_t first, int count)>;
struct Portion {
    int largest = 1;         // samples of one call
    double save_every = 20;  // seconds
};
/// Continues what is kept at `path` until both halves have as many samples, and keeps it, also where `more` throws.
/// A damaged file is begun anew after note() has said so. Throws Error where more samples are wanted but could not be
/// kept; should that show only later, note() says it. progress() is given the share that is done, in [0, 1].
Halves continue_halves(const std::filesystem::path& path, std::uint64_t fingerprint, const View& view,
                       std::int64_t samples_of_each, const AddSamples& more, const Portion& portion,
                       const std::function<void(double)>& progress,
                       const std::function<void(const std::string&)>& note);

struct ReferenceHooks {
    Pulse pulse;
    std::function<void(double)> progress;
    std::function<void(const std::string&)> note;
};
/// gl(): the scene on the GPU, made when it is needed. Throws Error, also for a file of another size.
Reference make_reference(const ReferenceOrder& order, const Scene& scene, const View& view, const ColorConfig& colors,
                         const std::function<PreparedScene&()>& gl, const ReferenceHooks& hooks);

}  // namespace halflight::converge
