// Tests lights of all sizes, intensities and positions against closed forms.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/io/environment.h"
#include "engine/io/ies.h"
#include "tests/stiff/stiff.h"
#include "tests/support/error_message.h"
#include "tests/support/ies_files.h"

namespace halflight::test {
namespace {

constexpr float kAlbedo = 0.5f;

class Light : public StiffTest {
  protected:
    /// Returns a floor of 2 x 2 at y = 0.
    static Scene floor() {
        Scene scene;
        add_quad(scene, add_material(scene, diffuse_material(vec3(kAlbedo))), {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
        return scene;
    }
    /// Compares the radiance of a spot of the floor, by the engine and by the oracle, with the exact value.
    void expect_spot(const std::string& name, const Scene& scene, const dvec3& at, double size, double irradiance) {
        expect_both(name, scene, spot_camera(at, {0.3, 0.5, 0.6}, size), 16, 16, 1, kAlbedo / kPi * irradiance, 1e-3,
                    "1/1000 for what the spot's size and slant change");
    }
    /// Returns a room with a lamp of 1 cd above its floor, beside another closed room.
    static Scene two_rooms() {
        Scene rooms = closed_box(diffuse_material(vec3(kAlbedo)));
        add_box(rooms, 0, {3, -1, -1}, {5, 1, 1});
        add_lamp(rooms, LightType::point, {0, 0, 0}, 1);
        return rooms;
    }
    /// Expects the floor under the lamp of two_rooms() to have the radiance of this lamp.
    void expect_floor(const std::string& name, const Scene& scene, int size) {
        const Camera camera = look_at_camera({0, 0, 0}, {0, -1, 0}, {0, 0, -1}, 0.02);
        expect_mean("floor under a lamp, " + name, mean_of(picture(scene, camera, size, 1024, 1)), kAlbedo / kPi, 1e-3,
                    "1/1000 for the view's 0.02 rad");
    }
    static int add_lamp(Scene& scene, LightType type, const dvec3& at, float intensity) {
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.type = type;
        lamp.position = at;
        lamp.direction = {0, -1, 0};
        lamp.intensity = vec3(intensity);
        return static_cast<int>(scene.lights.size()) - 1;
    }
    /// Returns the radiance of a map by its definition in engine/scene/scene.h.
    static double looked_up(const Image& map, double u, double v) {
        const double x = u * map.width - 0.5, y = v * map.height - 0.5;
        const double i = std::floor(x), j = std::floor(y);
        const auto texel = [&](double column, double row) {
            const int c = (static_cast<int>(column) + map.width) % map.width;
            return double(*map.at(c, std::clamp(static_cast<int>(row), 0, map.height - 1)));
        };
        const double top = texel(i, j) + (x - i) * (texel(i + 1, j) - texel(i, j));
        const double bottom = texel(i, j + 1) + (x - i) * (texel(i + 1, j + 1) - texel(i, j + 1));
        return top + (y - j) * (bottom - top);
    }
};

TEST_F(Light, PassesNestedObjectsThatCastNoShadows) {
    for (const double far : {0.0, 1e6}) {
        Scene scene = floor();
        const int metal = add_material(scene, metal_material(vec3(0.9f), 0.5f));
        for (int i = 1; i <= 100; ++i) {
            const float r = 0.001f * static_cast<float>(i);
            add_box(scene, metal, {-r, 1 - r, -r}, {r, 1 + r, r});
            scene.instances.back().link_class = 63;
        }
        for (Instance& instance : scene.instances) instance.object_to_world[3].x = far;
        add_lamp(scene, LightType::point, {far, 1, 0}, 1);
        const std::string name = far > 0 ? " a million units away" : "";
        scene.lights[0].links.blockers = ~(std::uint64_t{1} << 63);
        expect_spot("a lamp in 100 boxes that cast no shadows" + name, scene, {far, 0, 0}, 0.01, 1);
    }
}

TEST_F(Light, StacksOfPanes) {
    // A sun shines through panes that are far above the floor, near each other, and doubled.
    struct Case {
        int panes;
        double cosine;
        float tint, gap;
    };
    for (const auto& [panes, cosine, tint, gap] : {Case{1, 1, 1, 1}, Case{2, 0.5, 0.3f, 1e-2f}, Case{30, 0.8, 1, 0.01f},
                                                   Case{200, 0.9, 1, 0.1f}, Case{1, 0.05, 1, 1}}) {
        Scene scene = floor();
        Material glass = glass_material(0);
        glass.thickness = 0;
        glass.base_color = vec4(vec3(tint), 1);
        const int pane = add_material(scene, glass);
        for (int i = 0; i < panes; ++i)
            add_quad(scene, pane, {-500, 3 + gap * static_cast<float>(i), -500}, {0, 0, 1000}, {1000, 0, 0});
        add_quad(scene, pane, {500, 3, -500}, {-1000, 0, 0}, {0, 0, 1000});  // the back of the first pane
        const int sun = add_lamp(scene, LightType::directional, dvec3(0), 1);
        scene.lights[static_cast<std::size_t>(sun)].direction = vec3(dvec3(std::sqrt(1 - cosine * cosine), -cosine, 0));
        const double passed = tint * (1 - (0.04 + 0.96 * std::pow(1 - cosine, 5)));
        expect_spot(fmt::format("sun through {} panes, cosine {}", panes, cosine), scene, dvec3(0), 0.1,
                    cosine * std::pow(passed, panes));
    }
}

TEST_F(Light, StacksOfSolidPanes) {
    // A sun shines straight through slabs: thin and thick, clear and dark, grazing, and of an infinite index.
    struct Case {
        int slabs;
        double cosine;
        float thickness, absorption, ior;
    };
    for (const auto& [slabs, cosine, thickness, absorption, ior] :
         {Case{1, 1, 0.01f, 0, 1.5f}, Case{3, 0.6, 1, 0.4f, 1.5f}, Case{60, 0.9, 0.02f, 0.1f, 1.1f},
          Case{1, 0.2, 1, 0.1f, 1.5f}, Case{1, 0.8, 1, 1, 1.5f}, Case{1, 0.8, 1, 0, kInfiniteIor}}) {
        Scene scene = floor();
        Material glass = glass_material(0, ior);
        glass.straight_shadows = true;
        glass.attenuation_color = vec3(std::exp(-1.0f));
        glass.attenuation_distance = absorption > 0 ? 1 / absorption : 0;
        const int slab = add_material(scene, glass);
        for (int i = 0; i < slabs; ++i) {
            const float bottom = 3 + 2 * thickness * static_cast<float>(i);
            add_box(scene, slab, {-500, bottom, -500}, {500, bottom + thickness, 500});
        }
        const int sun = add_lamp(scene, LightType::directional, dvec3(0), 1);
        const double sine = std::sqrt(1 - cosine * cosine);
        scene.lights[static_cast<std::size_t>(sun)].direction = vec3(dvec3(sine, -cosine, 0));
        const double n = std::min(double(ior), 999.0), below = std::sqrt(1 - sine * sine / (n * n));
        const double across = (cosine - n * below) / (cosine + n * below);
        const double along = (n * cosine - below) / (n * cosine + below);
        const double passed = 1 - (across * across + along * along) / 2;
        expect_spot(
            fmt::format("sun through {} slabs, cosine {}, {} per metre, index {}", slabs, cosine, absorption, ior),
            scene, dvec3(0), 0.1,
            cosine * std::pow(passed, 2 * slabs) * std::exp(-double(absorption) * double(thickness) * slabs / cosine));
    }
}

TEST_F(Light, GroupsOfAllIntensities) {
    // All lights have equal chances, so intensities change no random decision. Factors that are powers of two change no
    // bits but those of the exponents.
    const auto layers = [&](float lamp, float glow, Reuse reuse) {
        Scene scene = closed_box(diffuse_material(vec3(kAlbedo)));
        Material glowing = diffuse_material(vec3(kAlbedo));
        glowing.emission = vec3(glow);
        glowing.light_group = 1;
        add_box(scene, add_material(scene, glowing), {0.3f, -0.5f, -0.8f}, {0.5f, -0.2f, -0.5f});
        scene.lights[std::size_t(add_lamp(scene, LightType::point, {-0.4, 0.3, -0.3}, lamp))].light_group = 0;
        scene.light_groups = {"lamp", "glow", "rest"};
        RenderSettings settings = small_settings(camera_in_box(), 24, 24, 4, 4);
        settings.estimator = {.lights = LightChoice::uniform, .reuse = reuse};
        settings.aovs = {"light_lamp", "light_glow", "light_rest"};
        const RenderResult result = picture(scene, settings);
        return std::array{layer(result, "light_lamp.R"), layer(result, "light_glow.R")};
    };
    for (const Reuse reuse : {Reuse::off, Reuse::sixteen}) {
        const auto plain = layers(1, 1, reuse);
        // Hardware flushes denormal numbers to zero, and the light of the smallest factor would be one.
        const float least = context.software() ? 0x1p-100f : 0x1p-80f;
        const auto extreme = layers(0x1p66f, least, reuse);
        const double factors[] = {0x1p66, double{least}};
        for (const std::size_t g : {0u, 1u}) {
            Image scaled = plain[g];
            for (float& v : scaled.pixels) v = static_cast<float>(v * factors[g]);
            expect(
                fmt::format("light group of a factor of {:.0e} beside another, path reuse {}", factors[g], name(reuse)),
                pixels_that_differ(extreme[g], scaled), 0, "pixels", "the factor is a power of two");
            EXPECT_GT(brightest(plain[g]), 0);
        }
    }
}

TEST_F(Light, ShadowCatchersOfAllIntensities) {
    // The edge of the shadow of a box crosses the picture, which does not show the box.
    const auto alpha = [&](float intensity) {
        Scene scene = floor();
        scene.instances[0].catcher = true;
        add_box(scene, add_material(scene, diffuse_material(vec3(kAlbedo))), {-0.2f, 0.1f, -0.2f}, {0.2f, 0.3f, 0.2f});
        if (intensity > 0) add_lamp(scene, LightType::point, {0.1, 1, 0.2}, intensity);
        RenderSettings settings = small_settings(spot_camera({-0.3, 0, -0.3}, {-1, 1, -1}, 0.2), 24, 24, 4, 2);
        settings.transparent = true;
        const Image beauty = picture(scene, settings).beauty;
        std::vector<double> values;
        for (std::size_t i = 3; i < beauty.pixels.size(); i += 4) values.push_back(double{beauty.pixels[i]});
        return values;
    };
    const std::vector<double> plain = alpha(1);
    EXPECT_EQ(std::ranges::max(plain), 1);
    EXPECT_EQ(std::ranges::min(plain), 0);
    for (const float intensity : {1e-30f, 1e30f}) {
        const std::vector<double> scaled = alpha(intensity);
        double greatest = 0;
        for (std::size_t i = 0; i < plain.size(); ++i) greatest = std::max(greatest, std::abs(scaled[i] - plain[i]));
        expect(fmt::format("alpha of shadows of a lamp of {:.0e} cd", intensity), greatest, 1e-6, "",
               "rounding of the light of samples, whose quotient is alpha");
    }
    const std::vector<double> dark = alpha(0);
    expect("alpha of shadows without light", double(std::ranges::count_if(dark, [](double a) { return a != 0; })), 0,
           "pixels", "nothing is blocked");
}

TEST_F(Light, DarkBesideBright) {
    // There are two closed rooms. The camera is in the dim one; nearly all samples select lights of the other one.
    Scene scene;
    for (const float emission : {1e8f, 1.0f}) {
        Material glowing = diffuse_material(vec3(kAlbedo));
        glowing.emission = vec3(emission);
        const vec3 at(emission > 1 ? 5.0f : 0.0f, 0, 0);
        add_box(scene, add_material(scene, glowing), at - vec3(1), at + vec3(1));
    }
    expect_mean("glowing room beside one 10^8 times as bright", mean_of(picture(scene, camera_in_box(), 24, 64, 8)),
                2 * (1 - std::pow(0.5, 9)));

    Scene lamps = two_rooms();
    add_lamp(lamps, LightType::point, {4, 0, 0}, 1e8f);
    expect_floor("another one of 10^8 behind a wall", lamps, 16);

    Scene closed = two_rooms();
    closed.environment.color = vec3(1e8f);
    expect_floor("a sky of 10^8 outside of its closed room", closed, 16);
}

TEST_F(Light, ManyOfAllKinds) {
    // All lights contribute equally, except for spot lights that do not reach this place.
    constexpr double kEach = 0.01;
    Scene scene = floor();
    double exact = 0;
    for (int i = 0; i < 64; ++i) {
        const double turn = 2.4 * i, away = 0.02 * i, high = 0.5 + 0.02 * ((7 * i) % 64);
        const dvec3 at(away * std::cos(turn), high, away * std::sin(turn));
        const double square = glm::dot(at, at), cosine = high / std::sqrt(square);
        if (i % 2 == 0) {
            const double size = 0.01 + 0.001 * i;
            const vec3 corner(at), u(size, 0.3 * size, 0), v(0, 0.2 * size, size);
            const double of_one = polygon_irradiance(
                dvec3(0), {0, 1, 0}, {dvec3(corner), dvec3(corner + u), dvec3(corner + u + v), dvec3(corner + v)});
            const auto radiance = static_cast<float>(kEach / of_one);
            add_quad(scene, add_material(scene, light_material(vec3(radiance))), corner, u, v);
            exact += radiance * of_one;
            continue;
        }
        const bool spot = i % 4 == 3;
        const int lamp =
            add_lamp(scene, spot ? LightType::spot : LightType::point, at, static_cast<float>(kEach * square / cosine));
        PunctualLight& light = scene.lights[static_cast<std::size_t>(lamp)];
        light.inner_cone = 0.5f, light.outer_cone = 1.2f;
        if (i % 8 == 7) light.direction = {0, 1, 0};
        const double off = glm::dot(dvec3(light.direction), -at) / std::sqrt(square);
        const double inner = std::cos(double(light.inner_cone)), outer = std::cos(double(light.outer_cone));
        const double cone = spot ? std::clamp((off - outer) / (inner - outer), 0.0, 1.0) : 1;
        exact += double(light.intensity.x) * cosine / square * cone * cone;
    }
    expect_spot("64 squares, bulbs and spots", scene, dvec3(0), 0.01, exact);

    // The lamp is dim compared to 40 neighbours behind a wall, which nearly all samples select by power.
    Scene rooms = two_rooms();
    for (int i = 0; i < 40; ++i) add_lamp(rooms, LightType::point, {4, 0.02 * i - 0.4, 0}, 1e8f);
    expect_floor("40 others of 10^8 behind a wall", rooms, 64);
}

TEST_F(Light, OnePixelSun) {
    Scene scene = floor();
    Image& map = scene.environment.map = Image(64, 32, 3);
    scene.environment.color = vec3(1);
    std::fill(map.pixels.begin(), map.pixels.end(), 1.0f);
    std::fill_n(map.at(40, 6), 3, 1e6f);
    double irradiance = 0;
    constexpr int kSteps = 16;  // steps per texel
    const int columns = map.width * kSteps, rows = map.height / 2 * kSteps;
    for (int j = 0; j < rows; ++j) {
        const double theta = kPi / 2 * (j + 0.5) / rows;
        for (int i = 0; i < columns; ++i)
            irradiance += looked_up(map, (i + 0.5) / columns, theta / kPi) * std::cos(theta) * std::sin(theta);
    }
    irradiance *= 2 * kPi / columns * kPi / 2 / rows;
    expect_spot("one-pixel sun of 10^6 in an environment of 1", scene, dvec3(0), 0.1, irradiance);
}

TEST_F(Light, OneTexelOfALargeBlackMap) {
    Scene scene = floor();
    Image& map = scene.environment.map = Image(4096, 2048, 3);
    scene.environment.color = vec3(1);
    std::fill(map.pixels.begin(), map.pixels.end(), 0.0f);
    std::fill_n(map.at(1000, 512), 3, 1e6f);
    // Bilinear lookups make the texel a tent. Its directions are alike, so that its integral is that of a flat texel.
    const double theta = kPi * 512.5 / 2048, side = kPi / 2048;
    const double exact = kAlbedo / kPi * 1e6 * side * side * std::sin(theta) * std::cos(theta);
    expect_mean("one texel of 10^6 in a black map of 4096 x 2048",
                mean_of(picture(scene, spot_camera(dvec3(0), {0.3, 0.5, 0.6}, 0.1), 16, 256, 1)), exact, 1e-3,
                "1/1000 for the tent's extent");
}

TEST_F(Light, SmallestMaps) {
    Scene scene = floor();
    scene.environment.color = vec3(1);
    scene.environment.map = Image(1, 1, 3);
    std::fill_n(scene.environment.map.at(0, 0), 3, 2.0f);
    expect_spot("map of one texel", scene, dvec3(0), 0.1, 2 * kPi);

    std::fill_n(scene.environment.map.at(0, 0), 3, 0.0f);
    add_lamp(scene, LightType::point, {0, 0.5, 0}, 0.25f);
    expect_spot("lamp beside a black map", scene, dvec3(0), 0.001, 1);
}

TEST_F(Light, FewAtUnlikeDistances) {
    Scene scene = floor();
    add_lamp(scene, LightType::point, {0, 1e6, 0}, 1e12f);
    add_lamp(scene, LightType::point, {0, 0.5, 0}, 0.25f);
    add_lamp(scene, LightType::point, {0.3, 0.5, 0}, 0);
    add_lamp(scene, LightType::point, {0.9, 0, 0.9}, 1);  // on the floor
    // The oracle selects such lamps by power. The tree rounds the place of the near ones to 15 m.
    const Camera camera = spot_camera(dvec3(0), {0.3, 0.5, 0.6}, 0.001);
    expect_mean("lamps at 10^6 and 0.5, one of no power, and one on the floor",
                mean_of(picture(scene, camera, 16, 1024, 1)), kAlbedo / kPi * 2, 1e-3, "1/1000 for the spot's size");

    Scene many = floor();
    double exact = 0;
    for (int i = 0; i < 100'000; ++i) {
        const double turn = 2.4 * i, away = 0.0001 * i;
        const dvec3 at(away * std::cos(turn), 0.3 + 0.001 * (i % 100), away * std::sin(turn));
        add_lamp(many, LightType::point, at, 1e-4f);
        exact += double(1e-4f) * at.y / std::pow(glm::dot(at, at), 1.5);
    }
    expect_mean("100,000 lamps", mean_of(picture(many, camera, 16, 256, 1)), kAlbedo / kPi * exact, 1e-3,
                "1/1000 for the spot's size");
}

TEST_F(Light, BrokenEnvironments) {
    Image broken(8, 4, 3);
    std::fill(broken.pixels.begin(), broken.pixels.end(), 2.0f);
    const float values[] = {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, -1};
    for (int i = 0; i < 4; ++i) *broken.at(2 * i, i) = values[i];
    const TemporaryFolder folder;
    const std::filesystem::path file = folder / "broken.exr";
    write_exr(file, {{{"R", "G", "B"}, broken}}, {});
    Scene scene = floor();
    scene.environment = load_environment(file, scene.report);
    expect("map with a NaN, two infinities and a negative: texels not mended",
           4.0 - static_cast<double>(scene.report.environment_texels_repaired), 0, "texels", "four were put in");
    const RenderResult lit = picture(scene, spot_camera(dvec3(0), {0, 1, 0}, 1), 8, 16, 2);
    expect("the same: brightest pixel", brightest(lit.beauty), 2, "radiance", "nothing in the map is above 2");

    double taken = 0;
    for (const float value : values) {
        Scene raw = floor();
        raw.environment.color = vec3(1);
        raw.environment.map = Image(8, 4, 3);
        *raw.environment.map.at(1, 1) = value;
        taken += error_message([&] { picture(raw, camera_in_box(), 8, 1, 1); }).empty();
    }
    expect("scenes made by hand with such maps: rendered nevertheless", taken, 0, "scenes", "validate() refuses them");

    const Image black(8, 4, 3);
    write_exr(file, {{{"R", "G", "B"}, black}}, {});
    scene.environment = load_environment(file, scene.report);
    expect("all zero map: brightest pixel", brightest(rgb(picture(scene, camera_in_box(), 8, 4, 2).beauty)), 0,
           "radiance", "exact: no light");
    scene.environment.color = vec3(1);
    scene.environment.map = black;
    expect("all zero map made by hand: brightest pixel",
           brightest(rgb(picture(scene, camera_in_box(), 8, 4, 2).beauty)), 0, "radiance", "exact: no light");
}

TEST_F(Light, InThePlaneOfTheReceiver) {
    Scene scene;
    const int light = add_material(scene, light_material(vec3(1e6f)));
    const int grey = add_material(scene, diffuse_material(vec3(kAlbedo)));
    add_quad(scene, light, {-1, 0, -1}, {0, 0, 2}, {1, 0, 0});
    add_quad(scene, grey, {0, 0, -1}, {0, 0, 2}, {1, 0, 0});
    const Camera camera = spot_camera({0.5, 0, 0}, {0, 1, 0}, 0.99);
    expect("floor beside a light of 10^6 in its plane", brightest(rgb(picture(scene, camera, 32, 16, 4).beauty)), 0,
           "radiance", "exact: edge-on it covers no solid angle");

    // The scene is rotated, so that coordinates have rounding errors.
    for (Instance& i : scene.instances)
        i.object_to_world = dmat4(dvec4(0.8, 0.6, 0, 0), dvec4(-0.48, 0.64, 0.6, 0), dvec4(0.36, -0.48, 0.8, 0),
                                  dvec4(0.1, 0.2, 0.3, 1));
    const dmat4& m = scene.instances[0].object_to_world;
    const Camera tilted = spot_camera(dvec3(m * dvec4(0.5, 0, 0, 1)), dvec3(m[1]), 0.6);
    const double e = 0x1p-21;  // error of eight roundings of coordinates of about 1
    expect("the same, tilted", brightest(rgb(picture(scene, tilted, 32, 16, 1).beauty)), kAlbedo / kPi * 1e6 * e * 8,
           "radiance",
           "planes may differ by 2^-21 of the distance: so much of the light's solid angle, below pi, faces");

    Scene lying = floor();
    add_quad(lying, add_material(lying, light_material(vec3(1))), {-0.5f, 0, -0.5f}, {0, 0, 1}, {1, 0, 0});
    const Camera above = spot_camera(dvec3(0), {0.1, 1, 0.2}, 1.5);
    RenderSettings settings = small_settings(above, 32, 32, 8, 4);
    const RenderResult plain = picture(lying, settings);
    settings.culling = rays::Culling::compute;
    expect("light lying on the floor, coplanar: culling off and on",
           pixels_that_differ(picture(lying, settings).beauty, plain.beauty), 0, "pixels differ",
           "exact: ties go to the lower primitive");
}

TEST_F(Light, TouchingTheReceiver) {
    for (const double distance : {0.1, 1e-3, 1e-5}) {
        Scene scene = floor();
        add_quad(scene, add_material(scene, light_material(vec3(1))), {0, 0, -1}, {0, 1, 0}, {0, 0, 2});
        expect_spot(fmt::format("{:.0e} m from a glowing wall on the floor", distance), scene, {distance, 0, 0},
                    0.01 * distance,
                    polygon_irradiance({distance, 0, 0}, {0, 1, 0}, {{0, 0, -1}, {0, 1, -1}, {0, 1, 1}, {0, 0, 1}}));
    }
}

TEST_F(Light, SmallEmitters) {
    for (const double distance : {10.0, 1e-3}) {
        Scene scene = floor();
        const auto h = static_cast<float>(distance), s = 1e-4f;
        add_quad(scene, add_material(scene, light_material(vec3(1e9f))), {-s / 2, h, -s / 2}, {s, 0, 0}, {0, 0, s});
        const double a = s / 2;
        expect_spot(fmt::format("emitter of 10^-4 m at {} m", distance), scene, dvec3(0),
                    1e-2 * std::min(distance, 1.0),
                    1e9 * polygon_irradiance(dvec3(0), {0, 1, 0}, {{-a, h, -a}, {a, h, -a}, {a, h, a}, {-a, h, a}}));
    }
}

TEST_F(Light, NoArea) {
    Scene scene = floor();
    scene.environment.color = vec3(1);
    const int light = add_material(scene, light_material(vec3(1e6f)));
    const int line = add_quad(scene, light, {-1, 1, -1}, {2, 0, 0}, {0, 0, 2});
    scene.instances[static_cast<std::size_t>(line)].object_to_world[2] = dvec4(0);
    const Camera camera = spot_camera(dvec3(0), {0.3, 0.5, 0.6}, 0.1);
    expect_both("sky and a light flattened to a line", scene, camera, 16, 16, 2, kAlbedo);
}

TEST_F(Light, ManyTriangles) {
    constexpr int kSide = 224;
    Scene scene = floor();
    const int light = add_material(scene, light_material(vec3(1)));
    Mesh mesh;
    for (int j = 0; j <= kSide; ++j)
        for (int i = 0; i <= kSide; ++i)
            mesh.positions.emplace_back(static_cast<float>(i) / kSide - 0.5f, 1, static_cast<float>(j) / kSide - 0.5f);
    mesh.normals.assign(mesh.positions.size(), vec3(0, -1, 0));
    for (unsigned j = 0; j < kSide; ++j) {
        for (unsigned i = 0; i < kSide; ++i) {
            const unsigned a = j * (kSide + 1) + i, b = a + kSide + 1;
            mesh.triangles.insert(mesh.triangles.end(), {{a, a + 1, b}, {a + 1, b + 1, b}});
        }
    }
    mesh.triangle_material.assign(mesh.triangles.size(), static_cast<std::uint32_t>(light));
    scene.instances.push_back({"light", static_cast<int>(scene.meshes.size()), dmat4(1), kNone});
    scene.meshes.push_back(std::move(mesh));
    expect_spot(
        "10^5 emissive triangles that make one square", scene, dvec3(0), 0.01,
        polygon_irradiance(dvec3(0), {0, 1, 0}, {{-0.5, 1, -0.5}, {0.5, 1, -0.5}, {0.5, 1, 0.5}, {-0.5, 1, 0.5}}));
}

TEST_F(Light, Lamps) {
    Scene scene = floor();
    const int spot = add_lamp(scene, LightType::spot, {0, 2, 0}, 8);
    scene.lights[static_cast<std::size_t>(spot)].outer_cone = 0.3f;
    scene.lights[static_cast<std::size_t>(spot)].inner_cone = std::nextafter(0.3f, 0.0f);
    expect_spot("spot of equal cones: on its axis", scene, dvec3(0), 0.01, 8.0 / 4);
    const double edge = 2 * std::tan(0.3);
    expect("spot of equal cones: outside",
           brightest(rgb(picture(scene, spot_camera({1.05 * edge, 0, 0}, {0.3, 0.5, 0.6}, 0.02), 16, 16, 1).beauty)), 0,
           "radiance", "exact: beyond the outer cone");

    for (const double height : {1e-3, 1e-5}) {
        Scene close = floor();
        add_lamp(close, LightType::point, {0.3, height, -0.2}, static_cast<float>(height * height));
        expect_spot(fmt::format("lamp {:.0e} m above a floor of 2 m", height), close, {0.3, 0, -0.2}, 0.01 * height, 1);
    }
    Scene on = floor();
    add_lamp(on, LightType::point, {0, 0, 0}, 1e6f);
    expect("lamp in the floor's plane",
           brightest(rgb(picture(on, spot_camera(dvec3(0), {0, 1, 0}, 1), 31, 16, 2).beauty)), 0, "radiance",
           "exact: it shines along the floor");
}

TEST_F(Light, SizesOfLampsChangeNoIrradiance) {
    // The floor faces the lamp, which is wholly above it; a floor inside of a lamp sees the radiance I / (pi r^2) all
    // around.
    for (const double height : {1e-3, 1.0, 1e4})
        for (const double share : {1e-20, 1e-7, 2e-6, 1e-3, 0.5, 0.999, 3.0, 1e4}) {
            Scene scene = floor();
            const double radius = share * height, reach = std::max(radius, height);
            const int lamp = add_lamp(scene, LightType::point, {0, height, 0}, static_cast<float>(reach * reach));
            scene.lights[static_cast<std::size_t>(lamp)].radius = static_cast<float>(radius);
            expect_spot(fmt::format("lamp {} m above, radius {:.3g} m", height, radius), scene, dvec3(0),
                        0.01 * std::min(height, 1.0), 1);
        }
    for (const double angle : {1e-9, 1e-5, 0.00925, 0.7, 3.0}) {
        Scene scene = floor();
        scene.lights[static_cast<std::size_t>(add_lamp(scene, LightType::directional, dvec3(0), 1))].angle =
            static_cast<float>(angle);
        expect_spot(fmt::format("sun of {:.3g} rad", angle), scene, dvec3(0), 0.1, 1);
    }
}

TEST_F(Light, LampsThatTheCameraSees) {
    // The disc of a lamp or sun in the middle of a square view, of which it covers pi tan^2(half angle). The floor is
    // behind the camera.
    const auto expect_disc = [&](const std::string& name, const Scene& scene, double sine, double radiance) {
        const double radius = std::tan(std::asin(sine)), view = 5 * radius;
        const dvec3 eye = scene.cameras[0].camera_to_world[3];
        RenderSettings settings = small_settings(
            look_at_camera(eye, eye - dvec3(0, 0, 1), {0, 1, 0}, 2 * std::atan(view / 2)), 64, 64, 64, 0);
        settings.show_lamps = true;
        // Directions of floats are 6e-8 apart.
        expect_mean(name, mean_of(picture(scene, settings)), radiance * kPi * radius * radius / (view * view),
                    2e-3 + 2.4e-7 / sine, "2/1000 for even samples, and roundings of directions");
    };
    for (const double away : {1e-3, 1.0, 1e6})
        for (const double sine : {1e-5, 1e-3, 0.1, 0.9}) {
            Scene scene = floor();
            const int lamp = add_lamp(scene, LightType::point, {0, 1, -2 - away}, static_cast<float>(away * away));
            scene.lights[static_cast<std::size_t>(lamp)].radius = static_cast<float>(away * sine);
            scene.cameras = {look_at_camera({0, 1, -2}, {0, 1, -3}, {0, 1, 0}, 1)};
            const std::string name = fmt::format("lamp of {:.0e} m in {:.0e} m that is seen", away * sine, away);
            expect_disc(name, scene, sine, 1 / (kPi * sine * sine));
            if (away == 1)
                expect_disc(name + ", 10^6 m from the origin", moved(scene, {1e6, -3e5, 2e6}), sine,
                            1 / (kPi * sine * sine));
        }
    for (const double sine : {1e-5, 0.004625, 0.9}) {
        Scene scene = floor();
        scene.lights[static_cast<std::size_t>(add_lamp(scene, LightType::directional, dvec3(0), 1))].angle =
            static_cast<float>(2 * std::asin(sine));
        scene.lights[0].direction = {0, 0, 1};
        scene.cameras = {look_at_camera({0, 1, -2}, {0, 1, -3}, {0, 1, 0}, 1)};
        expect_disc(fmt::format("sun of sine {:.0e} that is seen", sine), scene, sine, 1 / (kPi * sine * sine));
    }
    // A wall ends in the middle of a lamp, and before its middle.
    Scene half;
    add_quad(half, add_material(half, light_material(vec3(0))), {-9, -9, -1}, {9, 0, 0}, {0, 18, 0});
    half.lights[static_cast<std::size_t>(add_lamp(half, LightType::point, {0, 0, -1}, 1))].radius = 0.1f;
    RenderSettings settings =
        small_settings(look_at_camera({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 2 * std::atan(0.2)), 64, 64, 64, 0);
    settings.show_lamps = true;
    // The half behind the wall's plane lies behind the front half, whose outline is before the plane.
    const double radius = std::tan(std::asin(0.1));
    expect_mean("lamp half in a wall", mean_of(picture(half, settings)),
                1 / (kPi * 0.01) * kPi * radius * radius / 0.16, 2e-3, "2/1000 for even samples");
    half.lights[0].position.z = -1.2;
    expect_mean("lamp behind a wall's edge", mean_of(picture(half, settings)),
                0.5 / (kPi * 0.01) * kPi * std::pow(std::tan(std::asin(0.1 / 1.2)), 2) / 0.16, 2e-3,
                "2/1000 for even samples");
}

TEST_F(Light, ProfilesOfAllIntensitiesAndDistances) {
    IesFile beam{.vertical = {0, 10, 10.01, 180}, .horizontal = {0}};
    for (const double height : {1e-3, 1.0, 1e4})
        for (const double candela : {1e-9, 1.0, 1e9}) {
            Scene scene = floor();
            beam.candela = [&](double v, double) { return v > 10 ? 0 : candela; };
            scene.light_profiles = {read_ies("beam.ies", beam.text())};
            PunctualLight& lamp = scene.lights[static_cast<std::size_t>(
                add_lamp(scene, LightType::point, {0, height, 0}, scene.light_profiles[0].candela))];
            lamp.profile = 0;
            set_profile_axes(lamp, dmat3(1));
            const std::string name = fmt::format("beam of {:.0e} cd, {} m above", candela, height);
            const double reach = std::min(height, 1.0);
            expect_spot(name, scene, dvec3(0), 0.01 * reach, candela / (height * height));
            if (height > 1) continue;  // the beam is wider than the floor
            const Camera beside =
                spot_camera({height * std::tan(glm::radians(11.0)), 0, 0}, {0.3, 0.5, 0.6}, 0.01 * reach);
            expect(name + ": beside it", brightest(rgb(picture(scene, beside, 16, 16, 1).beauty)), 0, "radiance",
                   "exact: the table is 0 there");
        }
    IesFile fine{.vertical = degrees(0, 180, 0.5), .horizontal = degrees(0, 360, 0.5)};
    fine.candela = [](double v, double h) { return 2 + std::cos(glm::radians(v)) * std::cos(glm::radians(h)); };
    Scene scene = floor();
    scene.light_profiles = {read_ies("fine.ies", fine.text())};
    PunctualLight& lamp = scene.lights[static_cast<std::size_t>(
        add_lamp(scene, LightType::point, {0.5, 1, 0}, scene.light_profiles[0].candela))];
    lamp.profile = 0;
    set_profile_axes(lamp, dmat3(1));
    const double v = std::atan(0.5), distance2 = 1.25;  // the spot lies on the side of 180 degrees
    expect_spot("table of 260281 directions", scene, dvec3(0), 0.01, (2 - std::cos(v)) * std::cos(v) / distance2);
}

TEST_F(Light, ManyLampsWithASize) {
    // About 10^5 lamps in a cube far above a floor and a mirror, of which a ray crosses about eight.
    constexpr int kSide = 46, kLamps = kSide * kSide * kSide;
    for (const bool mirror : {false, true}) {
        Scene scene;
        add_quad(scene, add_material(scene, mirror ? metal_material(vec3(1), 0) : diffuse_material(vec3(kAlbedo))),
                 {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
        const dvec3 eye(0, mirror ? 1 : 0, 0);
        double illuminance = 0;
        for (int i = 0; i < kLamps; ++i) {
            const dvec3 place = dvec3(i % kSide, i / kSide % kSide, i / (kSide * kSide)) / double(kSide - 1) - 0.5;
            PunctualLight& lamp = scene.lights.emplace_back();
            lamp.position = dvec3(0, 100, 0) + 10.0 * place;
            lamp.intensity = vec3(1e4f / kLamps);
            lamp.radius = 0.05f;
            const dvec3 way = lamp.position + eye;
            illuminance += double(lamp.intensity.r) / glm::dot(way, way) * (mirror ? 1 : glm::normalize(way).y);
        }
        if (!mirror) {
            expect_mean("97336 lamps above a floor",
                        mean_of(picture(scene, spot_camera(dvec3(0), {0.3, 0.5, 0.6}, 0.01), 16, 32, 1)),
                        kAlbedo / kPi * illuminance, 1e-3, "1/1000 for the spot's size");
            continue;
        }
        // The picture holds the mirror image of all lamps.
        const double view = 2 * std::tan(0.06);
        expect_mean("97336 lamps in a mirror",
                    mean_of(picture(scene, look_at_camera(eye, {0, 0, 0}, {0, 0, 1}, 0.12), 48, 16, 1)),
                    illuminance / (view * view), 4e-3, "4/1000 for the slant of the view");
    }
}

TEST_F(Light, PenumbrasOfASizeAndADistance) {
    // An edge cuts the disc of the light at t radii from its centre.
    const auto visible = [](double t) { return 0.5 + (std::asin(t) + t * std::sqrt(1 - t * t)) / kPi; };
    for (const double edge : {0.8, 2.0, 20.0})
        for (const double t : {-0.1, 0.4, 0.9}) {
            for (const bool is_sun : {true, false}) {
                Scene scene = floor();
                add_quad(scene, 0, {-100, static_cast<float>(edge), -100}, {0, 0, 200}, {100, 0, 0});
                // Seen from x on the floor, the edge is at the angle atan(x / edge) before the light's centre.
                const double half = 0.00465, lamp = 4 * edge;
                double x = t * edge * std::tan(half);
                if (is_sun) {
                    scene.lights[static_cast<std::size_t>(add_lamp(scene, LightType::directional, dvec3(0), 1))].angle =
                        static_cast<float>(2 * half);
                } else {
                    x /= 0.75;  // the lamp itself is at the angle atan(x / lamp)
                    scene
                        .lights[static_cast<std::size_t>(
                            add_lamp(scene, LightType::point, {0, lamp, 0}, static_cast<float>(lamp * lamp)))]
                        .radius = static_cast<float>(lamp * std::sin(half));
                }
                expect_spot(fmt::format("{} at {} radii from an edge {} m above", is_sun ? "sun" : "lamp", t, edge),
                            scene, {x, 0, 0}, 0.02 * edge * half, visible(t));
            }
        }
}

}  // namespace
}  // namespace halflight::test
