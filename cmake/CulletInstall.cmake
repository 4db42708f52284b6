# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# What `cmake --install` puts where, in three components that are also the three Debian packages:
#
#   runtime      libcullet.so.N, libcullet-float64.so.N
#   development  headers, links and archives, CMake package, pkg-config files
#   tools        the program `cullet`, and libcullet-preload.so
#
# A new part joins the install set in its own CMakeLists.txt, not here:
#   cullet_public_headers(<header>...)     headers of the folder, to include/cullet/<folder>/ and into the API reference
#   cullet_library_part(<target> [PAIRED]) its objects become part of libcullet.so and libcullet.a; what users call is
#                                          marked CULLET_API, or named cullet_* in C
#   install(TARGETS ... COMPONENT runtime) a library of its own, or tools for a program (with install(FILES ... man1))

include_guard(GLOBAL)
include(CMakePackageConfigHelpers)

# Everything of the components runtime and development, without programs and tests.
add_custom_target(cullet_libraries)

set(CULLET_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/cullet")

# One export file per linkage: find_package(cullet) loads one of them.
foreach(linkage shared static)
    set(targets "")
    foreach(scalar IN LISTS CULLET_PRECISIONS)
        cullet_precision_names(${scalar} suffix precision)
        set_target_properties(cullet_${linkage}${suffix} PROPERTIES EXPORT_NAME plugin${suffix})
        list(APPEND targets cullet_${linkage}${suffix})
    endforeach()
    add_dependencies(cullet_libraries ${targets})
    install(TARGETS ${targets}
        EXPORT cullet-${linkage}-targets
        RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT runtime
        LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT runtime NAMELINK_COMPONENT development
        ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
    install(EXPORT cullet-${linkage}-targets
        NAMESPACE cullet:: DESTINATION "${CULLET_PACKAGE_DIR}" COMPONENT development)
endforeach()
set_target_properties(cullet_static_broad PROPERTIES EXPORT_NAME broad)
set_target_properties(cullet_narrow PROPERTIES EXPORT_NAME narrow)
add_dependencies(cullet_libraries cullet_static_broad)
install(TARGETS cullet_static_broad cullet_narrow
    EXPORT cullet-targets
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
install(EXPORT cullet-targets NAMESPACE cullet:: DESTINATION "${CULLET_PACKAGE_DIR}" COMPONENT development)

# Archives of their own, component `recording`: only those who record need zlib.
set(targets cullet_box_stream)
foreach(scalar IN LISTS CULLET_PRECISIONS)
    cullet_precision_names(${scalar} suffix precision)
    list(APPEND targets cullet_recording${suffix})
endforeach()
add_dependencies(cullet_libraries ${targets})
install(TARGETS ${targets}
    EXPORT cullet-recording-targets
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
install(EXPORT cullet-recording-targets
    NAMESPACE cullet:: DESTINATION "${CULLET_PACKAGE_DIR}" COMPONENT development)

get_property(headers GLOBAL PROPERTY CULLET_PUBLIC_HEADERS)
# For the API reference.
string(REPLACE ";" "\n" lines "${headers}")
file(WRITE "${PROJECT_BINARY_DIR}/public-headers.txt" "${lines}\nabi/cullet.h\n")
foreach(header IN LISTS headers)
    get_filename_component(folder "${header}" DIRECTORY)
    install(FILES "${header}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/cullet/${folder}" COMPONENT development)
endforeach()

configure_package_config_file(cmake/cullet-config.cmake.in "${PROJECT_BINARY_DIR}/cullet-config.cmake"
    INSTALL_DESTINATION "${CULLET_PACKAGE_DIR}")
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/cullet-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES
    "${PROJECT_BINARY_DIR}/cullet-config.cmake"
    "${PROJECT_BINARY_DIR}/cullet-config-version.cmake"
    cmake/CulletBullet.cmake
    DESTINATION "${CULLET_PACKAGE_DIR}" COMPONENT development)

# Relative to the file itself, so that a prefix can be moved.
file(RELATIVE_PATH prefix_from_pc "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
foreach(scalar IN LISTS CULLET_PRECISIONS)
    cullet_precision_names(${scalar} suffix precision)
    configure_file(cmake/cullet.pc.in "${PROJECT_BINARY_DIR}/cullet${suffix}.pc" @ONLY)
    install(FILES "${PROJECT_BINARY_DIR}/cullet${suffix}.pc"
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT development)
endforeach()

if(CULLET_DEMOS)
    foreach(scalar IN LISTS CULLET_PRECISIONS)
        cullet_precision_names(${scalar} suffix precision)
        install(TARGETS cullet${suffix} RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT tools)
    endforeach()
endif()
