#include "engine/io/gltf/animation.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/accessor.h"
#include "engine/io/gltf/driven.h"
#include "engine/io/gltf/schema.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

std::optional<Interpolation> interpolation_named(const std::string& name) {
    if (name == "STEP") return Interpolation::step;
    if (name == "LINEAR") return Interpolation::linear;
    if (name == "CUBICSPLINE") return Interpolation::cubic_spline;
    return std::nullopt;
}

template <class V>
std::vector<float> flat(const std::vector<V>& values) {
    const auto* const first = reinterpret_cast<const float*>(values.data());  // GLM's vectors are packed
    return {first, first + values.size() * V::length()};
}

class Reader {
  public:
    Reader(GltfDocument& document, MemoryLedger::Entry& memory)
        : document_(document), accessors_(document), memory_(memory) {}

    Animation read(const Json& from, std::size_t index) {
        element_ = fmt::format("animations[{}]", index);
        samplers_ = &from.at("samplers");
        read_.clear();
        Animation animation;
        animation.name = from.value("name", "");
        const Json& channels = from.at("channels");
        for (std::size_t i = 0; i < channels.size(); ++i) add_channel(animation, channels[i], i);
        animation.begin = std::numeric_limits<double>::infinity();
        animation.end = -animation.begin;
        for (const Keyframes& keys : animation.keyframes) {
            animation.begin = std::min<double>(animation.begin, keys.times.front());
            animation.end = std::max<double>(animation.end, keys.times.back());
        }
        if (animation.keyframes.empty()) animation.begin = animation.end = 0;
        return animation;
    }

  private:
    void add_channel(Animation& animation, const Json& from, std::size_t index) {
        const std::string element = fmt::format("{}.channels[{}]", element_, index);
        const auto target = target_of(from.at("target"), element);
        if (!target) return;
        const auto sampler = from.at("sampler").get<std::size_t>();
        if (sampler >= samplers_->size())
            document_.fail(element, "sampler {} is not an index into its samplers, which has {}", sampler,
                           samplers_->size());
        const AnimatedProperty property = property_of(*target);
        const int morph_targets = check_target(element, property, target->index);
        const auto [it, is_new] =
            read_.try_emplace({sampler, target->field, morph_targets}, animation.keyframes.size());
        if (is_new) animation.keyframes.push_back(read_sampler(sampler, *target, morph_targets));
        animation.channels.push_back({property, target->index, target->field, it->second});
    }

    /// Returns the target; none where it is left out with a warning.
    std::optional<GltfTarget> target_of(const Json& from, const std::string& element) {
        const auto path = from.at("path").get<std::string>();
        if (path == "pointer") return pointed_at(from, element);
        const auto target = node_target(path, from.value("node", kNone));
        if (target && target->index != kNone) return target;
        document_.warnings.add(target ? "drives no node, it is left out"
                                      : fmt::format("drives '{}', which is not supported; it is left out", path),
                               element);
        return std::nullopt;
    }

    std::optional<GltfTarget> pointed_at(const Json& from, const std::string& element) {
        const auto at = Json::json_pointer("/extensions/KHR_animation_pointer/pointer");
        if (!from.contains(at)) document_.fail(element, "has no KHR_animation_pointer to say what it drives");
        const auto pointer = from.at(at).get<std::string>();
        const auto target = follow_pointer(document_, pointer, element);
        if (!target)
            document_.warnings.add(fmt::format("drives '{}', which is not supported; it is left out", pointer),
                                   element);
        return target;
    }

    /// Returns the number of morph targets where weights are driven, else 0.
    int check_target(const std::string& element, AnimatedProperty property, int index) const {
        const gltf::Model& model = document_.model;
        if (property == AnimatedProperty::mesh_weights) return count_morph_targets(index, element, "meshes", index);
        if (!of_node(property)) return 0;
        const gltf::Node& node = model.nodes[static_cast<std::size_t>(index)];
        if (property == AnimatedProperty::weights) return count_morph_targets(node.mesh, element, "nodes", index);
        if (!node.matrix.empty()) document_.fail(element, "nodes[{}] has a matrix, which cannot be driven", index);
        return 0;
    }

    /// Returns the number of morph targets of a mesh, > 0. Throws Error about LIST[index] if there is none.
    int count_morph_targets(int mesh, const std::string& element, const char* list, int index) const {
        std::size_t targets = 0;
        if (mesh != kNone)
            for (const auto& primitive : document_.model.meshes[static_cast<std::size_t>(mesh)].primitives)
                targets = std::max(targets, primitive.targets.size());
        if (targets == 0) document_.fail(element, "drives weights of {}[{}], which has no morph targets", list, index);
        return static_cast<int>(targets);
    }

    Keyframes read_sampler(std::size_t index, const GltfTarget& target, int morph_targets) {
        const std::string element = fmt::format("{}.samplers[{}]", element_, index);
        const Json& from = samplers_->at(index);
        const std::string name = from.value("interpolation", "LINEAR");
        const auto interpolation = interpolation_named(name);
        if (!interpolation) document_.fail(element, "interpolation '{}' is unknown", name);
        Keyframes keys;
        keys.interpolation = *interpolation;
        const bool weights = morph_targets > 0;
        keys.rotation = property_of(target) == AnimatedProperty::rotation;
        keys.components = weights ? morph_targets : components_of(target);
        const int input = from.at("input"), output = from.at("output");
        // An accessor of weights has one element per weight.
        const std::size_t per_key = (keys.interpolation == Interpolation::cubic_spline ? 3 : 1) *
                                    static_cast<std::size_t>(weights ? morph_targets : 1);
        const std::size_t expected = accessors_.count(input) * per_key;
        if (accessors_.count(output) != expected)
            document_.fail(element, "its output has {} elements for {} keys, {} expected", accessors_.count(output),
                           accessors_.count(input), expected);
        const std::size_t bytes = sizeof(float) * (accessors_.count(input) +
                                                   expected * static_cast<std::size_t>(accessors_.components(output)));
        MemoryLedger::process().check(2 * bytes, document_.file, element);  // while they are read there is a copy
        // Samplers may share accessors, so that a small file has many keyframes.
        memory_ = {MemoryLedger::process(), MemoryPart::scene, memory_.bytes() + bytes};
        keys.times = accessors_.read<float>(input, element + ".input");
        const std::string purpose = element + ".output";
        if (weights || keys.components == 1)
            keys.values = accessors_.read<float>(output, 0, expected, purpose, true);
        else if (keys.components == 4)
            keys.values = flat(accessors_.read<vec4>(output, 0, expected, purpose, true));
        else if (keys.components == 2)
            keys.values = flat(accessors_.read<vec2>(output, 0, expected, purpose, true));
        else if (of_node(property_of(target)))
            keys.values = flat(accessors_.read<vec3>(output, purpose));
        else
            keys.values = flat(accessors_.read<vec3>(output, 0, expected, purpose, true));
        check_keyframes(keys, fmt::format("{}: {}", document_.file, element));
        return keys;
    }

    GltfDocument& document_;
    const GltfAccessors accessors_;
    MemoryLedger::Entry& memory_;
    std::string element_;
    const Json* samplers_ = nullptr;
    // Index of keyframes by sampler, field and number of morph targets; a sampler may serve many channels.
    std::map<std::tuple<std::size_t, int, int>, std::size_t> read_;
};

}  // namespace

std::vector<Animation> read_animations(GltfDocument& document, MemoryLedger::Entry& memory) {
    std::vector<Animation> animations;
    memory = {};
    if (document.animations.is_null()) return animations;
    Json list = document.animations;
    check_gltf_animations(list, document.model.accessors.size(), document.model.nodes.size(), document.file);
    Reader reader(document, memory);
    for (std::size_t i = 0; i < list.size(); ++i) animations.push_back(reader.read(list[i], i));
    return animations;
}

}  // namespace halflight
