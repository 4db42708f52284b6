# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# CMake's toolchain file for Windows on x86-64, by mingw-w64 under Debian: the libraries that cmake/cross/windows_root.sh has
# built, and wine to run programs. The variant of GCC with POSIX threads, since the other one has no std::thread.

set(triplet x86_64-w64-mingw32)
get_filename_component(root "${CMAKE_CURRENT_LIST_DIR}/../../build/root-windows" ABSOLUTE)

set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER ${triplet}-gcc-posix)
set(CMAKE_CXX_COMPILER ${triplet}-g++-posix)
set(CMAKE_RC_COMPILER ${triplet}-windres)

# The first, so that what is installed in there can be named by its own path.
set(CMAKE_FIND_ROOT_PATH "${root}" "${root}/usr" "${root}/usr/${triplet}" "/usr/${triplet}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

set(CMAKE_CROSSCOMPILING_EMULATOR "${CMAKE_CURRENT_LIST_DIR}/wine.sh")
