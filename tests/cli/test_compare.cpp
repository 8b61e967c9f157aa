// Tests `halflight compare`: exit status, figures, missing layers, non-finite values, maps.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/core/metrics.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "tests/support/process.h"
#include "tools/measure/common/flip.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;
using Strings = std::vector<std::string>;
constexpr int kSide = 16;

Image picture(int channels, float value) {
    Image image(kSide, kSide, channels);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = value + 0.01f * static_cast<float>(i % 7);
    return image;
}

Image ids(std::uint32_t id) {
    Image image(kSide, kSide, 1);
    for (float& v : image.pixels) v = std::bit_cast<float>(id);
    return image;
}

class Compare : public testing::Test {
  protected:
    /// Writes colour, depth and ids; `offset` is added to red.
    std::string exr(const std::string& name, float offset, const ExrAttributes& attributes = {}) {
        Image color = picture(3, 0.5f);
        for (std::size_t i = 0; i < color.pixels.size(); i += 3) color.pixels[i] += offset;
        write_exr(folder / name,
                  {{{"R", "G", "B"}, color},
                   {{"Z"}, picture(1, 4)},
                   {{"normal.X", "normal.Y", "normal.Z"}, picture(3, 0)},
                   {{"ids.material"}, ids(0x7fc00001u), ExrType::uint32}},
                  attributes);
        return folder / name;
    }
    std::string png(const std::string& name, float value) {
        write_png(folder / name, picture(3, value));
        return folder / name;
    }
    Outcome compare(Strings arguments, int status) {
        arguments.insert(arguments.begin(), "compare");
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, status) << outcome.out << outcome.err;
        EXPECT_EQ(outcome.err.empty(), status < 3) << outcome.err;
        return outcome;
    }
    Json figures(Strings arguments, int status) {
        arguments.push_back("--json");
        const Json json = Json::parse(compare(arguments, status).out);
        EXPECT_EQ(json["exit_status"], status);
        return json;
    }
    /// Expects one line on stderr that contains `text`.
    void expect_error(const Strings& arguments, int status, const std::string& text) {
        const Outcome outcome = compare(arguments, status);
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    }

    TemporaryFolder folder;
};

TEST_F(Compare, EqualPicturesAreEqual) {
    const std::string a = exr("a.exr", 0), b = exr("b.exr", 0);
    EXPECT_NE(compare({a, b}, 0).out.find("\nsame\n"), std::string::npos);
    EXPECT_EQ(figures({a, b}, 0)["layers"].size(), 4u);
    compare({png("a.png", 0.5f), png("b.png", 0.5f)}, 0);
}

TEST_F(Compare, FiguresEqualThoseOfTheLibrary) {
    const std::string a = exr("a.exr", 0.25f), b = exr("b.exr", 0);
    const Json json = figures({a, b, "--metric", "mse,relmse,flip,max", "--ppd", "40"}, 2);
    const Json& rgb = json["layers"][0];
    ASSERT_EQ(rgb["layer"], "RGB");
    EXPECT_NEAR(rgb["metrics"]["mse"]["value"], 0.25 * 0.25 / 3, 1e-6);
    EXPECT_NEAR(rgb["metrics"]["max"]["value"], 0.25, 1e-6);
    const Image x = read_exr(a).image({"R", "G", "B"}), y = read_exr(b).image({"R", "G", "B"});
    EXPECT_NEAR(rgb["metrics"]["relmse"]["value"], mean_of(relative_squared_error_map(x, y)), 1e-7);
    EXPECT_NEAR(rgb["metrics"]["flip"]["value"], mean_of(hdr_flip_map(x, y, 40)), 1e-6);
    for (const auto& layer : json["layers"])
        EXPECT_EQ(layer["different_pixels"], layer["layer"] == "RGB" ? kSide * kSide : 0) << layer;
}

TEST_F(Compare, ThresholdsDecide) {
    const std::string a = exr("a.exr", 0.25f), b = exr("b.exr", 0);  // the mse is 0.0208
    const Strings mse{a, b, "--metric", "mse"};
    const auto with = [&](const Strings& more) {
        Strings all = mse;
        all.insert(all.end(), more.begin(), more.end());
        return all;
    };
    for (const Strings& none : {Strings{}, {"--fail", "0"}})
        EXPECT_EQ(figures(with(none), 2)["layers"][0]["metrics"]["mse"]["verdict"], "fail");
    EXPECT_NE(compare(with({"--fail", "0.03"}), 0).out.find("\nwithin the thresholds\n"), std::string::npos);
    EXPECT_EQ(figures(with({"--fail", "0.03"}), 0)["verdict"], "within the thresholds");
    EXPECT_EQ(figures({a, a}, 0)["verdict"], "same");
    EXPECT_EQ(figures(with({"--fail", "0.02"}), 2)["verdict"], "fail");
    compare(with({"--fail", "0.02"}), 2);
    compare(with({"--warn", "0.02"}), 1);
    compare(with({"--warn", "0.02", "--fail", "0.0205"}), 2);
    compare({a, b, "--fail", "mse=0.03,relmse=0.001"}, 2);
    compare({a, b, "--fail", "0,mse=0.03,relmse=1,flip=1"}, 0);
    const Outcome outcome = compare(with({"--fail", "0.02"}), 2);
    EXPECT_NE(outcome.out.find("fail: RGB: mse 0.0208333 is above 0.02"), std::string::npos) << outcome.out;
    expect_error(with({"--fail", "flip=0.1"}), 4, "flip: has a threshold");
}

TEST_F(Compare, ADifferenceWhoseSquareUnderflowsCounts) {
    const auto tiny = [&](const char* name, float value) {
        Image image(kSide, kSide, 3);
        image.pixels[5] = value;
        write_exr(folder / name, {{{"R", "G", "B"}, image}}, {});
        return (folder / name).string();
    };
    compare({tiny("a.exr", 1e-30f), tiny("b.exr", 0)}, 2);
    compare({folder / "a.exr", folder / "b.exr", "--fail", "0"}, 0);  // the mse is 0 as a float
}

TEST_F(Compare, IdsAndMissingLayersFailWhateverTheThresholds) {
    const std::string a = exr("a.exr", 0);
    write_exr(folder / "b.exr",
              {{{"R", "G", "B"}, picture(3, 0.5f)},
               {{"albedo.R", "albedo.G", "albedo.B"}, picture(3, 0)},
               {{"ids.material"}, ids(0x7fc00002u), ExrType::uint32}},
              {});
    const std::string b = folder / "b.exr";
    const Outcome outcome = compare({a, b, "--fail", "9"}, 2);
    EXPECT_NE(outcome.out.find("missing in " + a + ": albedo\n"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("missing in " + b + ": Z, normal\n"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("fail: ids.material: ids differ\n"), std::string::npos) << outcome.out;
    compare({a, b, "--layer", "RGB"}, 0);
    compare({a, b, "--layer", "RGB,ids.material", "--fail", "9"}, 2);
    expect_error({a, b, "--layer", "beauty"}, 4, "beauty: is a layer of neither picture");
}

// The Cryptomatte layers hold ids as floats, for which an error would be meaningless.
TEST_F(Compare, CryptomattesAreIds) {
    const auto matte = [&](const char* name, std::uint32_t id) {
        Image image(kSide, kSide, 2);
        for (std::size_t i = 0; i < image.pixels.size(); i += 2) {
            image.pixels[i] = std::bit_cast<float>(id);
            image.pixels[i + 1] = 1;
        }
        ExrAttributes attributes;
        attributes.extra["cryptomatte/3ae39a5/name"] = "CryptoObject";
        write_exr(folder / name, {{{"CryptoObject00.R", "CryptoObject00.G"}, image}}, attributes);
        return (folder / name).string();
    };
    const std::string a = matte("a.exr", 0x248bfa47), same = matte("same.exr", 0x248bfa47),
                      other = matte("other.exr", 0x248bfa48);
    compare({a, same}, 0);
    EXPECT_NE(compare({a, other, "--fail", "9"}, 2).out.find("CryptoObject00.R: ids differ"), std::string::npos);
}

TEST_F(Compare, NonFinitePixelsAreCountedAndExcluded) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    const auto with = [&](const char* name, float first, float second, float add) {
        Image image = picture(3, 0.5f + add);
        image.pixels[0] = first, image.pixels[99] = second;
        write_exr(folder / name, {{{"R", "G", "B"}, image}}, {});
        return (folder / name).string();
    };
    const std::string a = with("a.exr", nan, inf, 0.1f), b = with("b.exr", nan, inf, 0), c = with("c.exr", 0, inf, 0);
    const Json same = figures({a, b, "--fail", "9", "--map", folder / "map.exr"}, 0)["layers"][0];
    EXPECT_EQ(same["not_finite_pixels"], Json({2, 2}));
    EXPECT_NEAR(same["metrics"]["mse"]["value"], 0.01, 1e-6);  // only the finite pixels count
    const Json other = figures({b, c, "--fail", "9"}, 2)["layers"][0];
    EXPECT_EQ(other["not_finite_pixels"], Json({2, 1}));
    EXPECT_EQ(other["not_finite_alike"], false);
    const ExrFile map = read_exr(folder / "map.exr");
    ASSERT_TRUE(map.find("RGB.mse") && map.find("RGB.flip") && map.find("RGB.relmse"));
    EXPECT_TRUE(std::isnan(map.find("RGB.mse")->values[0]) && std::isnan(map.find("RGB.mse")->values[33]));
    EXPECT_NEAR(map.find("RGB.mse")->values[1], 0.01, 1e-6);
}

TEST_F(Compare, MapShowsWhere) {
    const std::string a = png("a.png", 0.5f);
    Image other = picture(3, 0.5f);
    for (int y = 0; y < kSide; ++y) std::fill_n(other.at(0, y), 3 * 4, 1.0f);  // the left quarter
    write_png(folder / "b.png", other);
    const Outcome outcome = compare({folder / "b.png", a, "--map", folder / "new/map.png"}, 2);
    EXPECT_NE(outcome.out.find("map.png: RGB.flip from 0 to 1"), std::string::npos) << outcome.out;
    const Image map = read_png("map", read_file(folder / "new/map.png", 1 << 20), 64);
    ASSERT_EQ(map.width, kSide);
    const auto light = [&](int x) { return map.at(x, 8)[0] + map.at(x, 8)[1] + map.at(x, 8)[2]; };
    EXPECT_GT(light(1), 4 * light(15) + 0.1f);
}

TEST_F(Compare, IncompatiblePicturesAreAnError) {
    const std::string a = exr("a.exr", 0), b = png("b.png", 0.5f);
    write_exr(folder / "small.exr", {{{"R", "G", "B"}, Image(4, 4, 3)}}, {});
    ExrAttributes acescg;
    acescg.chromaticities = kAp1;
    write_text(folder / "text", "text");
    expect_error({a, folder / "small.exr"}, 3, "is 16 x 16 pixels");
    expect_error({a, b}, 4, "display");
    expect_error({a, exr("c.exr", 0, acescg)}, 4, "primaries");
    expect_error({a, folder / "no.exr"}, 4, "no.exr: ");
    expect_error({a, folder / "text"}, 4, "neither");
    expect_error({a, folder.path}, 4, folder.path.string());
    expect_error({a}, 4, "REFERENCE: is missing");
    expect_error({a, a, "--metric", "psnr"}, 4, "--metric: there is no metric 'psnr'");
    expect_error({a, a, "--fail", "-1"}, 4, "--fail: expects a number");
    expect_error({a, a, "--ppd", "nan"}, 4, "--ppd: expects a number");
    expect_error({a, a, "--map", folder / "map.jpg"}, 4, "--map: is an .exr or a .png");
    expect_error({a, a, "--map", folder / "a.exr/map.png"}, 4, "a.exr/map.png: ");
    const std::string before = read_file(a, 1 << 20);
    expect_error({a, exr("d.exr", 0), "--map", folder / "../" / folder.path.filename() / "a.exr"}, 4,
                 "is both input and output");
    expect_error({folder / "d.exr", a, "--map", a}, 4, "is both input and output");
    EXPECT_EQ(read_file(a, 1 << 20), before);
}

}  // namespace
}  // namespace halflight::test
