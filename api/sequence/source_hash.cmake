# cmake -DROOT=DIR -DOUTPUT=FILE.cpp -DBUILD=TEXT -P source_hash.cmake: writes the source of halflight::source_hash().
#
# It is a hash of the sources on which a picture depends, and of TEXT, which names libraries and options of the build.
# Programs, tests and documents do not count, so a change of these alone keeps the fingerprints of frames.
if(NOT ROOT OR NOT OUTPUT)
    message(FATAL_ERROR "source_hash.cmake: ROOT and OUTPUT are required")
endif()
include(${CMAKE_CURRENT_LIST_DIR}/source_list.cmake)
halflight_picture_sources(${ROOT} sources)
set(all "${BUILD}\n")
foreach(source IN LISTS sources)
    file(SHA256 ${ROOT}/${source} hash)
    string(APPEND all "${source} ${hash}\n")
endforeach()
string(SHA256 hash "${all}")
string(SUBSTRING ${hash} 0 16 hash)
file(WRITE ${OUTPUT} "#include \"api/sequence/source_hash.h\"

namespace halflight {

const char* source_hash() {
    return \"${hash}\";
}

}  // namespace halflight
")
