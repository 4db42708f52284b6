# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# Included by project() of the copy that tests/mutation/run builds: every target links the choice of mutants, and every
# test program records which ones it reaches. CULLET_MUTATION_RUNTIME: this folder.

add_library(cullet_mutants STATIC "${CULLET_MUTATION_RUNTIME}/mutants.cpp")
target_compile_features(cullet_mutants PRIVATE cxx_std_17)
target_include_directories(cullet_mutants PRIVATE "${CMAKE_BINARY_DIR}/include")
set_target_properties(cullet_mutants PROPERTIES POSITION_INDEPENDENT_CODE ON)
link_libraries(cullet_mutants)

# Only demos need these, and no program of programs.txt needs a demo.
foreach(package assimp nlohmann_json)
    find_package(${package} CONFIG QUIET)
    if(NOT ${package}_FOUND)
        set(folder "${CMAKE_BINARY_DIR}/missing/${package}")
        file(WRITE "${folder}/${package}Config.cmake" "add_library(${package}::${package} INTERFACE IMPORTED)\n")
        file(WRITE "${folder}/${package}ConfigVersion.cmake" "set(PACKAGE_VERSION 3)\nset(PACKAGE_VERSION_COMPATIBLE TRUE)\n")
        set(${package}_DIR "${folder}" CACHE PATH "stands for what is not installed" FORCE)
    endif()
endforeach()

function(cullet_record_reach)
    add_library(cullet_reach_listener OBJECT "${CULLET_MUTATION_RUNTIME}/reach_listener.cpp")
    target_include_directories(cullet_reach_listener PRIVATE "${CMAKE_BINARY_DIR}/include")
    target_link_libraries(cullet_reach_listener PRIVATE GTest::gtest)
    set_property(TARGET GTest::gtest_main APPEND PROPERTY INTERFACE_SOURCES $<TARGET_OBJECTS:cullet_reach_listener>)
endfunction()
cmake_language(DEFER DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" CALL cullet_record_reach)
