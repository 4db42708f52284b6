# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DROOT=<source folder> -DBUILD=<folder to make> -DCOMPILER=<C++ compiler> -DFLAGS=<a,list> -P check_forwarding_headers.cmake
#
# Where symbolic links do not work, the include folder of the build tree has a file for each header: a user's program compiles
# with them, and a second run changes none.

cmake_minimum_required(VERSION 3.22)

file(REMOVE_RECURSE "${BUILD}")
set(PROJECT_SOURCE_DIR "${ROOT}")
set(PROJECT_BINARY_DIR "${BUILD}")
set(CULLET_FORWARDING_HEADERS ON)
include("${ROOT}/cmake/CulletIncludes.cmake")

foreach(header cullet.h broad/backend.h plugin/broadphase.h)
    if(IS_SYMLINK "${CULLET_INCLUDE_DIR}/cullet/${header}" OR NOT EXISTS "${CULLET_INCLUDE_DIR}/cullet/${header}")
        message(FATAL_ERROR "${header} is no forwarding header")
    endif()
endforeach()
string(REPLACE "," ";" flags "${FLAGS}")
foreach(source main.cpp arrays.cpp)
    execute_process(
        COMMAND "${COMPILER}" -std=c++17 -fsyntax-only "-I${CULLET_INCLUDE_DIR}" ${flags} "${ROOT}/tests/consumer/${source}"
        COMMAND_ERROR_IS_FATAL ANY)
endforeach()

file(TIMESTAMP "${CULLET_INCLUDE_DIR}/cullet/cullet.h" before "%s")
execute_process(COMMAND "${CMAKE_COMMAND}" -E sleep 1.1)
cullet_link_sources(abi/cullet.h cullet.h)
file(TIMESTAMP "${CULLET_INCLUDE_DIR}/cullet/cullet.h" after "%s")
if(NOT before STREQUAL after)
    message(FATAL_ERROR "a second run has written the headers again")
endif()
message(STATUS "forwarding headers stand for links")
