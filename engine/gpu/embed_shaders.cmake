# Writes OUTPUT, the definition of FUNCTION (embedded_shaders.h), from the files that LIST names below ROOT.
file(STRINGS ${LIST} names)
set(entries "")
foreach(name IN LISTS names)
    file(READ ${ROOT}/${name} text)
    string(APPEND entries "    {\"${name}\", R\"__glsl__(${text})__glsl__\"},\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"engine/gpu/embedded_shaders.h\"\n
namespace halflight::gpu {\n
const std::vector<EmbeddedShader>& ${FUNCTION}() {
    static const std::vector<EmbeddedShader> shaders = {
${entries}    };
    return shaders;
}\n
}  // namespace halflight::gpu\n")
