# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# `cpack -G DEB` runs this first: says which Debian packages it needs and does not find. Without `file` CPack makes packages that
# lack their dependencies.

if(NOT CPACK_GENERATOR STREQUAL "DEB")
    return()
endif()
set(missing "")
foreach(tool dpkg-shlibdeps:dpkg-dev dpkg-deb:dpkg file:file gzip:gzip strip:binutils)
    string(REPLACE ":" ";" tool "${tool}")
    list(GET tool 0 program)
    list(GET tool 1 package)
    find_program(CULLET_TOOL_${program} ${program})
    if(NOT CULLET_TOOL_${program})
        list(APPEND missing ${package})
    endif()
endforeach()
if(missing)
    string(REPLACE ";" " " missing "${missing}")
    message(FATAL_ERROR "cpack -G DEB needs what is not installed: apt-get install ${missing}")
endif()
