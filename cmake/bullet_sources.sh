#!/usr/bin/env bash
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake/bullet_sources.sh debian|pybullet: Bullet's sources into build/bullet-<name>, for CULLET_BULLET_SOURCE. From Debian's
# source package, which is 3.24 in Debian 12 and has Bullet's own CMake files, or from the source distribution of pybullet 3.2.7 on
# PyPI, which brings along the library's sources of 3.26 without them.

# shellcheck source=cmake/bootstrap.sh
source "$(dirname "${BASH_SOURCE[0]}")/bootstrap.sh"

name=${1:?"which sources: debian or pybullet"}
folder=$CULLET_ROOT/build/bullet-$name
if [ -f "$folder/src/btBulletDynamicsCommon.h" ]; then
    exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
say "Bullet's sources ($name) into $folder"
case $name in
    debian)
        need_packages dpkg-dev
        apt_apart "$scratch/apt" "$(dpkg --print-architecture)" deb-src
        run_quietly "${apt[@]}" source bullet
        unpacked=(bullet-*/)
        ;;
    pybullet)
        need_packages python3-venv python3-dev
        # pip asks the distribution for its metadata.
        run_quietly /usr/bin/python3 -m venv venv
        run_quietly venv/bin/pip download --no-deps --no-binary :all: pybullet==3.2.7
        tar -xzf pybullet-*.tar.gz --wildcards 'pybullet-*/src/*'
        unpacked=(pybullet-*/)
        ;;
    *) die "no sources known as '$name'" ;;
esac
mkdir -p "$CULLET_ROOT/build"
rm -rf "$folder"
mv "${unpacked[0]}" "$folder"
