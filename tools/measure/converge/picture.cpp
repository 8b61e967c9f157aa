#include "tools/measure/converge/picture.h"

namespace halflight::converge {

PictureSums::PictureSums(int w, int h) : width(w), height(h) {
    for (auto& plane : sums) plane.resize(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 3);
}

void PictureSums::add(const Picture& picture) {
    samples += picture.samples;
    for (std::size_t c = 0; c < kComponents.size(); ++c) {
        const std::vector<float>& values = picture.components[c].pixels;
        for (std::size_t i = 0; i < values.size(); ++i) sums[c][i] += double{values[i]} * picture.samples;
    }
}

void PictureSums::add(const PictureSums& other) {
    samples += other.samples;
    for (std::size_t c = 0; c < kComponents.size(); ++c)
        for (std::size_t i = 0; i < sums[c].size(); ++i) sums[c][i] += other.sums[c][i];
}

Picture PictureSums::mean() const {
    Picture picture;
    picture.samples = static_cast<int>(samples);
    picture.beauty = Image(width, height, 3);
    const double scale = samples > 0 ? 1.0 / static_cast<double>(samples) : 0;
    for (auto& component : picture.components) component = Image(width, height, 3);
    for (std::size_t i = 0; i < picture.beauty.pixels.size(); ++i) {
        double beauty = 0;
        for (std::size_t c = 0; c < kComponents.size(); ++c) {
            picture.components[c].pixels[i] = static_cast<float>(sums[c][i] * scale);
            beauty += sums[c][i] * scale;
        }
        picture.beauty.pixels[i] = static_cast<float>(beauty);
    }
    return picture;
}

}  // namespace halflight::converge
