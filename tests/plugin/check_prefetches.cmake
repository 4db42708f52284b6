# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DNM=<nm> "-DOBJECTS=<object>,..." "-DALLOWED=<regex>" -P check_prefetches.cmake
#
# The objects define no function of the name prefetch*. GCC removes calls of functions that do nothing but prefetch, unless
# they are inlined before; such a function that is still in an object has lost its calls. Allowed are those whose address is
# taken.

cmake_minimum_required(VERSION 3.22)

string(REPLACE "," ";" objects "${OBJECTS}")
set(count 0)
foreach(object IN LISTS objects)
    execute_process(COMMAND ${NM} --demangle --defined-only ${object}
        OUTPUT_VARIABLE table COMMAND_ERROR_IS_FATAL ANY)
    string(REGEX MATCHALL "[0-9a-f]+ [tTwW] [^\n]*::prefetch[A-Za-z]*\\([^\n]*" functions "${table}")
    list(LENGTH functions found)
    math(EXPR count "${count} + ${found}")
    list(FILTER functions EXCLUDE REGEX "${ALLOWED}")
    if(functions)
        list(JOIN functions "\n" lines)
        message(FATAL_ERROR "${object} defines:\n${lines}")
    endif()
endforeach()
if(count EQUAL 0)
    message(FATAL_ERROR "the objects define no function of ${ALLOWED}, so the names have changed")
endif()
message(STATUS "${count} functions whose address is taken")
