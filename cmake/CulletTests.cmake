# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# How a test program comes to be: a name, its sources, and what ctest shall know of it.

include_guard(GLOBAL)
include(GoogleTest)
find_package(GTest REQUIRED)

# A program that runs all its tests in so many processes. GTEST_FILTER in the environment chooses among the tests.
function(cullet_add_shards target shards labels timeout)
    math(EXPR last "${shards} - 1")
    foreach(shard RANGE ${last})
        add_test(NAME ${target}.${shard} COMMAND ${target})
        set_tests_properties(${target}.${shard} PROPERTIES TIMEOUT ${timeout} LABELS "${labels}"
            ENVIRONMENT "GTEST_TOTAL_SHARDS=${shards};GTEST_SHARD_INDEX=${shard}")
    endforeach()
endfunction()

function(cullet_discover_tests target suffix labels timeout)
    if(CULLET_SANITIZE)
        # A process then takes long to start and to end; .ci/run takes one part of each program.
        cullet_add_shards(${target} 3 "${labels}" 1500)
        return()
    endif()
    # PRE_TEST: the programs are asked for their tests when ctest runs, so a build needs no GPU and no sanitizer runtime
    # settings, and a program that crashes at start does not fail the build.
    # NO_PRETTY_VALUES: without it CMake appends "# GetParam() = ..." to names that the test itself has chosen.
    gtest_discover_tests(${target} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60 NO_PRETTY_VALUES
        TEST_SUFFIX "${suffix}" TEST_LIST ${target}_discovered PROPERTIES TIMEOUT ${timeout})
    if(labels)
        # Not under PROPERTIES above: a value that is itself a list arrives there as its first element only.
        set(script "${CMAKE_CURRENT_BINARY_DIR}/${target}_labels.cmake")
        file(CONFIGURE OUTPUT "${script}" @ONLY CONTENT
"if(@target@_discovered)
    set_tests_properties(\${@target@_discovered} PROPERTIES LABELS \"@labels@\")
endif()
")
        set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${script}")
    endif()
endfunction()

function(cullet_add_to_tests target labels)
    if(NOT "slow" IN_LIST labels)
        add_dependencies(cullet_tests ${target})
        if(NOT target MATCHES "-float64$")
            add_dependencies(cullet_single_tests ${target})
            # What threads share does not depend on the scalar.
            if("threads" IN_LIST labels)
                add_dependencies(cullet_thread_tests ${target})
            endif()
        endif()
    endif()
endfunction()

# cullet_optimise_little(<target>): a test takes less time to compile so, and the libraries are optimised all the same.
function(cullet_optimise_little target)
    target_compile_options(${target} PRIVATE "$<$<NOT:$<CONFIG:Debug>>:-O1>")
endfunction()

# cullet_compile_fast(<target>): for what has none of the libraries' loops in it. Clang takes a third of the time for code that it
# instruments and does not optimise; with GCC there is little to gain.
function(cullet_compile_fast target)
    cullet_optimise_little(${target})
    if(CULLET_CLANG_SANITIZES)
        target_compile_options(${target} PRIVATE -O0)
    endif()
endfunction()

# A program without Bullet.
function(cullet_add_test_program name)
    add_executable(${name} ${ARGN})
    target_link_libraries(${name} PRIVATE cullet_flags GTest::gtest GTest::gtest_main)
endfunction()

# cullet_add_broad_test(<name> <source>... [LINK <target>...] [LABELS <label>...] [TIMEOUT <seconds>] [SHARDS <count>]
#                       [OPTIMISED])
#
# A test program without Bullet. Labels in use: gpu (needs a CUDA device), slow (left out under sanitizers), golden
# (compares with stored results), threads (worth a ThreadSanitizer run). SHARDS: ctest knows so many parts of the program in
# place of thousands of tests, of which to start a process takes longer than to run one. A prime, so that each part has tests
# of every backend: they are dealt out in turn.
function(cullet_add_broad_test name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "OPTIMISED" "TIMEOUT;SHARDS" "LINK;LABELS")
    if(NOT arg_TIMEOUT)
        set(arg_TIMEOUT 300)
    endif()
    cullet_add_test_program(${name} ${arg_UNPARSED_ARGUMENTS})
    if(NOT arg_OPTIMISED)
        cullet_optimise_little(${name})
    endif()
    target_link_libraries(${name} PRIVATE cullet::broad ${arg_LINK})
    cullet_add_to_tests(${name} "${arg_LABELS}")
    if(arg_SHARDS)
        cullet_add_shards(${name} ${arg_SHARDS} "${arg_LABELS}" ${arg_TIMEOUT})
    else()
        cullet_discover_tests(${name} "" "${arg_LABELS}" ${arg_TIMEOUT})
    endif()
endfunction()

# cullet_add_narrow_test(... [SUFFIX <of the names of its tests>]): else the same arguments; links the narrow phase instead of
# the broad one.
function(cullet_add_narrow_test name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "OPTIMISED" "TIMEOUT;SUFFIX" "LINK;LABELS")
    if(NOT arg_TIMEOUT)
        set(arg_TIMEOUT 300)
    endif()
    cullet_add_test_program(${name} ${arg_UNPARSED_ARGUMENTS})
    if(NOT arg_OPTIMISED)
        cullet_optimise_little(${name})
    endif()
    target_link_libraries(${name} PRIVATE cullet_hulls ${arg_LINK})
    cullet_add_to_tests(${name} "${arg_LABELS}")
    cullet_discover_tests(${name} "${arg_SUFFIX}" "${arg_LABELS}" ${arg_TIMEOUT})
endfunction()

# cullet_share_headers(<target> <suffix>): with Clang's sanitizers, where reading headers is a sixth of the time to compile,
# programs of one precision read them as the first one of them has compiled them. Elsewhere each reads its own, which shows
# what a test forgot to include.
function(cullet_share_headers target suffix)
    # A folder that enables C, too, has the extension that the C compiler gives to such headers, which may be GCC's.
    if(NOT (CULLET_CLANG_SANITIZES AND CMAKE_PCH_EXTENSION STREQUAL ".pch"))
        return()
    endif()
    # The compiler's cache knows these objects too, if it is told to (CCACHE_SLOPPINESS in .ci/run).
    target_compile_options(${target} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
    get_property(first GLOBAL PROPERTY CULLET_FIRST_WITH_HEADERS${suffix})
    if(first)
        target_precompile_headers(${target} REUSE_FROM ${first})
        return()
    endif()
    set_property(GLOBAL PROPERTY CULLET_FIRST_WITH_HEADERS${suffix} ${target})
    target_precompile_headers(${target} PRIVATE <gtest/gtest.h> <btBulletDynamicsCommon.h> <Eigen/Core> <Eigen/Geometry>
        <algorithm> <array> <functional> <map> <memory> <random> <set> <string> <unordered_map> <vector>)
endfunction()

# cullet_add_plugin_test(<name> <source>... [LINK <target>...] [LINK_PAIRED <target>...] [LABELS <label>...]
#                        [TIMEOUT <seconds>] [OPTIMISED])
#
# Two test programs, <name> and <name>-float64, with Bullet and the plugin in either precision; the tests of the second
# end in -float64. The plugin is optimised; a test is so only where it says OPTIMISED, for templates of which it holds the
# instance: it takes half the time to compile.
function(cullet_add_plugin_test name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "OPTIMISED" "TIMEOUT" "LINK;LINK_PAIRED;LABELS")
    if(NOT arg_TIMEOUT)
        set(arg_TIMEOUT 300)
    endif()
    cullet_add_per_precision(EXECUTABLE ${name}
        SOURCES ${arg_UNPARSED_ARGUMENTS}
        LINK ${arg_LINK} GTest::gtest GTest::gtest_main
        LINK_PAIRED cullet_plugin ${arg_LINK_PAIRED})
    foreach(scalar IN LISTS CULLET_PRECISIONS)
        cullet_precision_names(${scalar} suffix precision)
        # One that is optimised otherwise cannot take the headers of the others.
        if(NOT arg_OPTIMISED)
            cullet_compile_fast(${name}${suffix})
            cullet_share_headers(${name}${suffix} "${suffix}")
        endif()
        cullet_add_to_tests(${name}${suffix} "${arg_LABELS}")
        cullet_discover_tests(${name}${suffix} "${suffix}" "${arg_LABELS}" ${arg_TIMEOUT})
    endforeach()
endfunction()

# Every test program but slow ones, those of them that are not for double precision, and those with tests labelled threads:
# what a sanitizer build needs, without the demos.
add_custom_target(cullet_tests)
add_custom_target(cullet_single_tests)
add_custom_target(cullet_thread_tests)
