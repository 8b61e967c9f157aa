// Tests `halflight compare`: exit status, figures, missing layers, non-finite values, maps.
#include <cmath>
#include <limits>

#include "engine/core/metrics.h"
#include "engine/io/png.h"
#include "engine/io/tiff.h"
#include "tests/cli/command_test.h"
#include "tests/unit/io/exr_parts.h"
#include "tools/measure/common/flip.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;
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

class Compare : public CommandTest {
  protected:
    /// Writes colour, depth and ids; `offset` is added to red.
    std::string exr(const std::string& name, float offset, const ExrAttributes& attributes = {}) {
        Image color = picture(3, 0.5f);
        for (std::size_t i = 0; i < color.pixels.size(); i += 3) color.pixels[i] += offset;
        write_exr(file(name),
                  {{{"R", "G", "B"}, color},
                   {{"Z"}, picture(1, 4)},
                   {{"normal.X", "normal.Y", "normal.Z"}, picture(3, 0)},
                   {{"ids.material"}, ids(0x7fc00001u), ExrType::uint32}},
                  attributes);
        return file(name);
    }
    std::string png(const std::string& name, float value) {
        write_png(file(name), picture(3, value));
        return file(name);
    }
    static Outcome compare(const Strings& arguments, int status) {
        const Outcome outcome = run_program(words("compare", arguments));
        EXPECT_EQ(outcome.status, status) << outcome.out << outcome.err;
        EXPECT_EQ(outcome.err, "");
        return outcome;
    }
    static Json figures(const Strings& arguments, int status) {
        const Json json = Json::parse(compare(words(arguments, "--json"), status).out);
        EXPECT_EQ(json["exit_status"], status);
        return json;
    }
};

TEST_F(Compare, EqualPicturesAreEqual) {
    const std::string a = exr("a.exr", 0), b = exr("b.exr", 0);
    expect_has(compare({a, b}, 0).out, "\nsame\n");
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
    const Strings mse = words(a, b, "--metric mse");
    for (const char* none : {"", "--fail 0"})
        EXPECT_EQ(figures(words(mse, none), 2)["layers"][0]["metrics"]["mse"]["verdict"], "fail");
    EXPECT_EQ(figures(words(mse, "--fail 0.03"), 0)["verdict"], "within the thresholds");
    EXPECT_EQ(figures({a, a}, 0)["verdict"], "same");
    EXPECT_EQ(figures(words(mse, "--fail 0.02"), 2)["verdict"], "fail");
    compare(words(mse, "--warn 0.02"), 1);
    compare(words(mse, "--warn 0.02 --fail 0.0205"), 2);
    compare(words(a, b, "--fail mse=0.03,relmse=0.001"), 2);
    compare(words(a, b, "--fail 0,mse=0.03,relmse=1,flip=1"), 0);
    expect_has(compare(words(mse, "--fail 0.02"), 2).out, "fail: RGB: mse 0.0208333");
}

TEST_F(Compare, ADifferenceWhoseSquareUnderflowsCounts) {
    const auto tiny = [&](const char* name, float value) {
        Image image(kSide, kSide, 3);
        image.pixels[5] = value;
        write_exr(file(name), {{{"R", "G", "B"}, image}}, {});
        return file(name);
    };
    compare({tiny("a.exr", 1e-30f), tiny("b.exr", 0)}, 2);
    compare({file("a.exr"), file("b.exr"), "--fail", "0"}, 0);  // the mse is 0 as a float
}

TEST_F(Compare, IdsAndMissingLayersFailWhateverTheThresholds) {
    const std::string a = exr("a.exr", 0);
    write_exr(file("b.exr"),
              {{{"R", "G", "B"}, picture(3, 0.5f)},
               {{"albedo.R", "albedo.G", "albedo.B"}, picture(3, 0)},
               {{"ids.material"}, ids(0x7fc00002u), ExrType::uint32}},
              {});
    const std::string b = file("b.exr");
    const Outcome outcome = compare({a, b, "--fail", "9"}, 2);
    expect_has(outcome.out, "missing in " + a + ": albedo\n");
    expect_has(outcome.out, "missing in " + b + ": Z, normal\n");
    expect_has(outcome.out, "fail: ids.material: ids differ\n");
    compare({a, b, "--layer", "RGB"}, 0);
    compare({a, b, "--layer", "RGB,ids.material", "--fail", "9"}, 2);
}

TEST_F(Compare, WholeNumbersCompareWithFloatsByValue) {
    const auto write = [&](const char* name, ExrType type, std::uint32_t id, float blue) {
        const Image number = type == ExrType::uint32 ? ids(id) : picture(1, 0);
        Image red = number;
        if (type != ExrType::uint32) std::ranges::fill(red.pixels, static_cast<float>(id));
        Image rest(kSide, kSide, 1);
        std::ranges::fill(rest.pixels, blue);
        write_exr(file(name), {{{"part.R"}, red, type}, {{"part.G"}, rest}, {{"part.B"}, rest}}, {});
        return file(name);
    };
    const std::string whole = write("whole.exr", ExrType::uint32, 7, 1),
                      real = write("real.exr", ExrType::float32, 7, 1),
                      other = write("other.exr", ExrType::uint32, 8, 1),
                      blue = write("blue.exr", ExrType::uint32, 7, 2);
    EXPECT_EQ(figures({whole, other, "--fail", "9"}, 2)["layers"].size(), 3u) << "floats beside them are layers";
    EXPECT_EQ(figures({whole, blue, "--fail", "9"}, 0)["layers"][0]["metrics"]["mse"]["value"], 1);
    EXPECT_EQ(figures({whole, real, "--fail", "9"}, 2)["missing_in_image"], Json::array({"part"}));
    write_exr(file("a.exr"), {{{"id"}, ids(7), ExrType::uint32}}, {});
    Image seven(kSide, kSide, 1);
    std::ranges::fill(seven.pixels, 7.0f);
    write_exr(file("b.exr"), {{{"id"}, seven}}, {});
    EXPECT_EQ(figures({file("a.exr"), file("b.exr")}, 0)["verdict"], "same");
}

TEST_F(Compare, JsonTellsWhatCannotBeCompared) {
    const std::string a = exr("a.exr", 0);
    write_exr(file("small.exr"), {{{"R", "G", "B"}, Image(4, 4, 3)}}, {});
    const auto told = [&](int status, const Strings& arguments) {
        const Outcome outcome = run_program(words("compare", a, arguments, "--json"));
        EXPECT_EQ(outcome.status, status) << outcome.err;
        const Json json = Json::parse(outcome.out);
        EXPECT_EQ(json["exit_status"], status);
        EXPECT_EQ(json["verdict"], status == 3 ? "sizes differ" : "file error");
        expect_has(outcome.err, json["reason"].get<std::string>());
    };
    told(3, {file("small.exr")});
    told(4, {file("none.exr")});
    told(4, {png("a.png", 0.5f)});
    told(4, {a, "--layer", "fog"});
    told(4, {a, "--fail", "max=1"});
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
        write_exr(file(name), {{{"CryptoObject00.R", "CryptoObject00.G"}, image}}, attributes);
        return file(name);
    };
    const std::string a = matte("a.exr", 0x248bfa47), same = matte("same.exr", 0x248bfa47),
                      other = matte("other.exr", 0x248bfa48);
    compare({a, same}, 0);
    expect_has(compare({a, other, "--fail", "9"}, 2).out, "CryptoObject00.R: ids differ");
}

TEST_F(Compare, NonFinitePixelsAreCountedAndExcluded) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    const auto with = [&](const char* name, float first, float second, float add) {
        Image image = picture(3, 0.5f + add);
        image.pixels[0] = first, image.pixels[99] = second;
        write_exr(file(name), {{{"R", "G", "B"}, image}}, {});
        return file(name);
    };
    const std::string a = with("a.exr", nan, inf, 0.1f), b = with("b.exr", nan, inf, 0), c = with("c.exr", 0, inf, 0);
    const Json same = figures({a, b, "--fail", "9", "--map", file("map.exr")}, 0)["layers"][0];
    EXPECT_EQ(same["not_finite_pixels"], Json({2, 2}));
    EXPECT_NEAR(same["metrics"]["mse"]["value"], 0.01, 1e-6);  // only the finite pixels count
    const Json other = figures({b, c, "--fail", "9"}, 2)["layers"][0];
    EXPECT_EQ(other["not_finite_pixels"], Json({2, 1}));
    EXPECT_EQ(other["not_finite_alike"], false);
    const ExrFile map = read_exr(file("map.exr"));
    ASSERT_TRUE(map.find("RGB.mse") && map.find("RGB.flip") && map.find("RGB.relmse"));
    EXPECT_TRUE(std::isnan(map.find("RGB.mse")->values[0]) && std::isnan(map.find("RGB.mse")->values[33]));
    EXPECT_NEAR(map.find("RGB.mse")->values[1], 0.01, 1e-6);
}

TEST_F(Compare, MapShowsWhere) {
    const std::string a = png("a.png", 0.5f);
    Image other = picture(3, 0.5f);
    for (int y = 0; y < kSide; ++y) std::fill_n(other.at(0, y), 3 * 4, 1.0f);  // the left quarter
    write_png(file("b.png"), other);
    const Outcome outcome = compare({file("b.png"), a, "--map", file("new/map.png")}, 2);
    expect_has(outcome.out, "map.png: RGB.flip from 0 to 1");
    const Image map = read_png("map", read_text(file("new/map.png")), 64);
    ASSERT_EQ(map.width, kSide);
    const auto light = [&](int x) { return map.at(x, 8)[0] + map.at(x, 8)[1] + map.at(x, 8)[2]; };
    EXPECT_GT(light(1), 4 * light(15) + 0.1f);
}

TEST_F(Compare, PixelsAreComparedByTheirPlace) {
    const auto placed_at = [&](const char* name, const ivec2& origin, const ivec2& display, const Image& image) {
        ExrAttributes attributes;
        attributes.origin = origin, attributes.display = display;
        write_exr(file(name), {{{"R", "G", "B"}, image}}, attributes);
        return file(name);
    };
    const ivec2 whole(32, 32);
    Image black(32, 32, 3);
    const Image inner = picture(3, 0.5f);
    for (int y = 0; y < kSide; ++y) std::copy_n(inner.at(0, y), 3 * kSide, black.at(4, y + 2));
    const std::string crop = placed_at("crop.exr", {4, 2}, whole, inner);
    const std::string moved = placed_at("moved.exr", {5, 2}, whole, inner);
    const Outcome outcome = compare({crop, moved}, 2);
    expect_has(outcome.out, crop + " has the pixels 4,2 to 20,18; " + moved + " has the pixels 5,2 to 21,18");
    const Json json = figures({crop, moved}, 2);
    EXPECT_EQ(json["width"], 17);
    EXPECT_EQ(json["windows"]["image"], Json({4, 2, 20, 18}));
    EXPECT_EQ(json["windows"]["reference"], Json({5, 2, 21, 18}));
    expect_has(json["windows"]["differences"], "the others count as 0");
    EXPECT_EQ(figures({crop, crop}, 0)["windows"]["differences"], "");
    compare({crop, placed_at("whole.exr", {0, 0}, whole, black)}, 0);  // missing pixels are 0
    refused(3, {"compare", crop, placed_at("wide.exr", {4, 2}, {33, 32}, inner)}, "32 x 32");
    // Files without windows have those of the other file.
    write_text(file("a.tif"), encode_tiff("a.tif", inner, TiffType::float32, "", kRec709));
    compare({crop, file("a.tif")}, 0);
}

TEST_F(Compare, PartsAreComparedInTheirOwnWindows) {
    const Imath::Box2i display({0, 0}, {3, 3}), far({-16000, -16000}, {-16000, -16000}), beside({4, 0}, {4, 0});
    const ExrPart colour{"a", display, {{"R", constant(1)}, {"G", constant(1)}, {"B", constant(1)}}};
    write_exr_parts(file("a.exr"), display, {colour, {"z", far, {{"Z", constant(2)}}}});
    compare({file("a.exr"), file("a.exr")}, 0);
    write_exr_parts(file("b.exr"), display, {colour, {"z", display, {{"Z", constant(2)}}}});
    write_exr_parts(file("c.exr"), display, {colour, {"z", beside, {{"Z", constant(2)}}}});
    const Outcome outcome = compare({file("b.exr"), file("c.exr"), "--map", file("map.exr")}, 2);
    expect_has(outcome.out, "c.exr has the pixels 4,0 to 5,1");
    expect_has(outcome.out, "fail: Z: ");
    EXPECT_EQ(read_exr(file("map.exr")).width, 5);
}

TEST_F(Compare, DeepPartsAreNotLeftOutSilently) {
    const Imath::Box2i window({0, 0}, {3, 3});
    const ExrPart flat{"flat", window, {{"Y", constant(1)}}}, deep{"fog", window, {{"Z", {}}}, true};
    write_exr_parts(file("a.exr"), window, {flat, deep});
    refused(4, {"compare", file("a.exr"), file("a.exr")}, "'fog'");
    compare({file("a.exr"), file("a.exr"), "--layer", "Y"}, 0);
}

TEST_F(Compare, IncompatiblePicturesAreAnError) {
    const std::string a = exr("a.exr", 0), b = png("b.png", 0.5f), same = exr("same.exr", 0);
    write_exr(file("small.exr"), {{{"R", "G", "B"}, Image(4, 4, 3)}}, {});
    ExrAttributes acescg;
    acescg.chromaticities = kAp1;
    const std::string other = exr("acescg.exr", 0, acescg), before = read_text(a);
    write_text(file("text"), "text");
    refused(3, {"compare", a, file("small.exr")}, "16 x 16");
    for (const auto& [arguments, element] :
         {std::pair(Strings{b}, "display"),
          {{other}, "primaries"},
          {{file("no.exr")}, "no.exr: "},
          {{file("text")}, "text: "},
          {{folder.path}, folder.path.c_str()},
          {{a, "--layer", "beauty"}, "beauty"},
          {{a, "--metric", "mse", "--fail", "flip=0.1"}, "flip"},
          {{a, "--map", file("a.exr/map.png")}, "map.png: "},
          {{same, "--map", file("../" + folder.path.filename().string() + "/a.exr")}, "is both input and output"},
          {{same, "--map", same}, "is both input and output"}})
        refused(4, words("compare", a, arguments), element);
    EXPECT_EQ(read_text(a), before);
}

}  // namespace
}  // namespace halflight::test
