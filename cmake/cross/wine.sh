#!/usr/bin/env bash
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake/cross/wine.sh <program> [<argument>...]: runs a program for Windows, with the libraries of build/root-windows and those in
# the folder CULLET_DLLS. Wine keeps its files there too, not in the user's folder.

set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)/build/root-windows
runtime=$(dirname "$(x86_64-w64-mingw32-g++-posix -print-file-name=libstdc++-6.dll)")
export WINEPREFIX=$root/wine WINEDEBUG=${WINEDEBUG:--all} WINEDLLOVERRIDES='mscoree,mshtml='
# Z: is the root of this system's files.
export WINEPATH="${CULLET_DLLS:+Z:$CULLET_DLLS;}Z:$root/usr/bin;Z:$root/usr/x86_64-w64-mingw32/lib;Z:$runtime;Z:/usr/x86_64-w64-mingw32/lib"
exec /usr/lib/wine/wine64 "$@"
