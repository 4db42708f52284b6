# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# What `cmake --install` puts where, so that find_package(cullet) gives the same target names as add_subdirectory.

include_guard(GLOBAL)
include(CMakePackageConfigHelpers)

set(CULLET_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/cullet")
install(TARGETS cullet_broad cullet_narrow cullet_cuda cullet_plugin cullet_plugin-float64
    EXPORT cullet-targets
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
# cuda/ has no public header: its factory is declared in broad/backend.h.
install(DIRECTORY broad narrow plugin
    DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/cullet"
    FILES_MATCHING PATTERN "*.h")
install(EXPORT cullet-targets NAMESPACE cullet:: DESTINATION "${CULLET_PACKAGE_DIR}")
configure_package_config_file(cmake/cullet-config.cmake.in "${PROJECT_BINARY_DIR}/cullet-config.cmake"
    INSTALL_DESTINATION "${CULLET_PACKAGE_DIR}")
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/cullet-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES
    "${PROJECT_BINARY_DIR}/cullet-config.cmake"
    "${PROJECT_BINARY_DIR}/cullet-config-version.cmake"
    cmake/CulletBullet.cmake
    DESTINATION "${CULLET_PACKAGE_DIR}")

# What LD_PRELOAD names, and beside it, in a folder of its own, what that opens.
if(TARGET cullet_preload)
    install(TARGETS cullet_preload LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
    install(TARGETS cullet_preload_float32 cullet_preload_float64
        LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}/cullet")
endif()
