# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# CMake's toolchain file for another processor than this one, under Linux: GCC's cross compiler, the libraries that
# cmake/cross/root.sh has unpacked, and qemu to run programs.

set(CULLET_CROSS_PROCESSOR aarch64 CACHE STRING "Processor to compile for, as in the name of the cross compiler")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES CULLET_CROSS_PROCESSOR)
set(triplet ${CULLET_CROSS_PROCESSOR}-linux-gnu)
get_filename_component(root "${CMAKE_CURRENT_LIST_DIR}/../../build/root-${CULLET_CROSS_PROCESSOR}" ABSOLUTE)

set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR ${CULLET_CROSS_PROCESSOR})
set(CMAKE_C_COMPILER ${triplet}-gcc-12)
set(CMAKE_CXX_COMPILER ${triplet}-g++-12)
set(CMAKE_LIBRARY_ARCHITECTURE ${triplet})

set(CMAKE_FIND_ROOT_PATH "${root}" "/usr/${triplet}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} "${root}/usr/lib/${triplet}/pkgconfig")

# Libraries that libraries need.
foreach(kind EXE SHARED MODULE)
    set(CMAKE_${kind}_LINKER_FLAGS_INIT "-Wl,-rpath-link,${root}/usr/lib/${triplet}:${root}/lib/${triplet}")
endforeach()

# With the C library that is among the libraries.
string(REPLACE powerpc64le ppc64le qemu "qemu-${CULLET_CROSS_PROCESSOR}")
set(CMAKE_CROSSCOMPILING_EMULATOR "${qemu};-L;${root}")
