#!/usr/bin/env bash
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake/cross/windows_root.sh: on Debian for x86-64, what builds and runs cullet for Windows: mingw-w64 and wine by apt, and in
# build/root-windows the headers that Debian has for every processor, and Bullet (single precision, shared, from Debian's
# sources) and GoogleTest by the cross compiler.

# shellcheck source=cmake/bootstrap.sh
source "$(dirname "${BASH_SOURCE[0]}")/../bootstrap.sh"

root=$CULLET_ROOT/build/root-windows
need_packages cmake ninja-build ccache g++-mingw-w64-x86-64-posix wine64 dpkg-dev
if [ -f "$root/built" ]; then
    exit 0
fi
"$CULLET_ROOT/cmake/bullet_sources.sh" debian
rm -rf "$root"
mkdir -p "$root"
cd "$root"
apt_apart "$root/apt" "$(dpkg --print-architecture)" deb
# No dependency of these is needed.
run_quietly "${apt[@]}" download libeigen3-dev nlohmann-json3-dev libcli11-dev libz-mingw-w64 libz-mingw-w64-dev \
    googletest
for package in ./*.deb; do
    dpkg-deb -x "$package" "$root"
done
rm -rf "$root/apt" ./*.deb

# built_for_windows <name> <sources> <CMake argument>...: builds and installs into the root.
built_for_windows()
{
    local name=$1 sources=$2
    shift 2
    say "building $name for Windows"
    run_quietly cmake -G Ninja -S "$sources" -B "$root/objects/$name" -DCMAKE_BUILD_TYPE=Release \
        -DCMAKE_TOOLCHAIN_FILE="$CULLET_ROOT/cmake/cross/windows.cmake" -DCMAKE_INSTALL_PREFIX="$root/usr" \
        -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache "$@"
    run_quietly cmake --build "$root/objects/$name" -j "$(job_count)" --target install
}

built_for_windows googletest "$root/usr/src/googletest" -DBUILD_GMOCK=OFF
off=()
for part in BULLET3 EXTRAS UNIT_TESTS BULLET2_DEMOS CPU_DEMOS OPENGL3_DEMOS PYBULLET ENET CLSOCKET EGL; do
    off+=("-DBUILD_$part=OFF")
done
# Debian's sources of Bullet replace commands of CMake, with which CMake's search for OpenGL does not work.
built_for_windows bullet "$CULLET_ROOT/build/bullet-debian" -DBUILD_SHARED_LIBS=ON -DINSTALL_LIBS=ON -DCMAKE_CXX_FLAGS=-w \
    -DCMAKE_DISABLE_FIND_PACKAGE_OpenGL=ON -DUSE_GRAPHICAL_BENCHMARK=OFF "${off[@]}"
rm -rf "$root/objects"
touch "$root/built"
