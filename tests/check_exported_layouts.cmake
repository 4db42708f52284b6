# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DROOT=<source folder> -DLIST=<public-headers.txt of the build folder> -P check_exported_layouts.cmake
#
# Debug containers (_GLIBCXX_DEBUG) change the layout of standard containers, so that a program with them and the library without
# them would read each other's members at wrong places. No public header holds one by value but those of narrow/, which are
# templates without a library of their own and include narrow/math/debug_containers.h. Parameters by reference are allowed: the
# linker knows a container by its name.

cmake_minimum_required(VERSION 3.22)

set(containers "vector|deque|list|forward_list|map|multimap|set|multiset|unordered_[a-z]+|basic_string|string|function|bitset|any|queue|priority_queue|stack")
file(STRINGS "${LIST}" headers)
if(NOT headers)
    message(FATAL_ERROR "no header in ${LIST}")
endif()
set(wrong "")
foreach(header IN LISTS headers)
    file(STRINGS "${ROOT}/${header}" lines)
    string(FIND "${lines}" "#include \"cullet/narrow/math/debug_containers.h\"" guard)
    if(header MATCHES "^narrow/" AND NOT guard EQUAL -1)
        continue()
    endif()
    foreach(line IN LISTS lines)
        string(REGEX REPLACE "//.*$" "" line "${line}")
        string(REGEX REPLACE "std::(${containers})(<[^()]*>)? *[&*]" "" line "${line}")
        if(line MATCHES "std::(${containers})([^a-z_]|$)")
            list(APPEND wrong "${header}: ${line}")
        endif()
    endforeach()
endforeach()

if(wrong)
    string(REPLACE ";" "\n  " wrong "${wrong}")
    message(FATAL_ERROR "standard containers in public headers (use broad/array.h, or hide them):\n  ${wrong}")
endif()
list(LENGTH headers count)
message(STATUS "${count} public headers: no layout depends on the mode of the standard containers")
