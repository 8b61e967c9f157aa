#include "tests/support/image_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <vector>

namespace halflight::test {
namespace {

/// Mean of a block, and its variance.
struct BlockMean {
    double mean = 0;
    double variance = 0;
};

BlockMean block_mean(const Estimate& e, int x0, int y0, int block, int channel) {
    const int x1 = std::min(x0 + block, e.mean.width), y1 = std::min(y0 + block, e.mean.height);
    BlockMean sum;
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            sum.mean += e.mean.at(x, y)[channel];
            sum.variance += e.variance.at(x, y)[channel] / e.samples;
        }
    }
    const double count = static_cast<double>(x1 - x0) * (y1 - y0);
    return {sum.mean / count, sum.variance / (count * count)};
}

/// Returns whether sums differ by rounding only: float32 sums of many samples depend on the order in their last bits.
bool same_but_for_rounding(double a, double b) {
    return std::abs(a - b) <= 0x1p-18 * std::max(std::abs(a), std::abs(b));
}

struct Total {
    double sum = 0;
    double variance = 0;  // variance of the sum, with channels fully correlated
};

Total total_of(const Estimate& e) {
    Total total;
    for (int y = 0; y < e.mean.height; ++y) {
        for (int x = 0; x < e.mean.width; ++x) {
            double deviation = 0;
            for (int c = 0; c < e.mean.channels; ++c) {
                total.sum += e.mean.at(x, y)[c];
                deviation += std::sqrt(e.variance.at(x, y)[c] / e.samples);
            }
            total.variance += deviation * deviation;
        }
    }
    return total;
}

void require_same_size(const Image& a, const Image& b) {
    if (a.width != b.width || a.height != b.height || a.channels != b.channels) {
        throw std::invalid_argument(fmt::format("images differ in size: {}x{}x{} and {}x{}x{}", a.width, a.height,
                                                a.channels, b.width, b.height, b.channels));
    }
}

/// Writes a portable float map: bottom row first, little-endian.
void write_pfm(const std::filesystem::path& path, const Image& image) {
    std::ofstream file(path, std::ios::binary);
    file << (image.channels == 3 ? "PF\n" : "Pf\n") << image.width << ' ' << image.height << "\n-1\n";
    for (int y = image.height - 1; y >= 0; --y) {
        for (int x = 0; x < image.width; ++x) {
            const int channels = image.channels == 3 ? 3 : 1;
            file.write(reinterpret_cast<const char*>(image.at(x, y)), channels * static_cast<int>(sizeof(float)));
        }
    }
    if (!file.flush()) throw std::runtime_error(fmt::format("{}: cannot write", path.string()));
}

unsigned char to_byte(double v) {
    return static_cast<unsigned char>(std::lround(255 * std::clamp(std::isnan(v) ? 0.0 : v, 0.0, 1.0)));
}

unsigned char encode_srgb(double v) {
    return to_byte(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

template <class Colour>
void write_ppm(const std::filesystem::path& path, const Image& image, const Colour& colour) {
    std::ofstream file(path, std::ios::binary);
    file << "P6\n" << image.width << ' ' << image.height << "\n255\n";
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            for (int c = 0; c < 3; ++c) file.put(static_cast<char>(colour(image.at(x, y), c)));
        }
    }
    if (!file.flush()) throw std::runtime_error(fmt::format("{}: cannot write", path.string()));
}

}  // namespace

double chi_square_tail(double x, double k) {
    const double s = 2 / (9 * k);
    return 0.5 * std::erfc((std::cbrt(x / k) - (1 - s)) / std::sqrt(2 * s));
}

ZTest compare_means(const Estimate& a, const Estimate& b, int block) {
    require_same_size(a.mean, b.mean);
    require_same_size(a.mean, a.variance);
    require_same_size(b.mean, b.variance);
    const int channels = a.mean.channels;
    ZTest test;
    test.z = Image((a.mean.width + block - 1) / block, (a.mean.height + block - 1) / block, channels);
    for (int c = 0; c < channels; ++c) {
        double squares = 0;
        std::size_t tested = 0;
        for (int y = 0; y < test.z.height; ++y) {
            for (int x = 0; x < test.z.width; ++x) {
                const BlockMean p = block_mean(a, x * block, y * block, block, c);
                const BlockMean q = block_mean(b, x * block, y * block, block, c);
                const double difference = p.mean - q.mean, variance = p.variance + q.variance;
                if (!(variance > 0)) {
                    const bool same = same_but_for_rounding(p.mean, q.mean);
                    ++(same ? test.untested : test.different);
                    test.z.at(x, y)[c] = same ? 0 : std::copysign(INFINITY, static_cast<float>(difference));
                    continue;
                }
                const double z = difference / std::sqrt(variance);
                test.z.at(x, y)[c] = static_cast<float>(z);
                test.above_2 += std::abs(z) > 2;
                test.above_3 += std::abs(z) > 3;
                test.greatest = std::max(test.greatest, std::abs(z));
                squares += z * z;
                ++tested;
            }
        }
        if (tested > 0) {
            const double p = chi_square_tail(squares, static_cast<double>(tested));
            test.p_value = std::isnan(p) ? 0 : std::min(test.p_value, p * channels);
        }
        test.tested += tested;
    }
    if (test.tested > 0) {
        test.above_2 /= static_cast<double>(test.tested);
        test.above_3 /= static_cast<double>(test.tested);
    }
    const Total p = total_of(a), q = total_of(b);
    if (q.sum != 0) {
        test.relative_difference = (p.sum - q.sum) / q.sum;
        test.relative_error = std::sqrt(p.variance + q.variance) / std::abs(q.sum);
    }
    return test;
}

ZTest compare_means(const Estimate& a, const Exact& b, int block) {
    const Image none(b.mean.width, b.mean.height, b.mean.channels);
    return compare_means(a, Estimate{b.mean, none}, block);
}

std::string describe(const ZTest& t) {
    return fmt::format(
        "{} z values: |z| > 2 {:.2f} % (chance: {:.2f}), |z| > 3 {:.2f} % (chance: {:.2f}), greatest {:.2f}, p = "
        "{:.3g}; "
        "mean differs by {:+.3f} % +- {:.3f} %; {} without variance, {} of them different",
        t.tested, 100 * t.above_2, 100 * kNormalAbove2, 100 * t.above_3, 100 * kNormalAbove3, t.greatest, t.p_value,
        100 * t.relative_difference, 100 * t.relative_error, t.untested + t.different, t.different);
}

std::string save_failure(const std::string& folder, const std::string& name, const Image& image, const Image& reference,
                         const Image& z) {
    const std::filesystem::path base = std::filesystem::path(folder) / name;
    std::filesystem::create_directories(base.parent_path());
    const auto path = [&](const char* suffix) { return base.string() + suffix; };
    const auto colour = [](int channels) {
        return [channels](const float* p, int c) { return encode_srgb(p[channels == 3 ? c : 0]); };
    };
    const auto diverging = [channels = z.channels](const float* p, int c) {
        float worst = 0;
        for (int i = 0; i < channels; ++i) worst = std::abs(p[i]) > std::abs(worst) ? p[i] : worst;
        const double s = std::min(std::abs(worst) / 4.0, 1.0);
        return to_byte(c == (worst > 0 ? 0 : 2) ? 1 : 1 - s);
    };
    write_pfm(path("-image.pfm"), image);
    write_pfm(path("-reference.pfm"), reference);
    write_pfm(path("-z.pfm"), z);
    write_ppm(path("-image.ppm"), image, colour(image.channels));
    write_ppm(path("-reference.ppm"), reference, colour(reference.channels));
    write_ppm(path("-z.ppm"), z, diverging);
    return fmt::format("see {0}-image.ppm, {0}-reference.ppm, {0}-z.ppm (and .pfm)", base.string());
}

std::string save_failure(const std::string& name, const Image& image, const Image& reference, const Image& z) {
    return save_failure(HALFLIGHT_FAILURE_DIR, name, image, reference, z);
}

::testing::AssertionResult agree(const std::string& name, const Estimate& a, const Estimate& b,
                                 const Agreement& limits) {
    const ZTest test = compare_means(a, b, limits.block);
    const double beyond_noise = std::abs(test.relative_difference) - 4 * test.relative_error;
    const bool fine = test.different == 0 && test.p_value >= limits.p_value && test.above_3 <= limits.above_3 &&
                      beyond_noise <= limits.relative_difference && !std::isnan(test.relative_difference);
    if (fine) return ::testing::AssertionSuccess() << describe(test);
    return ::testing::AssertionFailure() << name << ": " << describe(test) << "; "
                                         << save_failure(name, a.mean, b.mean, test.z);
}

}  // namespace halflight::test
