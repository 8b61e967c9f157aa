// Fakes methods for tests of converge: their pictures have a known expectation and known noise.
#pragma once

#include <cmath>
#include <random>

#include "tools/measure/converge/measure.h"

namespace halflight::converge::test {

inline constexpr int kWidth = 40, kHeight = 30;

/// Parameters of a fake method. Its components have the expectations 0.1, 0.2, ...
struct Fake {
    float bias = 0;            // offset of the first component
    double noise = 0.3;        // standard deviation of one sample, per component
    double fixed_seconds = 0;  // seconds per picture, independent of its samples
    double sample_seconds = 1e-3;
    double decay = 0.5;  // exponent of the decrease of noise with samples
    double rare = 0;     // share of the pixels that have all the noise; 0: noise in all pixels
};

inline Picture fake_picture(const Fake& fake, int samples, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Picture picture;
    picture.samples = samples;
    picture.beauty = Image(kWidth, kHeight, 3);
    const auto noisy = static_cast<std::size_t>(fake.rare * kWidth * kHeight * 3);
    for (std::size_t c = 0; c < kComponents.size(); ++c) {
        picture.components[c] = Image(kWidth, kHeight, 3);
        for (std::size_t i = 0; i < picture.beauty.pixels.size(); ++i) {
            const double spread = noisy == 0 || i < noisy ? fake.noise / std::pow(samples, fake.decay) : 0;
            const double value =
                0.1 * static_cast<double>(c + 1) + (c == 0 ? fake.bias : 0.0f) + spread * normal(random);
            picture.components[c].pixels[i] = static_cast<float>(value);
            picture.beauty.pixels[i] += static_cast<float>(value);
        }
    }
    return picture;
}

class FakePainter final : public Painter {
  public:
    explicit FakePainter(const Fake& fake) : fake_(fake) {}
    Painted paint(const Budget& budget, std::uint32_t seed, const Pulse& pulse) override {
        pulse();
        const int samples =
            budget.seconds > 0 ? static_cast<int>(budget.seconds / fake_.sample_seconds) : budget.samples;
        const double seconds = fake_.fixed_seconds + fake_.sample_seconds * samples;
        return {fake_picture(fake_, samples, seed), {seconds, 2 * seconds}};
    }
    std::vector<PassTime> passes(const Budget&, std::uint32_t, const Pulse&) override {
        return {{"gbuffer: rasterize", 1, 1.0}, {"shadow rays: any hit", 1, 2.0}, {"continuation: vertex", 1, 5.0}};
    }
    Seconds preparation() const override { return {0.25, 0.5}; }

  private:
    Fake fake_;
};

/// Returns a reference of two independent, noisy halves.
inline Reference fake_reference(int samples) {
    Reference reference;
    reference.maker = "oracle";
    reference.reason = "it is a test";
    reference.samples = samples;
    PictureSums sums(kWidth, kHeight);
    for (std::uint32_t half = 0; half < 2; ++half) {
        reference.halves[half] = fake_picture({}, samples / 2, 1000000 + half);
        sums.add(reference.halves[half]);
    }
    reference.mean = sums.mean();
    return reference;
}

inline const Plan kPlan{{Method::plain, Method::oracle}, {{1, 0}, {4, 0}, {16, 0}, {64, 0}}, 8};

/// Measures two fake methods, named Method::plain and Method::oracle.
inline Measurement measure_fakes(const Fake& first, const Fake& second, const Plan& plan = kPlan,
                                 const Reference& reference = fake_reference(4096)) {
    std::vector<std::unique_ptr<Painter>> painters;
    painters.push_back(std::make_unique<FakePainter>(first));
    painters.push_back(std::make_unique<FakePainter>(second));
    return measure(plan, painters, reference, Clock::wall, {[] {}, [](double) {}});
}

}  // namespace halflight::converge::test
