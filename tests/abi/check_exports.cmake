# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DNM=<nm> -DLIBRARY=<libcullet.so> -DHEADER=<cullet.h> -P check_exports.cmake
#
# The library exports the functions that the C header declares and, beside the versioned names of its C++ interface,
# nothing else: any other symbol could meet another version of itself in a program.

cmake_minimum_required(VERSION 3.22)

execute_process(COMMAND ${NM} -D --defined-only ${LIBRARY} OUTPUT_VARIABLE table COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^ \n]+\n" exported "${table}")
list(TRANSFORM exported REPLACE "(@.*)?\n$" "")
list(FILTER exported EXCLUDE REGEX "^(CULLET_[0-9.]+|_Z[A-Z]*N?K?6cullet.*)$")
list(SORT exported)

file(READ ${HEADER} text)
string(REGEX MATCHALL "CULLET_C_API [A-Za-z0-9_ ]+[ *]+cullet_[a-z_]+\\(" declared "${text}")
list(TRANSFORM declared REPLACE ".*[ *](cullet_[a-z_]+)\\($" "\\1")
list(SORT declared)

list(LENGTH declared count)
if(NOT exported STREQUAL declared OR count LESS 20)
    message(FATAL_ERROR "declared: ${declared}\nexported: ${exported}")
endif()
message(STATUS "${count} functions, as declared")
