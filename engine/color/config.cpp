#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <sstream>

#include "engine/color/ocio.h"
#include "engine/core/error.h"
#include "engine/core/suggestion.h"
#include "shaders/shared/tone_map.h"

namespace halflight {

extern const char* const kEmbeddedConfig;  // text of halflight.ocio, defined in embedded.cpp

namespace {

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

/// Returns the valid name that `name` means: an exact match, else the only case-insensitive match, also without a
/// trailing " - Display".
std::string resolve(const std::string& name, const std::vector<std::string>& valid, const std::string& source,
                    const std::string& kind) {
    if (std::find(valid.begin(), valid.end(), name) != valid.end()) return name;
    std::vector<std::string> matches;
    for (const std::string& candidate : valid) {
        if (lower(candidate) == lower(name) || lower(candidate) == lower(name + " - Display"))
            matches.push_back(candidate);
    }
    if (matches.size() == 1) return matches.front();
    throw Error(source, "has no {} \"{}\"; it has: {}", kind, name,
                valid.empty() ? "none" : fmt::format("{}", fmt::join(valid, ", ")));
}

/// Resolves "a, -b", where every name must be a look of the config.
std::string resolve_looks(const std::string& looks, const std::vector<std::string>& valid, const std::string& source) {
    std::string resolved;
    std::istringstream list(looks);
    for (std::string item; std::getline(list, item, ',');) {
        const std::string space = " \t";
        item.erase(0, item.find_first_not_of(space));
        item.erase(item.find_last_not_of(space) + 1);
        const bool inverse = item.starts_with('-');
        if (inverse || item.starts_with('+')) item.erase(0, 1);
        resolved +=
            (resolved.empty() ? "" : ", ") + std::string(inverse ? "-" : "") + resolve(item, valid, source, "look");
    }
    return resolved;
}

/// Returns the transform from Rec.709 to ACES2065-1, with Bradford adaptation, made of OCIO's built-in transforms.
ocio::TransformRcPtr rec709_to_aces() {
    const auto to_ap1 = ocio::BuiltinTransform::Create();
    to_ap1->setStyle("UTILITY - ACES-AP1_to_LINEAR-REC709_BFD");
    to_ap1->setDirection(ocio::TRANSFORM_DIR_INVERSE);
    const auto to_ap0 = ocio::BuiltinTransform::Create();
    to_ap0->setStyle("ACEScg_to_ACES2065-1");
    const auto group = ocio::GroupTransform::Create();
    group->appendTransform(to_ap1);
    group->appendTransform(to_ap0);
    return group;
}

ocio::ConstConfigRcPtr embedded_config() {
    std::istringstream text(kEmbeddedConfig);
    return ocio::Config::CreateFromStream(text);
}

ConfigFile open(const std::string& file) {
    ConfigFile read = read_config(file);
    if (read.config->getNumDisplays() == 0) throw ocio::Exception("the config has no active displays");
    return read;
}

/// Removes the file name that OCIO puts before its message, because ours names the file, too.
std::string without_preamble(std::string message) {
    const std::string preamble = " failed. ";
    const std::size_t end = message.find(preamble);
    return message.starts_with("Error: Loading") && end != std::string::npos ? message.substr(end + preamble.size())
                                                                             : message;
}

/// Names of linear Rec.709 in well-known configs without an aces_interchange role.
constexpr const char* kRec709Names[] = {"Linear Rec.709 (sRGB)",   "lin_rec709",  "lin_srgb",     "Linear Rec.709",
                                        "Utility - Linear - sRGB", "Linear sRGB", "Linear BT.709"};

constexpr ToneMap kToneMaps[] = {{"halflight:pbr_neutral", "pbr_neutral", shared::pbr_neutral},
                                 {"halflight:agx", "agx", shared::agx}};

/// Returns the tone map that the view transform of a view asks for, or null.
const ToneMap* tone_map_of(const ocio::Config& config, const std::string& display, const std::string& view) {
    const auto transform = config.getViewTransform(config.getDisplayViewTransformName(display.c_str(), view.c_str()));
    for (const ToneMap& map : kToneMaps)
        if (transform && std::string_view(transform->getFamily()) == map.family) return &map;
    return nullptr;
}

}  // namespace

ColorConfig ColorConfig::load(const std::optional<std::filesystem::path>& file) {
    static std::once_flag once;  // all threads share OCIO's logging function, which no lock guards
    std::call_once(once, [] { ocio::SetLoggingFunction([](const char*) {}); });  // errors are thrown, not printed
    const char* const environment = std::getenv("OCIO");
    auto data = std::make_shared<Data>();
    std::string subject = "built-in colour config";
    const auto take = [&](const std::string& name) {
        data->source = name;
        ConfigFile read = open(name);
        data->config = std::move(read.config);
        data->files = std::move(read.files);
    };
    try {
        if (file) {
            subject = file->string();
            take(subject);
        } else if (environment && *environment) {
            subject = fmt::format("$OCIO ({})", environment);
            take(environment);
        } else {
            data->source = "built-in";
            data->config = embedded_config();
        }
    } catch (const ocio::Exception& e) {
        throw Error(subject, "cannot be used as OpenColorIO {} config: {}", ocio::GetVersion(),
                    without_preamble(e.what()));
    }

    if (data->config->hasRole("aces_interchange")) {
        data->rendering_space = "aces_interchange";
        data->from_rec709 = rec709_to_aces();
    } else {
        for (const char* name : kRec709Names) {
            if (!data->config->getColorSpace(name)) continue;
            data->rendering_space = name;
            break;
        }
    }
    if (data->rendering_space.empty())
        throw Error(subject,
                    "has neither an aces_interchange role nor one of the colour spaces {}; give its ACES2065-1 space "
                    "the role, or its linear Rec.709 space one of the names, or leave the config out",
                    fmt::join(kRec709Names, ", "));
    return ColorConfig(std::move(data));
}

const std::string& ColorConfig::source() const {
    return data_->source;
}

const std::vector<VersionedFile>& ColorConfig::files() const {
    return data_->files;
}

std::vector<std::string> ColorConfig::displays() const {
    std::vector<std::string> names;
    for (int i = 0; i < data_->config->getNumDisplays(); ++i) names.emplace_back(data_->config->getDisplay(i));
    return names;
}

std::vector<std::string> ColorConfig::views(const std::string& display) const {
    const std::string resolved = resolve(display, displays(), data_->source, "display");
    std::vector<std::string> names;
    for (int i = 0; i < data_->config->getNumViews(resolved.c_str()); ++i)
        names.emplace_back(data_->config->getView(resolved.c_str(), i));
    return names;
}

std::vector<std::string> ColorConfig::looks() const {
    std::vector<std::string> names;
    for (int i = 0; i < data_->config->getNumLooks(); ++i) names.emplace_back(data_->config->getLookNameByIndex(i));
    return names;
}

std::vector<std::string> ColorConfig::linear_spaces() const {
    std::vector<std::string> names;
    for (int i = 0; i < data_->config->getNumColorSpaces(); ++i) {
        const std::string name = data_->config->getColorSpaceNameByIndex(i);
        try {
            find_linear(name);
            names.push_back(name);
        } catch (const Error&) {  // the space is not linear
        }
    }
    return names;
}

std::string ColorConfig::default_display() const {
    return data_->config->getDefaultDisplay();
}

std::string ColorConfig::default_view(const std::string& display) const {
    return data_->config->getDefaultView(resolve(display, displays(), data_->source, "display").c_str());
}

ViewProcessor ColorConfig::view(const ViewTransform& wanted) const {
    auto data = std::make_shared<ViewProcessor::Data>();
    if (!std::isfinite(wanted.stops())) throw Error("exposure", "{} is not a number of stops", wanted.stops());
    data->exposure_scale = std::exp2(wanted.stops());
    data->display =
        wanted.display.empty() ? default_display() : resolve(wanted.display, displays(), data_->source, "display");
    data->view = wanted.view.empty()
                     ? default_view(data->display)
                     : resolve(wanted.view, views(data->display), data_->source + ": " + data->display, "view");
    data->look = resolve_looks(wanted.look, looks(), data_->source);

    const ocio::Config& config = *data_->config;
    const char* const src = data_->rendering_space.c_str();
    try {
        // A view of raw data must show the numbers of the rendering, not those of the interchange space.
        std::string end_name = config.getDisplayViewColorSpaceName(data->display.c_str(), data->view.c_str());
        if (end_name == ocio::OCIO_VIEW_USE_DISPLAY_NAME) end_name = data->display;
        const auto end = config.getColorSpace(end_name.c_str());
        const bool is_data = end && end->isData();
        data->encoding = encoding_of(config, end);
        // Views that end in a space of the scene, as all do in version 1, do not tell; only names do.
        const bool of_scene = end && !is_data && end->getReferenceSpaceType() == ocio::REFERENCE_SPACE_SCENE;
        if (of_scene && data->display.find("sRGB") != std::string::npos)
            data->encoding = DisplayEncoding{1, TransferCurve::srgb};
        data->tone_map = tone_map_of(config, data->display, data->view);
        const auto append_conversion = [&](ocio::GroupTransformRcPtr& to, ocio::TransformDirection direction) {
            if (!data_->from_rec709 || is_data) return;
            const ocio::TransformRcPtr conversion = data_->from_rec709->createEditableCopy();
            conversion->setDirection(direction);
            to->appendTransform(conversion);
        };
        ocio::GroupTransformRcPtr group = ocio::GroupTransform::Create();
        append_conversion(group, ocio::TRANSFORM_DIR_FORWARD);
        if (!data->look.empty() && !is_data) {
            const auto look = ocio::LookTransform::Create();
            look->setSrc(src);
            look->setDst(src);
            look->setLooks(data->look.c_str());
            group->appendTransform(look);
            if (data->tone_map) {
                append_conversion(group, ocio::TRANSFORM_DIR_INVERSE);
                data->looks = config.getProcessor(group);
                data->looks_cpu = data->looks->getOptimizedCPUProcessor(kOptimization);
                group = ocio::GroupTransform::Create();
                append_conversion(group, ocio::TRANSFORM_DIR_FORWARD);
            }
        }
        const auto view = ocio::DisplayViewTransform::Create();
        view->setSrc(src);
        view->setDisplay(data->display.c_str());
        view->setView(data->view.c_str());
        view->setLooksBypass(!data->look.empty());
        group->appendTransform(view);
        data->processor = config.getProcessor(group);
        data->cpu = data->processor->getOptimizedCPUProcessor(kOptimization);
    } catch (const ocio::Exception& e) {
        throw Error(data_->source, "view \"{}\" of \"{}\": {}", data->view, data->display, e.what());
    }
    return ViewProcessor(std::move(data));
}

LinearSpace ColorConfig::linear_space(const std::string& name) const {
    try {
        return find_linear(name);
    } catch (const Error& error) {
        const std::vector<std::string> linear = linear_spaces();
        throw Error(data_->source, "{}; linear ones are: {}{}", error.reason(), fmt::join(linear, ", "),
                    did_you_mean(name, linear));
    }
}

LinearSpace ColorConfig::find_linear(const std::string& name) const {
    if (name.empty()) return {"linear Rec.709", mat3(1), kRec709};
    const ocio::ConstColorSpaceRcPtr found = data_->config->getColorSpace(name.c_str());
    if (!found) {
        // Matrices of spaces do not depend on the config, unlike those of roles.
        const ocio::ConstConfigRcPtr own = embedded_config();
        if (!own->getColorSpace(name.c_str()) || own->hasRole(name.c_str()))
            throw Error(data_->source, "has no colour space \"{}\"", name);
        const Data data{own, data_->source, {}, "aces_interchange", rec709_to_aces()};
        return ColorConfig(std::make_shared<Data>(data)).find_linear(name);
    }
    if (found->isData()) throw Error(data_->source, "colour space \"{}\" holds data instead of colours", name);
    LinearSpace space{found->getName(), mat3(1), std::nullopt};
    const auto group = ocio::GroupTransform::Create();
    if (data_->from_rec709) group->appendTransform(data_->from_rec709->createEditableCopy());
    const auto to_space = ocio::ColorSpaceTransform::Create();
    to_space->setSrc(data_->rendering_space.c_str());
    to_space->setDst(found->getName());
    group->appendTransform(to_space);
    try {
        const auto cpu = data_->config->getProcessor(group)->getOptimizedCPUProcessor(kOptimization);
        const auto convert = [&](vec3 rgb) {
            cpu->applyRGB(&rgb.x);
            return rgb;
        };
        for (int i = 0; i < 3; ++i) {
            vec3 primary(0);
            primary[i] = 1;
            space.from_rec709[i] = convert(primary);
        }
        // A matrix maps the probes as its columns predict; curves and offsets do not. The tolerance covers four
        // roundings of values of about one each.
        for (const vec3& probe : {vec3(0), vec3(0.25f), vec3(4, 2, 1)}) {
            const vec3 error = glm::abs(convert(probe) - space.from_rec709 * probe);
            if (!(glm::max(error.x, glm::max(error.y, error.z)) <= 1e-5f * (1 + glm::length(probe))))
                throw Error(data_->source, "colour space \"{}\" is not linear", name);
        }
    } catch (const ocio::Exception& e) {
        throw Error(data_->source, "colour space \"{}\": {}", name, e.what());
    }
    // Published matrices are rounded to six digits or more; different spaces differ by 1e-2 and more.
    constexpr double kSameSpace = 1e-4;
    for (const Chromaticities& c : {kRec709, kAp1, kAp0, chromaticities_of(space.from_rec709)}) {
        const dmat3 expected = rgb_conversion(kRec709, c);
        bool same = true;  // comparisons with NaN, of a singular matrix, are false
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) same &= std::abs(expected[i][j] - space.from_rec709[i][j]) < kSameSpace;
        if (same && !space.chromaticities) space.chromaticities = c;
    }
    return space;
}

}  // namespace halflight
