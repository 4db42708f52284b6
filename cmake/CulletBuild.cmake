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

set(CULLET_CLANG_SANITIZES OFF)
if(CULLET_SANITIZE)
    if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
        set(CULLET_CLANG_SANITIZES ON)
    endif()
    # Directory scope: a sanitizer has to see every translation unit of a program, not only the libraries.
    add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${CULLET_SANITIZE};-fno-sanitize-recover=all;-fno-omit-frame-pointer>")
    if(CULLET_SANITIZE MATCHES "address" AND CULLET_SANITIZE MATCHES "undefined")
        # These two double the time to compile; AddressSanitizer stops at a null pointer by itself.
        add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:-fno-sanitize=null,alignment>")
    endif()
    add_link_options("-fsanitize=${CULLET_SANITIZE}")
endif()

# -DCMAKE_UNITY_BUILD=ON compiles several sources as one in the folders that ask for it, tests and demos. What is installed
# never is; a build that is not to be installed, as that of a sanitizer, compiles the libraries so, too.
set(CULLET_UNITY "${CMAKE_UNITY_BUILD}")
option(CULLET_UNITY_LIBRARIES "With CMAKE_UNITY_BUILD: the libraries, too, which then are not to be installed" OFF)
mark_as_advanced(CULLET_UNITY_LIBRARIES)
if(NOT CULLET_SANITIZE AND NOT CULLET_UNITY_LIBRARIES)
    set(CMAKE_UNITY_BUILD OFF)
endif()
# Below that a job's memory, above it most of what there is to gain.
set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)

# Linked PRIVATE by every target of the project and by nothing else.
# Several sources compiled as one may well hide each other's names, and what is in an unnamed namespace then looks to GCC as
# if it were in a header.
# maytrap: Clang would else divide in lanes that nobody uses, which raises the flags of floating-point exceptions; GCC does not.
# -ffp-contract=off: the same pairs and contacts on every machine need a multiply and an add to stay two operations.
# __ARM_FEATURE_FMA: where it is defined Eigen's vectors multiply and add by one instruction, whatever the compiler is told.
include(CheckCXXCompilerFlag)
check_cxx_compiler_flag("-Werror -ffp-exception-behavior=maytrap" CULLET_HAS_MAYTRAP)
add_library(cullet_flags INTERFACE)
target_compile_options(cullet_flags INTERFACE
    "$<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-ffp-contract=off>"
    "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${CULLET_HAS_MAYTRAP}>>:-ffp-exception-behavior=maytrap>"
    "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<NOT:$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>>:-Wshadow>"
    "$<$<AND:$<COMPILE_LANG_AND_ID:CXX,GNU>,$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wno-subobject-linkage>"
    "$<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-Wall,-Wextra,-ffp-contract=off>")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)")
    target_compile_options(cullet_flags INTERFACE "$<$<COMPILE_LANGUAGE:CXX>:-U__ARM_FEATURE_FMA>")
endif()
# GCC aligns the stack of Windows to 16 bytes, and moves 32 and 64 bytes as if it were aligned to as many (GCC bug 54412): the
# assembler writes the moves that need no alignment. Programs with the headers of `narrow` need it, too. An object of many
# templates has more sections than its first format allows.
set(CULLET_UNALIGNED_MOVES
    "$<$<AND:$<PLATFORM_ID:Windows>,$<COMPILE_LANG_AND_ID:CXX,GNU>>:-Wa,-muse-unaligned-vector-move>")
target_compile_options(cullet_flags INTERFACE "${CULLET_UNALIGNED_MOVES}"
    "$<$<AND:$<PLATFORM_ID:Windows>,$<COMPILE_LANG_AND_ID:CXX,GNU>>:-Wa,-mbig-obj>")
if(CULLET_WERROR)
    # What libstdc++ before 13 calls in std::inplace_merge it also deprecates, and Clang from 18 on does not keep that to itself.
    target_compile_options(cullet_flags INTERFACE
        "$<$<COMPILE_LANGUAGE:CXX>:-Werror>"
        "$<$<COMPILE_LANG_AND_ID:CXX,Clang>:-Wno-error=deprecated-declarations>"
        "$<$<COMPILE_LANGUAGE:CUDA>:-Werror=all-warnings;-Xcompiler=-Werror>")
endif()

include(CulletIncludes)

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
        "$<BUILD_INTERFACE:${CULLET_INCLUDE_DIR}>"
        "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
endfunction()

# cullet_public_headers(<header>...): what users may include, of the current folder. Listed without those of the folder that
# they do not need: an installed header that nobody may use is a promise.
function(cullet_public_headers)
    file(RELATIVE_PATH folder "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
    list(TRANSFORM ARGN PREPEND "${folder}/")
    set_property(GLOBAL APPEND PROPERTY CULLET_PUBLIC_HEADERS ${ARGN})
endfunction()

# cullet_library_part(<target> [PAIRED|WITH_BULLET])
#
# Puts the objects of a library into the shared and the static library that get installed (CulletLibraries.cmake), and
# hides what CULLET_API does not mark. PAIRED: <target> goes into the one of float32, <target>-float64 into the other;
# else <target> goes into both, and into the archive without Bullet unless it says WITH_BULLET.
function(cullet_library_part target)
    cmake_parse_arguments(PARSE_ARGV 1 arg "PAIRED;WITH_BULLET" "" "")
    if(arg_PAIRED)
        set_property(GLOBAL APPEND PROPERTY CULLET_PAIRED_PARTS ${target})
        set(targets ${target} ${target}-float64)
    elseif(arg_WITH_BULLET)
        set_property(GLOBAL APPEND PROPERTY CULLET_PARTS_WITH_BULLET ${target})
        set(targets ${target})
    else()
        set_property(GLOBAL APPEND PROPERTY CULLET_PARTS ${target})
        set(targets ${target})
    endif()
    foreach(part IN LISTS targets)
        if(TARGET ${part})
            set_target_properties(${part} PROPERTIES
                CXX_VISIBILITY_PRESET hidden CUDA_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
            # Where cullet_flags leaves it out, since sources of tests are compiled as one.
            target_compile_options(${part} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:-Wshadow>")
            # Position independent code would otherwise keep the compiler from inlining what another library might
            # replace.
            target_compile_options(${part} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:-fno-semantic-interposition>")
            if(WIN32)
                target_compile_definitions(${part} PRIVATE CULLET_BUILDS_LIBRARY)
            endif()
        endif()
    endforeach()
endfunction()

# cullet_precision_names(float|double <suffix> <precision>): "" and float32, or -float64 and float64.
function(cullet_precision_names scalar suffix precision)
    if(scalar STREQUAL "float")
        set(${suffix} "" PARENT_SCOPE)
        set(${precision} float32 PARENT_SCOPE)
    else()
        set(${suffix} "-float64" PARENT_SCOPE)
        set(${precision} float64 PARENT_SCOPE)
    endif()
endfunction()

# cullet_add_per_precision(LIBRARY|EXECUTABLE <name> SOURCES <file>... [LINK <target>...] [LINK_PAIRED <target>...])
#
# Makes <name> for Bullet's float build and <name>-float64 for its double build from the same sources. A target under
# LINK_PAIRED is linked as <target> or <target>-float64, one under LINK as it is. Both Bullet builds use the same symbol
# names, so a program holds one precision only. Precisions that CULLET_PRECISIONS leaves out are left out here.
function(cullet_add_per_precision kind name)
    cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "SOURCES;LINK;LINK_PAIRED")
    foreach(scalar IN LISTS CULLET_PRECISIONS)
        set(bullet bullet::${scalar})
        cullet_precision_names(${scalar} suffix precision)
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
        # Users' files get the same from plugin/core/precision.h, by what Bullet is compiled with.
        target_compile_definitions(${target} PRIVATE CULLET_PRECISION=${precision})
        target_link_libraries(${target} ${scope} ${bullet} ${arg_LINK})
        foreach(paired IN LISTS arg_LINK_PAIRED)
            target_link_libraries(${target} ${scope} ${paired}${suffix})
        endforeach()
    endforeach()
endfunction()
