# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DROOT=<source folder> -DLIST=<public-headers.txt of the build folder> -P check_public_headers.cmake
#
# What a public header includes is public: an installed header that includes one which is not there compiles only here.

cmake_minimum_required(VERSION 3.22)

file(STRINGS "${LIST}" headers)
if(NOT headers)
    message(FATAL_ERROR "no header in ${LIST}")
endif()
set(missing "")
foreach(header IN LISTS headers)
    file(STRINGS "${ROOT}/${header}" includes REGEX "^[ \t]*#[ \t]*include[ \t]*\"")
    list(TRANSFORM includes REPLACE "^[^\"]*\"cullet/([^\"]*)\".*$" "\\1")
    foreach(include IN LISTS includes)
        if(NOT include IN_LIST headers)
            list(APPEND missing "${header}: ${include}")
        endif()
    endforeach()
endforeach()

if(missing)
    string(REPLACE ";" "\n  " missing "${missing}")
    message(FATAL_ERROR "public headers whose includes would not be installed (cullet_public_headers()):\n  ${missing}")
endif()
list(LENGTH headers count)
message(STATUS "${count} public headers: what they include is public")
