# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DNM=<nm> "-DOBJECTS=<object>,..." -DTABLES=<count> ["-DALLOWED=<regex>"] -P check_weak_symbols.cmake
#
# Of the objects given, those of *_avx2.cpp and *_avx512.cpp define no weak symbol: of equal weak symbols the linker takes any,
# so that an inline function that was compiled for AVX could run on a machine without. Allowed are templates of vectors that
# only those files use. The objects define so many tables of kernels, or functions that choose them, at least.

cmake_minimum_required(VERSION 3.22)

string(REPLACE "," ";" objects "${OBJECTS}")
list(FILTER objects INCLUDE REGEX "_avx[0-9]+\\.cpp\\.o$")
set(count 0)
foreach(object IN LISTS objects)
    execute_process(COMMAND ${NM} --demangle --defined-only ${object}
        OUTPUT_VARIABLE table COMMAND_ERROR_IS_FATAL ANY)
    string(REGEX MATCHALL "[0-9a-f]+ [WVu] [^\n]+" weak "${table}")
    # A pointer to the C++ library's own function, and no code.
    list(FILTER weak EXCLUDE REGEX " V DW\\.ref\\.")
    if(ALLOWED)
        list(FILTER weak EXCLUDE REGEX "${ALLOWED}")
    endif()
    if(weak)
        list(JOIN weak "\n" lines)
        message(FATAL_ERROR "${object} defines weak symbols:\n${lines}")
    endif()
    string(REGEX MATCHALL "cullet::(float32::)?(k[A-Za-z]+Kernels|[a-z][A-Za-z]+Avx2)" tables "${table}")
    list(LENGTH tables found)
    math(EXPR count "${count} + ${found}")
endforeach()
if(count LESS TABLES)
    message(FATAL_ERROR "only ${count} tables of kernels in: ${objects}")
endif()
message(STATUS "${count} tables of kernels, no weak symbol")
