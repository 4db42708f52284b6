# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# CULLET_INCLUDE_DIR: the one include folder of the build tree. A header has the same spelling there as after install,
# "cullet/<folder>/<header>", for users and inside.
#
# A folder of sources is a symbolic link there. Where those do not work, or with CULLET_FORWARDING_HEADERS, each header is a file
# that includes the one of the source tree.

include_guard(GLOBAL)

set(CULLET_GLOB_AGAIN CONFIGURE_DEPENDS)
if(CMAKE_SCRIPT_MODE_FILE)  # tests/check_forwarding_headers.cmake
    set(CULLET_GLOB_AGAIN "")
else()
    option(CULLET_FORWARDING_HEADERS "Use no symbolic links in the build tree's include folder" OFF)
    mark_as_advanced(CULLET_FORWARDING_HEADERS)
endif()

set(CULLET_INCLUDE_DIR "${PROJECT_BINARY_DIR}/include")

# Writes a file only if it changes: what includes it is compiled again otherwise.
function(cullet_forward_header header spelling)
    file(CONFIGURE OUTPUT "${CULLET_INCLUDE_DIR}/cullet/${spelling}" @ONLY
        CONTENT "#include \"${PROJECT_SOURCE_DIR}/${header}\"\n")
endfunction()

# cullet_link_sources(<path in the source tree> <spelling after cullet/>): a folder or a header.
function(cullet_link_sources path spelling)
    set(link "${CULLET_INCLUDE_DIR}/cullet/${spelling}")
    if(NOT CULLET_FORWARDING_HEADERS)
        # A folder of forwarding headers of an earlier run would be in the way.
        if(IS_DIRECTORY "${link}" AND NOT IS_SYMLINK "${link}")
            file(REMOVE_RECURSE "${link}")
        endif()
        file(CREATE_LINK "${PROJECT_SOURCE_DIR}/${path}" "${link}" RESULT failure SYMBOLIC)
        if(failure STREQUAL "0")
            return()
        endif()
        message(STATUS "no symbolic link in ${CULLET_INCLUDE_DIR} (${failure}): forwarding headers instead")
    endif()
    if(IS_SYMLINK "${link}")
        file(REMOVE "${link}")
    endif()
    if(NOT IS_DIRECTORY "${PROJECT_SOURCE_DIR}/${path}")
        cullet_forward_header("${path}" "${spelling}")
        return()
    endif()
    set(folder "${PROJECT_SOURCE_DIR}/${path}")
    file(GLOB_RECURSE headers ${CULLET_GLOB_AGAIN} RELATIVE "${folder}"
        "${folder}/*.h" "${folder}/*.inl" "${folder}/*.cuh")
    foreach(header IN LISTS headers)
        cullet_forward_header("${path}/${header}" "${spelling}/${header}")
    endforeach()
endfunction()

# Never through a link to the source tree, which this would write into.
if(IS_SYMLINK "${CULLET_INCLUDE_DIR}/cullet")
    file(REMOVE "${CULLET_INCLUDE_DIR}/cullet")
endif()
file(MAKE_DIRECTORY "${CULLET_INCLUDE_DIR}/cullet")
foreach(folder abi base broad comparison cuda demos mid narrow plugin preload python recording tests)
    cullet_link_sources(${folder} ${folder})
endforeach()
cullet_link_sources(abi/cullet.h cullet.h)
