#!/usr/bin/env bash
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake/cross/root.sh <processor>: on Debian for x86-64, what builds and runs cullet for another processor (aarch64 or
# powerpc64le): GCC's cross compiler and qemu by apt, and Debian's libraries for it, unpacked into build/root-<processor>.
# They are not installed: no package of this system changes, and apt keeps its list of processors.

# shellcheck source=cmake/bootstrap.sh
source "$(dirname "${BASH_SOURCE[0]}")/../bootstrap.sh"

processor=${1:?"a processor is missing: aarch64 or powerpc64le"}
case $processor in
    aarch64) architecture=arm64 ;;
    powerpc64le) architecture=ppc64el ;;
    *) die "no packages known for the processor '$processor'" ;;
esac
root=$CULLET_ROOT/build/root-$processor
libraries=(
    libbullet-dev libbullet-extras-dev libeigen3-dev libassimp-dev zlib1g-dev libcli11-dev nlohmann-json3-dev libgtest-dev)

need_packages cmake ninja-build ccache "g++-12-$processor-linux-gnu" qemu-user
# Once for each list of packages.
if [ -f "$root/unpacked" ] && [ "$(cat "$root/unpacked")" = "${libraries[*]}" ]; then
    exit 0
fi
rm -rf "$root"
say "unpacking libraries for $processor into $root"
apt_apart "$root/apt" "$architecture" deb
run_quietly "${apt[@]}" -y install --download-only --no-install-recommends "${libraries[@]}"
for package in "$root"/apt/cache/archives/*.deb; do
    dpkg-deb -x "$package" "$root"
done
rm -rf "$root/apt"
# CMake packages that name a library by its place in a system.
find "$root/usr" -name '*.cmake' -exec sed -i "s|/usr/lib/$processor-linux-gnu|$root&|g" {} +
printf '%s\n' "${libraries[*]}" >"$root/unpacked"
