#include "engine/color/ocio.h"
#include "engine/core/error.h"

namespace halflight {
namespace {

// Mirrors ViewProcessor::apply() on the CPU; {} stands for the steps before the processor. mix() with a bool vector
// selects, so that a NaN is not multiplied.
constexpr const char* kWrapper = R"glsl(
vec4 ocio_view(vec4 pixel)
{{
    vec3 colour = clamp(mix(pixel.rgb, vec3(0.0), isnan(pixel.rgb)), -65504.0, 65504.0);
{}    colour = ocio_transform(vec4(colour, 1.0)).rgb;
    return vec4(clamp(mix(colour, vec3(0.0), isnan(colour)), 0.0, 1.0), pixel.a);
}}
)glsl";

GpuLut texture_2d(const ocio::GpuShaderDesc& desc, unsigned index) {
    const char* name = nullptr;
    const char* sampler = nullptr;
    unsigned width = 0;
    unsigned height = 0;
    auto channel = ocio::GpuShaderDesc::TEXTURE_RGB_CHANNEL;
    auto interpolation = ocio::INTERP_LINEAR;
    desc.getTexture(index, name, sampler, width, height, channel, interpolation);
    const float* values = nullptr;
    desc.getTextureValues(index, values);
    GpuLut lut;
    lut.sampler = sampler;
    lut.dimensions = height > 1 ? 2 : 1;
    lut.width = static_cast<int>(width);
    lut.height = static_cast<int>(height);
    lut.channels = channel == ocio::GpuShaderDesc::TEXTURE_RED_CHANNEL ? 1 : 3;
    lut.linear = interpolation != ocio::INTERP_NEAREST;
    lut.values.assign(values, values + std::size_t{width} * height * static_cast<unsigned>(lut.channels));
    return lut;
}

GpuLut texture_3d(const ocio::GpuShaderDesc& desc, unsigned index) {
    const char* name = nullptr;
    const char* sampler = nullptr;
    unsigned edge = 0;
    auto interpolation = ocio::INTERP_LINEAR;
    desc.get3DTexture(index, name, sampler, edge, interpolation);
    const float* values = nullptr;
    desc.get3DTextureValues(index, values);
    GpuLut lut;
    lut.sampler = sampler;
    lut.width = lut.height = lut.depth = static_cast<int>(edge);
    lut.linear = interpolation != ocio::INTERP_NEAREST && interpolation != ocio::INTERP_TETRAHEDRAL;
    lut.values.assign(values, values + std::size_t{3} * edge * edge * edge);
    return lut;
}

/// Adds the function `name` of a processor, its textures and its cache id to a shader.
void add_function(GpuShader& shader, const ocio::ConstProcessorRcPtr& processor, const std::string& name,
                  const std::string& view) {
    ocio::GpuShaderDescRcPtr desc = ocio::GpuShaderDesc::CreateShaderDesc();
    desc->setLanguage(ocio::GPU_LANGUAGE_GLSL_4_0);
    desc->setFunctionName(name.c_str());
    desc->setResourcePrefix(name == "ocio_transform" ? "ocio_" : "ocio_looks_");
    processor->getOptimizedGPUProcessor(kOptimization)->extractGpuShaderInfo(desc);
    // Uniforms stand for properties that change after extraction; our transforms have none.
    if (desc->getNumUniforms() != 0)
        throw Error("view transform", "view \"{}\" has dynamic properties, which are not supported", view);
    shader.glsl += desc->getShaderText();
    for (unsigned i = 0; i < desc->getNumTextures(); ++i) shader.luts.push_back(texture_2d(*desc, i));
    for (unsigned i = 0; i < desc->getNum3DTextures(); ++i) shader.luts.push_back(texture_3d(*desc, i));
    shader.cache_id += desc->getCacheID();
}

}  // namespace

GpuShader ViewProcessor::gpu_shader() const {
    try {
        GpuShader shader;
        std::string steps;
        if (data_->looks) {
            add_function(shader, data_->looks, "ocio_looks", data_->view);
            steps += "    colour = ocio_looks(vec4(colour, 1.0)).rgb;\n";
        }
        if (data_->tone_map) {
            shader.glsl += "#include \"shaders/shared/tone_map.h\"\n";
            shader.cache_id += data_->tone_map->function;
            steps += fmt::format("    colour = {}(colour);\n", data_->tone_map->function);
        }
        add_function(shader, data_->processor, "ocio_transform", data_->view);
        shader.glsl += fmt::format(kWrapper, steps);
        return shader;
    } catch (const ocio::Exception& e) {
        throw Error("view transform", "view \"{}\" has no GPU form: {}", data_->view, e.what());
    }
}

}  // namespace halflight
