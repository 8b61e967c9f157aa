#include "api/sequence/noisy_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <utility>

#include "api/picture/exr_attributes.h"
#include "api/sequence/fingerprint.h"
#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/key_text.h"
#include "engine/settings/settings_table.h"

namespace halflight {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kName = "halflightNoisy";  // attribute of the .exr with what is no pixel, JSON
constexpr int kFormat = 2;
constexpr const char* kInput = "input.";  // prefix of the parts of the denoiser

Json list(const auto& v) {
    Json json = Json::array();
    for (int i = 0; i < v.length(); ++i) json.push_back(v[i]);
    return json;
}

template <class V>
V vector_of(const Json& json) {
    V v;
    for (int i = 0; i < v.length(); ++i) v[i] = json.at(static_cast<std::size_t>(i)).get<typename V::value_type>();
    return v;
}

/// Returns a number as text, since JSON has no infinity.
std::string number_text(double value) {
    return fmt::format("{}", value);
}

template <class T>
T number_of(const Json& json) {
    const auto text = json.get<std::string>();
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) throw Error("", "expects a number, not '{}'", text);
    return value;
}

// Settings whose texts describe values of a picture that has them.
std::string text_of(const char* name, const RenderSettings& settings) {
    return setting(name).get(settings);
}
void take_text(const char* name, const Json& json, RenderSettings& settings) {
    if (const std::string problem = setting(name).set(settings, json.get<std::string>()); !problem.empty())
        throw Error("", "{}: {}", name, problem);
}

constexpr const char* kOpticsSettings[] = {"projection", "fisheye-fov", "stereo", "eye-distance", "convergence"};

Json lens_json(const Lens& lens) {
    return {{"fstop", lens.fstop},
            {"aperture", lens.aperture},
            {"sensor", lens.sensor},
            {"focus", static_cast<int>(lens.focus.kind)},
            {"distance", number_text(lens.focus.distance)},
            {"point", list(lens.focus.point)},
            {"blades", lens.blades},
            {"rotation", lens.rotation}};
}

Lens lens_of(const Json& json) {
    const int kind = json.at("focus");
    if (kind < 0 || kind > static_cast<int>(Focus::Kind::point)) throw Error("", "focus: there is no kind {}", kind);
    return {.fstop = json.at("fstop"),
            .aperture = json.at("aperture"),
            .sensor = json.at("sensor"),
            .focus = {.kind = static_cast<Focus::Kind>(kind),
                      .distance = number_of<double>(json.at("distance")),
                      .point = vector_of<dvec2>(json.at("point"))},
            .blades = json.at("blades"),
            .rotation = json.at("rotation")};
}

Json camera_json(const Camera& camera) {
    RenderSettings settings;
    settings.optics = camera.optics;
    Json json{{"name", camera.name},
              {"orthographic", camera.orthographic},
              {"vertical_fov", camera.vertical_fov},
              {"ortho_height", camera.ortho_height},
              {"aspect", camera.aspect},
              {"near", camera.near_plane},
              {"far", camera.far_plane}};
    for (int column = 0; column < 4; ++column) json["camera_to_world"].push_back(list(camera.camera_to_world[column]));
    for (const char* name : kOpticsSettings) json[name] = text_of(name, settings);
    return json;
}

Camera camera_of(const Json& json) {
    RenderSettings settings;
    for (const char* name : kOpticsSettings) take_text(name, json.at(name), settings);
    Camera camera{.name = json.at("name"),
                  .orthographic = json.at("orthographic"),
                  .vertical_fov = json.at("vertical_fov"),
                  .ortho_height = json.at("ortho_height"),
                  .aspect = json.at("aspect"),
                  .near_plane = json.at("near"),
                  .far_plane = json.at("far"),
                  .optics = settings.optics};
    for (int column = 0; column < 4; ++column)
        camera.camera_to_world[column] =
            vector_of<dvec4>(json.at("camera_to_world").at(static_cast<std::size_t>(column)));
    return camera;
}

Json info_json(const PictureInfo& info) {
    Json json{{"camera", camera_json(info.camera)},
              {"half", info.half},
              {"whole", list(info.whole)},
              {"origin", list(info.origin)},
              {"transparent", info.transparent},
              {"filter", info.filter},
              {"lens", info.lens},
              {"projection", info.projection},
              {"shutter", info.shutter},
              {"frame", info.frame},
              {"numbers", Json::object()}};
    for (const auto& [name, value] : info.numbers) json["numbers"][name] = number_text(double{value});
    json["numbers"].erase("renderTime");
    if (info.frame_rate) json["frame_rate"] = {info.frame_rate->numerator, info.frame_rate->denominator};
    return json;
}

PictureInfo info_of(const Json& json) {
    PictureInfo info{.camera = camera_of(json.at("camera")),
                     .working_space = {},
                     .half = json.at("half"),
                     .whole = vector_of<ivec2>(json.at("whole")),
                     .origin = vector_of<ivec2>(json.at("origin")),
                     .transparent = json.at("transparent"),
                     .comments = {},
                     .filter = json.at("filter"),
                     .lens = json.at("lens"),
                     .projection = json.at("projection"),
                     .shutter = json.at("shutter"),
                     .bias = {},
                     .error = {},
                     .frame = json.at("frame")};
    for (const auto& [name, value] : json.at("numbers").items()) info.numbers[name] = number_of<float>(value);
    if (const auto rate = json.find("frame_rate"); rate != json.end())
        info.frame_rate = FrameRate{rate->at(0).get<std::int32_t>(), rate->at(1).get<std::int32_t>()};
    return info;
}

Json stats_json(const RenderStats& stats) {
    RenderSettings settings;
    settings.primary = stats.primary;
    Json json{{"samples", stats.samples},
              {"paths", stats.paths},
              {"seconds", stats.render_seconds},
              {"estimator", text(stats.estimator)},
              {"primary", text_of("primary", settings)},
              {"lens", lens_json(stats.lens)},
              {"note", stats.tracing_note},
              {"biases", stats.biases},
              {"layer_biases", stats.layer_biases},
              {"bad_values", Json::array()}};
    for (const BadValues& bad : stats.bad_values)
        json["bad_values"].push_back({bad.component, bad.nans, bad.infinities, bad.negatives});
    if (const auto& e = stats.error)
        json["error"] = {{"metric", static_cast<int>(e->target.metric)},
                         {"target", number_text(e->target.error)},
                         {"value", number_text(e->estimate.value)},
                         {"lower", number_text(e->estimate.lower)},
                         {"upper", number_text(e->estimate.upper)},
                         {"bound", number_text(e->estimate.bound)},
                         {"reached", e->reached}};
    return json;
}

RenderStats stats_of(const Json& json) {
    RenderSettings settings;
    take_text("primary", json.at("primary"), settings);
    RenderStats stats;
    stats.samples = json.at("samples");
    stats.paths = json.at("paths");
    stats.render_seconds = json.at("seconds");
    stats.estimator = estimator_named(json.at("estimator").get<std::string>());
    stats.primary = settings.primary;
    stats.lens = lens_of(json.at("lens"));
    stats.tracing_note = json.at("note");
    stats.biases = json.at("biases").get<std::vector<std::string>>();
    stats.layer_biases = json.at("layer_biases").get<std::vector<std::string>>();
    for (const Json& bad : json.at("bad_values"))
        stats.bad_values.push_back({bad.at(0), bad.at(1), bad.at(2), bad.at(3)});
    if (const auto e = json.find("error"); e != json.end()) {
        const auto number = [&](const char* name) { return number_of<double>(e->at(name)); };
        stats.error = {{e->at("metric").get<int>() == 0 ? ErrorMetric::mse : ErrorMetric::relmse, number("target")},
                       {number("value"), number("lower"), number("upper"), number("bound")},
                       e->at("reached")};
    }
    return stats;
}

constexpr std::pair<ExrType, const char*> kTypes[] = {
    {ExrType::half, "half"}, {ExrType::float32, "float"}, {ExrType::uint32, "uint"}};

/// Returns the channels of an RGBA texture of the denoiser.
std::vector<std::string> channels_of(const std::string& texture) {
    std::vector<std::string> channels;
    for (const char* channel : {".R", ".G", ".B", ".A"}) channels.push_back(kInput + texture + channel);
    return channels;
}

const std::vector<std::string> kPicture{"R", "G", "B", "A"};

/// Reads all but the pixels of the denoiser.
NoisyPicture picture_of(ExrFile& exr, const Json& json) {
    NoisyPicture picture{.result = {},
                         .noisy = std::make_unique<NoisyFrame>(),
                         .info = info_of(json.at("info")),
                         .sums = json.at("sums"),
                         .reach = json.at("reach"),
                         .near = json.at("near").get<std::vector<std::string>>()};
    picture.info.comments = exr.attributes.comments;
    if (const auto exposure = json.find("metered_exposure"); exposure != json.end())
        picture.metered_exposure = number_of<float>(*exposure);
    NoisyFrame& noisy = *picture.noisy;
    noisy.has_halves = json.at("has_halves");
    noisy.blur = vector_of<vec3>(json.at("blur"));
    noisy.shown = vector_of<ivec2>(json.at("shown"));
    const ivec2 rendered(exr.width, exr.height), size = vector_of<ivec2>(json.at("size"));
    const auto inside = [&](const ivec2& first, const ivec2& extent) {
        return glm::all(glm::greaterThanEqual(first, ivec2(0))) && glm::all(glm::greaterThan(extent, ivec2(0))) &&
               glm::all(glm::lessThanEqual(extent, rendered - first));
    };
    if (!inside(noisy.shown, size)) throw Error("", "the picture is not inside of what was rendered");
    for (const Json& w : json.at("windows")) {
        const DenoiserWindow window{vector_of<ivec2>(w.at(0)), vector_of<ivec2>(w.at(1)), w.at(2)};
        if (!inside(window.first, window.size) || window.margin < 0 || window.margin > window.size.x)
            throw Error("", "a window is not inside of what was rendered");
        noisy.windows.push_back(window);
    }

    RenderResult& result = picture.result;
    const ExrWindow whole{exr.attributes.origin, rendered};
    result.beauty = part_of(exr.image(kPicture, whole), noisy.shown, size);
    for (const Json& layer : json.at("layers")) {
        const auto type = std::ranges::find(kTypes, layer.at("type").get<std::string>(),
                                            [](const auto& t) { return std::string(t.second); });
        if (type == std::end(kTypes)) throw Error("", "a layer has an unknown type");
        ExrLayer& made = result.aovs.emplace_back();
        made.channels = layer.at("channels").get<std::vector<std::string>>();
        made.image = part_of(exr.image(made.channels, whole, true), noisy.shown, size);
        made.type = type->first;
        made.name = layer.at("name");
    }
    result.attributes = json.at("attributes").get<std::map<std::string, std::string>>();
    result.stats = stats_of(json.at("stats"));
    picture.info.samples = result.stats.samples;
    return picture;
}

/// Reads the pixels of the denoiser.
void read_pixels(const ExrFile& exr, const Json& json, NoisyFrame& noisy) {
    const gpu::TextureDesc desc{exr.width, exr.height, GL_RGBA32F};
    noisy.pixels.emplace(desc, json.at("light").get<DenoiserTextures::Present>(), json.at("chains").get<bool>());
    const auto offsets = [&](const char* name) {
        auto all = json.at(name).get<std::vector<int>>();
        if (std::ranges::any_of(all, [](int n) { return n == 0 || std::abs(n) > kMaxDenoiseFrames; }))
            throw Error("", "{}: a frame is too far", name);
        return all;
    };
    noisy.reserve_motion({exr.width, exr.height}, offsets("motion"), offsets("glossy_motion"));
    const ExrWindow whole{exr.attributes.origin, {exr.width, exr.height}};
    for (const auto& [name, texture] : noisy.named())
        texture->upload(std::span<const float>(exr.image(channels_of(name), whole).pixels));
}

}  // namespace

std::filesystem::path noisy_path(const std::filesystem::path& picture) {
    return std::filesystem::path(picture).replace_extension(".noisy.exr");
}

std::filesystem::path near_path(const std::filesystem::path& picture) {
    return std::filesystem::path(picture).replace_extension(".near.exr");
}

std::string name_of_noisy(const std::filesystem::path& noisy) {
    return noisy.stem().stem().string();
}

bool is_noisy_name(const std::filesystem::path& name) {
    return name.string().ends_with(".noisy.exr") || name.string().ends_with(".near.exr");
}

void check_not_noisy(const std::filesystem::path& output) {
    if (is_noisy_name(output))
        throw Error(output.string(), "is the name of a noisy frame, which an output must not replace");
}

std::string noisy_fingerprint(const std::string& sums, FrameNumber frame) {
    return frame_fingerprint(KeyText(sums).add("picture", "noisy").text(), frame, "");
}

void write_noisy_file(const std::filesystem::path& path, const NoisyPicture& picture, ExrCompression compression) {
    NoisyFrame& noisy = *picture.noisy;
    const RenderResult& result = picture.result;
    const gpu::TextureDesc& desc = noisy.pixels->desc();
    const ivec2 rendered(desc.width, desc.height), size(result.beauty.width, result.beauty.height);
    Json json{{"format", kFormat},
              {"sums", picture.sums},
              {"reach", picture.reach},
              {"size", list(size)},
              {"shown", list(noisy.shown)},
              {"blur", list(noisy.blur)},
              {"windows", Json::array()},
              {"has_halves", noisy.has_halves},
              {"light", noisy.pixels->present()},
              {"chains", noisy.pixels->has_chains()},
              {"motion", noisy.offsets(false)},
              {"near", picture.near},
              {"glossy_motion", noisy.offsets(true)},
              {"layers", Json::array()},
              {"attributes", result.attributes},
              {"info", info_json(picture.info)},
              {"stats", stats_json(result.stats)}};
    if (picture.info.reproducible) json["stats"]["seconds"] = 0;
    if (picture.metered_exposure) json["metered_exposure"] = number_text(double{*picture.metered_exposure});
    for (const DenoiserWindow& w : noisy.windows) json["windows"].push_back({list(w.first), list(w.size), w.margin});

    std::vector<ExrLayer> layers;
    const auto add = [&](const std::vector<std::string>& channels, const Image& image, ExrType type,
                         const std::string& name) {
        layers.push_back({channels, placed(image, noisy.shown, rendered), type, name});
    };
    add(kPicture, result.beauty, ExrType::float32, "rgba");
    for (const ExrLayer& aov : result.aovs) {
        const auto type = std::ranges::find(kTypes, aov.type, [](const auto& t) { return t.first; });
        json["layers"].push_back({{"name", aov.name}, {"channels", aov.channels}, {"type", type->second}});
        add(aov.channels, aov.image, aov.type == ExrType::half ? ExrType::float32 : aov.type, aov.name);
    }
    for (const auto& [name, texture] : noisy.named()) {
        Image image(desc.width, desc.height, 4);
        image.pixels = texture->read_float();
        layers.push_back({channels_of(name), std::move(image), ExrType::float32, kInput + name});
    }
    std::vector<ExrLayerView> views;
    for (const ExrLayer& layer : layers)
        views.push_back({.channels = layer.channels, .image = layer.image, .type = layer.type, .name = layer.name});
    PictureInfo info = picture.info;
    info.origin -= noisy.shown;
    ExrAttributes attributes = exr_attributes(result, info, info.whole.x > 0 ? info.whole : rendered);
    attributes.extra[kName] = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    add_fingerprint(attributes, noisy_fingerprint(picture.sums, picture.info.frame), views);
    write_exr_views(path, views, attributes, {.compression = compression, .parts = true});
}

namespace {

/// Calls use(exr, json) with the contents of a file. read: reads the file, or its header. Errors name the file.
template <class Use>
auto with_file(const std::filesystem::path& path, ExrFile (*read)(const std::filesystem::path&, const ExrLimits&),
               const Use& use) {
    ExrFile exr = read(path, limits_of_renders());
    const auto found = exr.attributes.extra.find(kName);
    if (found == exr.attributes.extra.end())
        throw Error(path.string(), "is no noisy frame: it has no attribute {} (--keep-noisy writes such files)", kName);
    try {
        const Json json = Json::parse(found->second);
        const int format = json.at("format").get<int>();
        if (format > kFormat || format < 1)
            throw Error("", "format {} is not {}, which this version reads", format, kFormat);
        if (format == kFormat) return use(exr, json);
    } catch (const BudgetError&) {
        throw;
    } catch (const Error& error) {
        throw Error(path.string(), "is damaged: {}: {}", kName, error.what());
    } catch (const nlohmann::json::exception& error) {
        throw Error(path.string(), "is damaged: {}: {}", kName, error.what());
    }
    throw Error(path.string(), "was kept by an older version, and has to be rendered again");
}

}  // namespace

NoisyPicture read_noisy_file(const std::filesystem::path& path) {
    return with_file(path, read_exr, [](ExrFile& exr, const Json& json) {
        NoisyPicture picture = picture_of(exr, json);
        const std::string print = fingerprint_of(exr);
        if (print != noisy_fingerprint(picture.sums, picture.info.frame))
            throw Error("", "its fingerprint {} is not that of its picture", print);
        read_pixels(exr, json, *picture.noisy);
        return picture;
    });
}

NoisyHeader read_noisy_header(const std::filesystem::path& path) {
    return with_file(path, read_exr_header, [](ExrFile&, const Json& json) -> NoisyHeader {
        const Json& info = json.at("info");
        NoisyHeader header{json.at("sums"),
                           info.at("frame"),
                           info.contains("frame_rate"),
                           json.at("reach"),
                           json.at("motion").get<std::vector<int>>(),
                           json.at("near").get<std::vector<std::string>>()};
        if (header.near.size() != header.motion.size())
            throw Error("", "{} names of {} neighbours", header.near.size(), header.motion.size());
        return header;
    });
}

}  // namespace halflight
