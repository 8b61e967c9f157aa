#include "tests/pass/rays/batches.h"

#include <numeric>

namespace halflight::test {

Image block_means(const Image& image, int side) {
    Image blocks(image.width / side, image.height / side, 3);
    for (int y = 0; y < blocks.height * side; ++y)
        for (int x = 0; x < blocks.width * side; ++x)
            for (int c = 0; c < 3; ++c)
                blocks.at(x / side, y / side)[c] += image.at(x, y)[c] / static_cast<float>(side * side);
    return blocks;
}

void Batches::add(const Image& image) {
    if (count_ == 0) {
        mean_ = Image(image.width, image.height, 3);
        squares_ = mean_;
    }
    ++count_;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const double deviation = image.pixels[i] - mean_.pixels[i];
        mean_.pixels[i] += static_cast<float>(deviation / count_);
        squares_.pixels[i] += static_cast<float>(deviation * (image.pixels[i] - mean_.pixels[i]));
    }
}

Estimate Batches::estimate() {
    variance_ = squares_;
    for (float& v : variance_.pixels) v /= static_cast<float>(count_ - 1);
    return {mean_, variance_, static_cast<double>(count_)};
}

double Batches::variance() const {
    const double sum = std::accumulate(squares_.pixels.begin(), squares_.pixels.end(), 0.0);
    return sum / (count_ - 1) / static_cast<double>(squares_.pixels.size());
}

}  // namespace halflight::test
