# The library halflight::halflight, which is all rooms in one archive, and the install rules.
include(CMakePackageConfigHelpers)

get_property(rooms GLOBAL PROPERTY HALFLIGHT_ROOMS)
get_property(libraries GLOBAL PROPERTY HALFLIGHT_LIBRARIES)
list(REMOVE_DUPLICATES libraries)
list(TRANSFORM rooms REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)

add_library(halflight STATIC ${objects})
add_library(halflight::halflight ALIAS halflight)
set_target_properties(halflight PROPERTIES LINKER_LANGUAGE CXX)
target_compile_features(halflight INTERFACE cxx_std_20)
target_include_directories(halflight INTERFACE
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/halflight>
    # This folder makes <halflight/halflight.h> known.
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/api> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/halflight/api>)
target_link_libraries(halflight INTERFACE ${libraries})

install(TARGETS halflight EXPORT halflight-targets)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/api/halflight
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/halflight/api FILES_MATCHING PATTERN "*.h")
install(DIRECTORY ${PROJECT_SOURCE_DIR}/engine ${PROJECT_SOURCE_DIR}/passes ${PROJECT_SOURCE_DIR}/renderer
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/halflight FILES_MATCHING PATTERN "*.h" PATTERN reference EXCLUDE)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/shaders/shared
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/halflight/shaders FILES_MATCHING PATTERN "*.h")

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/halflight)
install(EXPORT halflight-targets NAMESPACE halflight:: DESTINATION ${package_folder})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/halflight-config.cmake.in
    ${PROJECT_BINARY_DIR}/halflight-config.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/halflight-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/halflight-config.cmake ${PROJECT_BINARY_DIR}/halflight-config-version.cmake
    DESTINATION ${package_folder})

# Man pages and completions; see tools/halflight/CMakeLists.txt.
install(DIRECTORY ${PROJECT_BINARY_DIR}/manual/ DESTINATION ${CMAKE_INSTALL_DATADIR} OPTIONAL)

# Desktops: the entry with its icon, and thumbnails of file managers. shared-mime-info 2.0 and later knows the types of glTF.
install(FILES ${PROJECT_SOURCE_DIR}/tools/package/halflight.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications)
install(FILES ${PROJECT_SOURCE_DIR}/tools/package/halflight.svg
    DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps)
install(FILES ${PROJECT_SOURCE_DIR}/tools/package/halflight.thumbnailer DESTINATION ${CMAKE_INSTALL_DATADIR}/thumbnailers)

# Documents. Links from README.md to docs/ stay as they are.
set(documents ${CMAKE_INSTALL_DATADIR}/doc/halflight)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${documents})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${documents} RENAME copyright)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${documents})
