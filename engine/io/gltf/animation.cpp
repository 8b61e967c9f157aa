#include "engine/io/gltf/animation.h"

#include <algorithm>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

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
        if (channels.empty()) document_.warnings.fault("has no channels", element_);
        std::set<std::size_t> driving;
        for (const Json& channel : channels) driving.insert(channel.at("sampler").get<std::size_t>());
        for (std::size_t i = 0; i < samplers_->size(); ++i) {
            try {
                check_sampler(i);
            } catch (const Error& error) {
                if (driving.contains(i)) throw;
                document_.warnings.fault(fmt::format("{}; no channel uses it", error.reason()),
                                         element_of(error, document_.file));
            }
        }
        for (std::size_t i = 0; i < channels.size(); ++i) add_channel(animation, channels[i], i);
        warn_of_duplicates(animation);
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
    /// Checks what the specification requires of a sampler (glTF 2.0, section 3.11).
    void check_sampler(std::size_t index) {
        const std::string element = fmt::format("{}.samplers[{}]", element_, index);
        const Json& from = samplers_->at(index);
        const std::string name = from.value("interpolation", "LINEAR");
        const auto interpolation = interpolation_named(name);
        if (!interpolation) document_.fail(element, "interpolation '{}' is unknown", name);
        const int input = from.at("input");
        accessors_.check_type(input, 1, element + ".input");
        const tinygltf::Accessor& times = document_.model.accessors[static_cast<std::size_t>(input)];
        if (times.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
            document_.fail(element, "its times in accessors[{}] are not floating-point numbers", input);
        if (times.minValues.empty() || times.maxValues.empty())
            document_.warnings.fault("its times have no min and max", element);
        if (interpolation == Interpolation::cubic_spline && accessors_.count(input) < 2)
            document_.warnings.fault("is a cubic spline of fewer than two keys", element);
        for (const int accessor : {input, from.at("output").get<int>()}) {
            const int view = document_.model.accessors[static_cast<std::size_t>(accessor)].bufferView;
            if (view != kNone && document_.model.bufferViews[static_cast<std::size_t>(view)].byteStride != 0)
                document_.warnings.fault(fmt::format("has a byteStride in bufferViews[{}], as only vertices may", view),
                                         element);
        }
    }

    void warn_of_duplicates(const Animation& animation) {
        std::set<std::pair<int, int>> driven;
        for (const AnimationChannel& channel : animation.channels)
            if (!driven.insert({channel.field, channel.target}).second)
                document_.warnings.fault("several channels drive the same property, and only the last one counts",
                                         element_);
    }

    void add_channel(Animation& animation, const Json& from, std::size_t index) {
        const std::string element = fmt::format("{}.channels[{}]", element_, index);
        const auto sampler = from.at("sampler").get<std::size_t>();
        if (sampler >= samplers_->size())
            document_.fail(element, "sampler {} is not an index into its samplers, which has {}", sampler,
                           samplers_->size());
        const auto target = target_of(from.at("target"), element);
        if (!target) return;
        if (target->index == kNone) return check_output(sampler, *target);
        const AnimatedProperty property = property_of(*target);
        const int morph_targets = check_target(element, property, target->index);
        const auto [it, is_new] =
            read_.try_emplace({sampler, target->field, morph_targets}, animation.keyframes.size());
        if (is_new) animation.keyframes.push_back(read_sampler(sampler, *target, morph_targets));
        animation.channels.push_back({property, target->index, target->field, it->second});
    }

    /// Returns the target; none, or one without an index, if it is left out with a warning.
    std::optional<GltfTarget> target_of(const Json& from, const std::string& element) {
        const auto path = from.at("path").get<std::string>();
        if (path == "pointer") return pointed_at(from, element);
        const auto target = node_target(path, from.value("node", kNone));
        if (target && target->index == kNone) document_.warnings.add("drives no node, it is left out", element);
        if (!target)
            document_.warnings.add(fmt::format("drives '{}', which is not supported; it is left out", path), element);
        return target;
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

    /// Returns the number of morph targets if weights are driven, else 0.
    int check_target(const std::string& element, AnimatedProperty property, int index) const {
        const tinygltf::Model& model = document_.model;
        if (property == AnimatedProperty::mesh_weights) return count_morph_targets(index, element, "meshes", index);
        if (!of_node(property)) return 0;
        const tinygltf::Node& node = model.nodes[static_cast<std::size_t>(index)];
        if (property == AnimatedProperty::weights) return count_morph_targets(node.mesh, element, "nodes", index);
        if (!node.matrix.empty() && property != AnimatedProperty::visibility)
            document_.fail(element, "nodes[{}] has a matrix, which cannot be driven", index);
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

    static Interpolation interpolation_of(const Json& sampler) {
        return *interpolation_named(sampler.value("interpolation", "LINEAR"));  // check_sampler() knows the name
    }

    /// Returns the number of elements that a sampler's output must have, and has.
    std::size_t check_count(const std::string& element, const Json& sampler, std::size_t per_value) const {
        const int input = sampler.at("input"), output = sampler.at("output");
        // An accessor of weights has one element per weight.
        const std::size_t per_key = per_value * (interpolation_of(sampler) == Interpolation::cubic_spline ? 3 : 1);
        const std::size_t expected = accessors_.count(input) * per_key;
        if (accessors_.count(output) != expected)
            document_.fail(element, "its output has {} elements for {} keys, {} expected", accessors_.count(output),
                           accessors_.count(input), expected);
        return expected;
    }

    /// Checks the output of a sampler whose channel drives no node. The number of weights is then unknown.
    void check_output(std::size_t index, const GltfTarget& target) const {
        const std::string element = fmt::format("{}.samplers[{}]", element_, index);
        if (property_of(target) == AnimatedProperty::weights) return;
        accessors_.check_type(samplers_->at(index).at("output"), components_of(target), element + ".output");
        check_count(element, samplers_->at(index), 1);
    }

    Keyframes read_sampler(std::size_t index, const GltfTarget& target, int morph_targets) {
        const std::string element = fmt::format("{}.samplers[{}]", element_, index);
        const Json& from = samplers_->at(index);
        Keyframes keys;
        keys.interpolation = interpolation_of(from);
        if (property_of(target) == AnimatedProperty::visibility && keys.interpolation != Interpolation::step) {
            if (keys.interpolation == Interpolation::cubic_spline)
                document_.fail(element, "interpolates visibility, which can only be switched (STEP)");
            document_.warnings.fault("interpolates visibility, which is switched at its keys (STEP)", element);
            keys.interpolation = Interpolation::step;
        }
        const bool weights = morph_targets > 0;
        keys.rotation = property_of(target) == AnimatedProperty::rotation;
        keys.components = weights ? morph_targets : components_of(target);
        const int input = from.at("input"), output = from.at("output");
        const std::size_t expected = check_count(element, from, static_cast<std::size_t>(weights ? morph_targets : 1));
        const std::size_t bytes = sizeof(float) * (accessors_.count(input) +
                                                   expected * static_cast<std::size_t>(accessors_.components(output)));
        MemoryLedger::process().check(2 * bytes, document_.file, element);  // reading makes a copy
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
        if (keys.times[0] < 0)
            document_.warnings.add(fmt::format("its first key is at {} s, before 0", keys.times[0]), element);
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
    if (!document.animations.is_array()) document.fail("animations", "is not an array");
    if (document.animations.empty()) document.warnings.fault("is an empty list", "animations");
    Reader reader(document, memory);
    for (std::size_t i = 0; i < document.animations.size(); ++i) {
        const std::size_t bytes = memory.bytes();
        GltfWarnings warnings = std::exchange(document.warnings, {});  // warnings of a damaged animation are dropped
        Json from = document.animations[i];                            // checks change it, and it may be read again
        try {
            check_gltf_animation(from, i, document.model.accessors.size(), document.model.nodes.size(), document.file,
                                 document.warnings);
            animations.push_back(reader.read(from, i));
            warnings.add(document.warnings);
        } catch (const BudgetError&) {
            throw;
        } catch (const Error& error) {
            Animation& damaged = animations.emplace_back();
            if (from.is_object() && from.contains("name") && from["name"].is_string()) damaged.name = from["name"];
            damaged.damage = error;
            memory = {MemoryLedger::process(), MemoryPart::scene, bytes};
        }
        document.warnings = std::move(warnings);
    }
    return animations;
}

}  // namespace halflight
