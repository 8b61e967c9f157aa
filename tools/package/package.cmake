# The .deb: `cpack -G DEB` in the build folder, once everything is built. It contains all that `cmake --install` installs.
cmake_host_system_information(RESULT release QUERY DISTRIB_VERSION_ID)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME halflight)
set(CPACK_PACKAGE_CONTACT "The Halflight contributors <halflight@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "renderer of glTF scenes with global illumination")
set(CPACK_PACKAGE_DESCRIPTION
"Halflight renders glTF scenes with global illumination. It needs OpenGL 4.5 and
no ray-tracing hardware; without a GPU, Mesa's software driver does the work.
The package contains the program, the viewer, the library for C++, the Python
module and their documents.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1~deb${release}) # libraries have other names in other releases
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
# dpkg-shlibdeps names the libraries that programs link. These are loaded at run time.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libegl1, libopengl0 | libgl1, libegl-mesa0, libgl1-mesa-dri")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "fonts-dejavu-core, shared-mime-info")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS ffmpeg)
if(TARGET halflight_python)
    set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "${CPACK_DEBIAN_PACKAGE_RECOMMENDS}, python3-numpy")
endif()
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_LIST_DIR}/prerm)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
