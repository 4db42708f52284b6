# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# `cpack -G DEB` in a build folder configured with -DCMAKE_INSTALL_PREFIX=/usr makes three Debian packages, one of each
# install component: libculletN, libcullet-dev and cullet-tools. Dependencies on libraries are found by dpkg-shlibdeps.

include_guard(GLOBAL)

# Nobody's address, and it says so (RFC 2606). Who distributes packages puts their own here: packaging/README.md.
set(CULLET_MAINTAINER "the cullet authors <cullet@packages.invalid>" CACHE STRING "Maintainer of the Debian packages")
mark_as_advanced(CULLET_MAINTAINER)

set(library_package "libcullet${CULLET_SOVERSION}")
set(package_names_runtime "${library_package}")
set(package_names_development libcullet-dev)
set(package_names_tools cullet-tools)
set(CPACK_COMPONENTS_ALL runtime development)
if(CULLET_DEMOS)
    list(APPEND CPACK_COMPONENTS_ALL tools)
endif()

set(CPACK_PACKAGE_NAME cullet)
set(CPACK_PACKAGE_VENDOR "the cullet authors")
set(CPACK_PACKAGE_CONTACT "${CULLET_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_GENERATOR DEB)
set(CPACK_PROJECT_CONFIG_FILE "${CMAKE_CURRENT_LIST_DIR}/check_package_tools.cmake")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME "${library_package}")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/packaging/debian/triggers")
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "broad and narrow phase for Bullet, shared libraries
cullet takes the place of btDbvtBroadphase and btCollisionDispatcher in
programs that use the Bullet physics library: faster, with exact pairs, and
with the same result on every machine. This package has the libraries for
Bullet in single and in double precision.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libcullet-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "${library_package} (= ${PROJECT_VERSION}), libbullet-dev, libeigen3-dev")
# For the recording component only.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS zlib1g-dev)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "broad and narrow phase for Bullet, development files
cullet takes the place of btDbvtBroadphase and btCollisionDispatcher in
programs that use the Bullet physics library. This package has the headers,
the archives, and what CMake and pkg-config need.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME cullet-tools)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS glmark2-data)
set(CPACK_DEBIAN_TOOLS_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/packaging/debian/triggers")
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "broad and narrow phase for Bullet, programs
cullet takes the place of btDbvtBroadphase and btCollisionDispatcher in
programs that use the Bullet physics library. This package has the program
cullet, which drops bodies and measures, and libcullet-preload.so, which
gives cullet to programs without compiling them again.")

# What Debian wants beside the files, in the packages only.
find_program(CULLET_GZIP gzip)
mark_as_advanced(CULLET_GZIP)
if(CULLET_GZIP)
    # -n: no time of day, so that the same sources give the same package.
    configure_file(packaging/debian/changelog "${PROJECT_BINARY_DIR}/changelog" @ONLY)
    execute_process(COMMAND "${CULLET_GZIP}" -9nc "${PROJECT_BINARY_DIR}/changelog"
        OUTPUT_FILE "${PROJECT_BINARY_DIR}/changelog.gz" COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND "${CULLET_GZIP}" -9nc "${PROJECT_SOURCE_DIR}/packaging/man/cullet.1"
        OUTPUT_FILE "${PROJECT_BINARY_DIR}/cullet.1.gz" COMMAND_ERROR_IS_FATAL ANY)
    foreach(component IN LISTS CPACK_COMPONENTS_ALL)
        install(FILES packaging/debian/copyright "${PROJECT_BINARY_DIR}/changelog.gz"
            DESTINATION "share/doc/${package_names_${component}}" COMPONENT ${component} EXCLUDE_FROM_ALL)
    endforeach()
    if(CULLET_DEMOS)
        foreach(scalar IN LISTS CULLET_PRECISIONS)
            cullet_precision_names(${scalar} suffix precision)
            install(FILES "${PROJECT_BINARY_DIR}/cullet.1.gz" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1"
                RENAME cullet${suffix}.1.gz COMPONENT tools)
        endforeach()
    endif()
endif()
# CMake strips programs and shared libraries, but no archives.
install(CODE "
    if(CMAKE_INSTALL_DO_STRIP)
        file(GLOB archives \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/libcullet*.a\")
        execute_process(COMMAND \"${CMAKE_STRIP}\" --strip-debug \${archives} COMMAND_ERROR_IS_FATAL ANY)
    endif()" COMPONENT development)

include(CPack)
