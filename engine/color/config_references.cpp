// Checks the references between the colour spaces, looks and transforms of a config. OpenColorIO follows them by
// recursion without a limit.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "engine/color/ocio.h"

namespace halflight {
namespace {

// Published configs nest at most four levels. OpenColorIO needs about 1 KiB of stack per level.
constexpr int kMaxDepth = 64;
// Transforms that a view may consist of. References that are shared count each time, as OpenColorIO copies them.
constexpr double kMaxTransforms = 1e5;

/// An object of the config. OpenColorIO looks at the transforms of both of its directions, whichever it needs.
struct Use {
    enum class Kind { space, look, view, named };
    Kind kind = Kind::space;
    std::string name;

    auto operator<=>(const Use&) const = default;
};

std::string title(const Use& use) {
    constexpr std::string_view kKinds[] = {"colour space", "look", "view transform", "named transform"};
    return fmt::format("{} \"{}\"", kKinds[static_cast<std::size_t>(use.kind)], use.name);
}

/// Depth-first search over the references of all objects.
class References {
  public:
    explicit References(const ocio::Config& config) : config_(config) {}

    void check_all() {
        for (int i = 0; i < config_.getNumColorSpaces(kAnySpace, ocio::COLORSPACE_ALL); ++i)
            visit({Use::Kind::space, config_.getColorSpaceNameByIndex(kAnySpace, ocio::COLORSPACE_ALL, i)});
        for (int i = 0; i < config_.getNumLooks(); ++i) visit({Use::Kind::look, config_.getLookNameByIndex(i)});
        for (int i = 0; i < config_.getNumViewTransforms(); ++i)
            visit({Use::Kind::view, config_.getViewTransformNameByIndex(i)});
        for (int i = 0; i < config_.getNumNamedTransforms(ocio::NAMEDTRANSFORM_ALL); ++i)
            visit({Use::Kind::named, config_.getNamedTransformNameByIndex(ocio::NAMEDTRANSFORM_ALL, i)});
    }

  private:
    static constexpr auto kAnySpace = ocio::SEARCH_REFERENCE_SPACE_ALL;
    struct Size {
        int depth = 1;          // levels, this one included
        double transforms = 1;  // transforms, this one included
    };

    /// Returns the size of an object with all that it refers to.
    Size visit(const Use& use) {
        if (const auto known = sizes_.find(use); known != sizes_.end()) return known->second;
        if (const auto open = std::ranges::find(path_, use); open != path_.end()) fail_cycle(open);
        if (path_.size() >= kMaxDepth) fail_depth(path_.front());
        path_.push_back(use);
        const Size outer = std::exchange(size_, {});
        follow(use);
        const Size size = std::exchange(size_, outer);
        path_.pop_back();
        if (size.depth > kMaxDepth) fail_depth(use);
        if (size.transforms > kMaxTransforms)
            throw ocio::Exception(
                fmt::format("{} consists of more than {} transforms", title(use), kMaxTransforms).c_str());
        sizes_[use] = size;
        return size;
    }

    /// Adds an object to the size of the one that refers to it.
    void refer(const Use& use) {
        const Size size = visit(use);
        size_.depth = std::max(size_.depth, size.depth + 1);
        size_.transforms += size.transforms;
    }

    [[noreturn]] static void fail_depth(const Use& use) {
        throw ocio::Exception(
            fmt::format("the references of {} are more than {} levels deep", title(use), kMaxDepth).c_str());
    }

    [[noreturn]] void fail_cycle(std::vector<Use>::const_iterator first) const {
        if (first + 1 == path_.end()) throw ocio::Exception((title(*first) + " refers to itself").c_str());
        std::string text = title(*first);
        for (auto next = first + 1; next != path_.end(); ++next)
            text += (next == first + 1 ? " refers to " : ", which refers to ") + title(*next);
        throw ocio::Exception(fmt::format("{}, which refers to {} again", text, title(*first)).c_str());
    }

    void follow(const Use& use) {
        switch (use.kind) {
            case Use::Kind::space:
                if (const auto space = config_.getColorSpace(use.name.c_str()))
                    for (const auto direction :
                         {ocio::COLORSPACE_DIR_TO_REFERENCE, ocio::COLORSPACE_DIR_FROM_REFERENCE})
                        scan(space->getTransform(direction));
                break;
            case Use::Kind::view:
                if (const auto view = config_.getViewTransform(use.name.c_str()))
                    for (const auto direction :
                         {ocio::VIEWTRANSFORM_DIR_TO_REFERENCE, ocio::VIEWTRANSFORM_DIR_FROM_REFERENCE})
                        scan(view->getTransform(direction));
                break;
            case Use::Kind::named:
                if (const auto named = config_.getNamedTransform(use.name.c_str()))
                    for (const auto direction : {ocio::TRANSFORM_DIR_FORWARD, ocio::TRANSFORM_DIR_INVERSE})
                        scan(named->getTransform(direction));
                break;
            case Use::Kind::look:
                if (const auto look = config_.getLook(use.name.c_str())) {
                    refer_to_space(look->getProcessSpace());
                    scan(look->getTransform());
                    scan(look->getInverseTransform());
                }
                break;
        }
    }

    void scan(const ocio::ConstTransformRcPtr& transform) {
        if (!transform) return;
        size_.transforms += 1;
        if (const auto group = std::dynamic_pointer_cast<const ocio::GroupTransform>(transform)) {
            for (int i = 0; i < group->getNumTransforms(); ++i) scan(group->getTransform(i));
        } else if (const auto spaces = std::dynamic_pointer_cast<const ocio::ColorSpaceTransform>(transform)) {
            refer_to_space(spaces->getSrc());
            refer_to_space(spaces->getDst());
        } else if (const auto look = std::dynamic_pointer_cast<const ocio::LookTransform>(transform)) {
            refer_to_space(look->getSrc());
            refer_to_space(look->getDst());
            refer_to_looks(look->getLooks());
        } else if (const auto view = std::dynamic_pointer_cast<const ocio::DisplayViewTransform>(transform)) {
            scan_view(*view);
        }
    }

    void scan_view(const ocio::DisplayViewTransform& transform) {
        const std::string display = resolved(transform.getDisplay()), view = resolved(transform.getView());
        refer_to_space(transform.getSrc());
        const std::string end = config_.getDisplayViewColorSpaceName(display.c_str(), view.c_str());
        refer_to_space(end == ocio::OCIO_VIEW_USE_DISPLAY_NAME ? display.c_str() : end.c_str());
        if (!transform.getLooksBypass()) refer_to_looks(config_.getDisplayViewLooks(display.c_str(), view.c_str()));
        const std::string between = config_.getDisplayViewTransformName(display.c_str(), view.c_str());
        if (!between.empty()) refer({Use::Kind::view, between});
    }

    /// Adds a colour space, or a named transform in its place, by name, alias or role.
    void refer_to_space(const char* name) {
        const std::string wanted = resolved(name);
        if (const auto found = config_.getColorSpace(wanted.c_str()))
            refer({Use::Kind::space, found->getName()});
        else if (const auto named = config_.getNamedTransform(wanted.c_str()))
            refer({Use::Kind::named, named->getName()});
    }

    /// Adds the looks of a list: "+a, -b | c". OpenColorIO takes the first of the alternatives that it can build, and
    /// tries each.
    void refer_to_looks(const char* list) {
        const std::string text = resolved(list);
        for (std::size_t end, at = 0; at < text.size(); at = end + 1) {
            end = std::min(text.find_first_of(",:|", at), text.size());
            std::string name = text.substr(at, end - at);
            name.erase(0, name.find_first_not_of(" \t+-"));
            name.erase(name.find_last_not_of(" \t") + 1);
            if (const auto look = config_.getLook(name.c_str())) refer({Use::Kind::look, look->getName()});
        }
    }

    std::string resolved(const char* text) const {
        return text && *text ? config_.getCurrentContext()->resolveStringVar(text) : "";
    }

    const ocio::Config& config_;
    std::vector<Use> path_;  // objects whose references are being followed
    Size size_;              // size of the last of them so far
    std::map<Use, Size> sizes_;
};

}  // namespace

void check_references(const ocio::Config& config) {
    References(config).check_all();
}

}  // namespace halflight
