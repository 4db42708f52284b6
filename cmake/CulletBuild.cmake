# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# What every target of the project has in common: the language level, warnings, sanitizers, include folders, and
# the helper that builds something once per Bullet precision.

include_guard(GLOBAL)
include(GNUInstallDirs)

set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CUDA_STANDARD 17)
set(CMAKE_CUDA_STANDARD_REQUIRED ON)
# The static libraries must be usable inside shared ones (a plug-in of an engine, a Python module).
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
    set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()

if(PROJECT_IS_TOP_LEVEL)
    find_program(CULLET_CCACHE ccache)
    mark_as_advanced(CULLET_CCACHE)
    foreach(language CXX CUDA)
        if(CULLET_CCACHE AND NOT DEFINED CMAKE_${language}_COMPILER_LAUNCHER)
            set(CMAKE_${language}_COMPILER_LAUNCHER "${CULLET_CCACHE}")
        endif()
    endforeach()
endif()

if(CULLET_SANITIZE)
    # Directory scope: a sanitizer has to see every translation unit of a program, not only the libraries.
    add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${CULLET_SANITIZE};-fno-sanitize-recover=all;-fno-omit-frame-pointer>")
    if(CULLET_SANITIZE MATCHES "address" AND CULLET_SANITIZE MATCHES "undefined")
        # These two double the time to compile; AddressSanitizer stops at a null pointer by itself.
        add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:-fno-sanitize=null,alignment>")
    endif()
    add_link_options("-fsanitize=${CULLET_SANITIZE}")
    if(CULLET_SANITIZE MATCHES "thread")
        # A oneTBB that ThreadSanitizer can see through; the headers there say why.
        include_directories(BEFORE "${PROJECT_SOURCE_DIR}/tests/tsan")
    endif()
endif()

# Linked PRIVATE by every target of the project and by nothing else.
# -ffp-contract=off: the same pairs and contacts on every machine need a multiply and an add to stay two operations.
add_library(cullet_flags INTERFACE)
target_compile_options(cullet_flags INTERFACE
    "$<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wshadow;-ffp-contract=off>"
    "$<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-Wall,-Wextra,-ffp-contract=off>")
if(CULLET_WERROR)
    target_compile_options(cullet_flags INTERFACE
        "$<$<COMPILE_LANGUAGE:CXX>:-Werror>"
        "$<$<COMPILE_LANGUAGE:CUDA>:-Werror=all-warnings;-Xcompiler=-Werror>")
endif()

# <cullet/plugin/broadphase.h>, the spelling after install, works in the build tree too: a link named cullet stands for
# the source folder.
file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/include")
file(CREATE_LINK "${PROJECT_SOURCE_DIR}" "${PROJECT_BINARY_DIR}/include/cullet" SYMBOLIC)

# cullet_library_defaults(<target> [PUBLIC|INTERFACE])
function(cullet_library_defaults target)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "INTERFACE_LIBRARY")
        set(scope INTERFACE)
    else()
        set(scope PUBLIC)
        target_link_libraries(${target} PRIVATE "$<BUILD_INTERFACE:cullet_flags>")
    endif()
    target_compile_features(${target} ${scope} cxx_std_17)
    target_include_directories(${target} ${scope}
        "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>"
        "$<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>"
        "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>"
        "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/cullet>")
endfunction()

# cullet_add_per_precision(LIBRARY|EXECUTABLE <name> SOURCES <file>... [LINK <target>...] [LINK_PAIRED <target>...])
#
# Makes <name> for Bullet's float build and <name>-float64 for its double build from the same sources. A target under
# LINK_PAIRED is linked as <target> or <target>-float64, one under LINK as it is. Both Bullet builds use the same symbol
# names, so a program holds one precision only.
function(cullet_add_per_precision kind name)
    cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "SOURCES;LINK;LINK_PAIRED")
    foreach(precision float32 float64)
        if(precision STREQUAL "float32")
            set(suffix "")
            set(bullet bullet::float)
        else()
            set(suffix "-float64")
            set(bullet bullet::double)
        endif()
        set(target ${name}${suffix})
        if(kind STREQUAL "LIBRARY")
            add_library(${target} STATIC ${arg_SOURCES})
            cullet_library_defaults(${target})
            set(scope PUBLIC)
        else()
            add_executable(${target} ${arg_SOURCES})
            target_link_libraries(${target} PRIVATE cullet_flags)
            set(scope PRIVATE)
        endif()
        # PUBLIC: the inline namespace in the headers carries the precision, so that a mix-up fails to link.
        target_compile_definitions(${target} ${scope} CULLET_PRECISION=${precision})
        target_link_libraries(${target} ${scope} ${bullet} ${arg_LINK})
        foreach(paired IN LISTS arg_LINK_PAIRED)
            target_link_libraries(${target} ${scope} ${paired}${suffix})
        endforeach()
    endforeach()
endfunction()
