# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# An overlay port that lies in cullet's own source tree and builds that tree:
#   vcpkg install cullet --overlay-ports=<cullet>/packaging/vcpkg/ports

get_filename_component(SOURCE_PATH "${CURRENT_PORT_DIR}/../../../.." ABSOLUTE)

vcpkg_check_features(OUT_FEATURE_OPTIONS options FEATURES cuda CULLET_CUDA)
# vcpkg's bullet3 is built in one precision, the one of its feature double-precision.
set(precision float)
if(EXISTS "${CURRENT_INSTALLED_DIR}/share/bullet3/BulletConfig.cmake")
    file(READ "${CURRENT_INSTALLED_DIR}/share/bullet3/BulletConfig.cmake" config)
    if(config MATCHES "DBT_USE_DOUBLE_PRECISION")
        set(precision double)
    endif()
endif()

vcpkg_cmake_configure(
    SOURCE_PATH "${SOURCE_PATH}"
    OPTIONS
        ${options}
        -DCULLET_PRECISIONS=${precision}
        -DCULLET_PRELOAD=OFF
        -DCULLET_TESTS=OFF
        -DCULLET_DEMOS=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/cullet)
vcpkg_fixup_pkgconfig()

# One linkage per triplet, as vcpkg wants it; the broad phase without Bullet and recordings are archives in both.
if(VCPKG_LIBRARY_LINKAGE STREQUAL "static")
    set(other shared)
    set(pattern "libcullet*.so*")
else()
    set(other static)
    set(pattern "libcullet*.a")
endif()
file(GLOB others
    "${CURRENT_PACKAGES_DIR}/lib/${pattern}"
    "${CURRENT_PACKAGES_DIR}/debug/lib/${pattern}"
    "${CURRENT_PACKAGES_DIR}/share/cullet/cullet-${other}-targets*.cmake")
list(FILTER others EXCLUDE REGEX "libcullet_[a-z_]+(-float64)?\\.a$")
file(REMOVE ${others})
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
