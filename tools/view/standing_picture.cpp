#include "tools/view/standing_picture.h"

#include <algorithm>
#include <utility>

#include "engine/settings/layers.h"

namespace halflight::view {
namespace {

const ExrLayer* find(const std::vector<ExrLayer>& layers, const std::string& name) {
    const auto found = std::ranges::find(layers, name, &ExrLayer::name);
    return found == layers.end() ? nullptr : &*found;
}

/// Numbers of samples of two parts of a pixel's samples.
struct Counts {
    double before, more;
};

/// Returns the value of a channel for all samples of a pixel.
float merged(LayerMerge merge, const Counts& n, float before, float more) {
    const double a{before}, b{more}, all = n.before + n.more;
    switch (merge) {
        case LayerMerge::mean:
            return static_cast<float>((n.before * a + n.more * b) / all);
        case LayerMerge::variance: {
            // One sample has no variance of its own; the other part then tells that of each sample.
            const double first = n.before > 1 ? n.before * n.before * a : n.before * n.more * b;
            const double second = n.more > 1 ? n.more * n.more * b : n.more * n.before * a;
            return static_cast<float>((first + second) / (all * all));
        }
        case LayerMerge::sum:
            return before + more;
        case LayerMerge::coverage:
        case LayerMerge::none:
            break;
    }
    return before;
}

}  // namespace

bool StandingPicture::has(const std::vector<std::string>& aovs) const {
    return std::ranges::all_of(aovs, [&](const std::string& name) { return find(picture_.aovs, name) != nullptr; });
}

int StandingPicture::least(const PixelWindow& window) const {
    std::uint32_t least = most_;
    const int width = picture_.beauty.width;
    for (int y = window.first.y; y < window.end.y; ++y) {
        const auto row = samples_.begin() + std::ptrdiff_t{y} * width;
        least = std::min(least, *std::min_element(row + window.first.x, row + window.end.x));
    }
    return static_cast<int>(least);
}

int StandingPicture::most(const PixelWindow& window) const {
    std::uint32_t most = 0;
    const int width = picture_.beauty.width;
    for (int y = window.first.y; y < window.end.y; ++y) {
        const auto row = samples_.begin() + std::ptrdiff_t{y} * width;
        most = std::max(most, *std::max_element(row + window.first.x, row + window.end.x));
    }
    return static_cast<int>(most);
}

void StandingPicture::lay_over(RenderResult& whole) const {
    const auto samples = static_cast<std::uint32_t>(whole.stats.samples);
    if (most_ <= samples) return;
    const auto copy = [&](const Image& from, Image& to) {
        const auto channels = static_cast<std::size_t>(to.channels);
        for (std::size_t i = 0; i < samples_.size(); ++i)
            if (samples_[i] > samples)
                std::copy_n(from.pixels.begin() + static_cast<std::ptrdiff_t>(i * channels), channels,
                            to.pixels.begin() + static_cast<std::ptrdiff_t>(i * channels));
    };
    copy(picture_.beauty, whole.beauty);
    for (ExrLayer& layer : whole.aovs)
        if (const ExrLayer* own = find(picture_.aovs, layer.name)) copy(own->image, layer.image);
}

void StandingPicture::take(RenderResult whole) {
    lay_over(whole);
    whole_ = static_cast<std::uint32_t>(whole.stats.samples);
    picture_ = std::move(whole);
    samples_.resize(picture_.beauty.pixels.size() / 4);
    for (std::uint32_t& samples : samples_) samples = std::max(samples, whole_);
    most_ = std::max(most_, whole_);
}

RenderResult StandingPicture::with(const RenderResult& part, const PixelWindow& window) const {
    RenderResult all;
    all.attributes = picture_.attributes;
    all.stats = picture_.stats;
    const double more = part.stats.samples;
    const auto merge = [&](LayerMerge how, const Image& before, const Image& added) {
        Image image = before;
        for (int y = window.first.y; y < window.end.y; ++y) {
            for (int x = window.first.x; x < window.end.x; ++x) {
                const auto pixel =
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
                const Counts counts{double(samples_[pixel]), more};
                const float* from = added.at(x - window.first.x, y - window.first.y);
                float* to = image.at(x, y);
                for (int c = 0; c < image.channels; ++c) to[c] = merged(how, counts, to[c], from[c]);
            }
        }
        return image;
    };
    all.beauty = merge(LayerMerge::mean, picture_.beauty, part.beauty);
    for (const ExrLayer& layer : part.aovs)
        if (const ExrLayer* own = find(picture_.aovs, layer.name))
            all.aovs.push_back(
                {own->channels, merge(find_aov(layer.name)->merge, own->image, layer.image), own->type, own->name});
    return all;
}

void StandingPicture::add(const RenderResult& part, const PixelWindow& window) {
    picture_ = with(part, window);
    for (int y = window.first.y; y < window.end.y; ++y)
        for (int x = window.first.x; x < window.end.x; ++x)
            samples_[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture_.beauty.width) +
                     static_cast<std::size_t>(x)] += static_cast<std::uint32_t>(part.stats.samples);
    most_ = std::max(most_, static_cast<std::uint32_t>(most(window)));
}

}  // namespace halflight::view
