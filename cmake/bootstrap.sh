# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
# shellcheck shell=bash

# Sourced by demos/run, tests/run and .ci/run: from a bare Debian 12 to a build, and next to nothing when all is there.
#
# Environment, all optional:
#   CULLET_PRESET      the configure preset; default: with CUDA where nvcc is, else without
#   CULLET_CMAKE_ARGS  further arguments for the configure step; default: -DCMAKE_UNITY_BUILD=ON, which compiles several
#                      sources of tests and demos as one
#   CULLET_JOBS        parallel compiler processes; default: processors, and at most one per 1.5 GiB of memory

set -euo pipefail

CULLET_CMAKE_ARGS=${CULLET_CMAKE_ARGS--DCMAKE_UNITY_BUILD=ON}
CULLET_ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# Where cmake/install_cuda.sh puts CUDA 13, and CulletCuda.cmake looks for it.
CULLET_TOOLKIT=$CULLET_ROOT/build/cuda-toolkit/nvidia/cu13

# zlib1g-dev: the CMake package of libassimp-dev names libz.so and the Debian package does not depend on it.
CULLET_PACKAGES=(
    g++ cmake ninja-build ccache git ca-certificates
    libbullet-dev libbullet-extras-dev libeigen3-dev libassimp-dev zlib1g-dev libcli11-dev
    nlohmann-json3-dev libgtest-dev glmark2-data)

say()
{
    printf '%s\n' "cullet: $*" >&2
}

die()
{
    say "$@"
    exit 1
}

# run_quietly <command>...: the output only if it fails.
run_quietly()
{
    local log status=0
    log=$(mktemp)
    "$@" >"$log" 2>&1 </dev/null || status=$?
    if [ "$status" -ne 0 ]; then
        cat "$log" >&2
    fi
    rm -f "$log"
    return "$status"
}

# need_packages <package>...: installs with apt what is not installed.
need_packages()
{
    local missing=() package
    if ! command -v dpkg-query >/dev/null; then
        say "not a Debian system; taking for granted: $*"
        return
    fi
    local installed
    installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "$@" 2>/dev/null || true)
    for package in "$@"; do
        case $'\n'"$installed"$'\n' in
            *$'\n'"installed $package"$'\n'*) ;;
            *) missing+=("$package") ;;
        esac
    done
    if [ "${#missing[@]}" -eq 0 ]; then
        return
    fi

    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null; then
            die "needs root once, and there is no sudo; as root: apt-get install ${missing[*]}"
        fi
        as_root=(sudo)
    fi
    say "installing ${missing[*]}"
    local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300)
    # A failed update is not yet the end: the lists that are there may do.
    run_quietly "${apt[@]}" update || say "apt-get update failed; trying with the package lists that are there"
    run_quietly "${apt[@]}" install -y --no-install-recommends "${missing[@]}" || die "could not install ${missing[*]}"
    has_installed=1
}

# apt_apart <folder> <architecture> <deb|deb-src>: sets the array $apt to an apt-get with a state of its own in <folder>, which knows
# Debian's packages or sources of this release for an architecture, and updates it. Nothing is installed there, so that the C
# library is among the packages that others need, and the system's apt does not change.
apt_apart()
{
    local folder=$1 suite keyring=/usr/share/keyrings/debian-archive-keyring.gpg
    need_packages debian-archive-keyring
    # shellcheck source=/dev/null
    suite=$(. /etc/os-release && printf '%s' "$VERSION_CODENAME")
    mkdir -p "$folder/lists/partial" "$folder/cache/archives/partial"
    touch "$folder/status"
    printf '%s [signed-by=%s] http://deb.debian.org/debian %s main\n' "$3" "$keyring" "$suite" >"$folder/sources.list"
    apt=(apt-get -qq -o "APT::Architecture=$2" -o "APT::Architectures::=$2" -o "Dir::State=$folder"
        -o "Dir::State::status=$folder/status" -o "Dir::Cache=$folder/cache" -o "Dir::Etc::sourcelist=$folder/sources.list"
        -o Dir::Etc::sourceparts=/dev/null -o APT::Sandbox::User=root)
    run_quietly "${apt[@]}" update
}

nvcc_path()
{
    if [ -n "${CUDACXX:-}" ]; then
        command -v "$CUDACXX"
    else
        PATH=$PATH:/usr/local/cuda/bin:$CULLET_TOOLKIT/bin command -v nvcc
    fi
}

has_nvidia_gpu()
{
    # Opened: a device node alone is no driver.
    [ -e /proc/driver/nvidia/version ] || (: </dev/nvidiactl) 2>/dev/null || [ -e /dev/dxg ]
}

# offer_cuda: on a terminal asks whether to install nvcc, elsewhere says how.
offer_cuda()
{
    local answer=no
    say "there is an NVIDIA GPU and no nvcc: without it, cullet is built without CUDA"
    if [ -t 0 ] && [ -t 2 ]; then
        read -r -p "cullet: install the CUDA toolkit now, under NVIDIA's licence (cmake/install_cuda.sh)? [y/N] " answer
    fi
    case $answer in
        [yY]*) "$CULLET_ROOT/cmake/install_cuda.sh" || say "going on without CUDA" ;;
        *) say "to use the GPU, run cmake/install_cuda.sh, or install CUDA 11.8 or later yourself, and try again" ;;
    esac
}

job_count()
{
    if [ -n "${CULLET_JOBS:-}" ]; then
        printf '%s\n' "$CULLET_JOBS"
        return
    fi
    local processors by_memory
    processors=$(nproc)
    # Optimised Eigen and Bullet code takes up to 1 GiB per compiler process.
    by_memory=$(awk '/^MemAvailable:/ { print int($2 / 1572864) }' /proc/meminfo)
    if [ "$by_memory" -lt 1 ]; then
        by_memory=1
    fi
    printf '%s\n' "$((processors < by_memory ? processors : by_memory))"
}

# configure <preset>: only if this has not been done with these arguments and packages; ninja itself sees changed CMake
# files.
configure()
{
    local build=$CULLET_ROOT/build/$1 arguments="$CULLET_CMAKE_ARGS"
    if [ -z "${has_installed:-}" ] && [ -f "$build/build.ninja" ] && [ "$build/configured" -nt "$CULLET_ROOT/CMakePresets.json" ] &&
        [ "$(cat "$build/configured")" = "$arguments" ]; then
        return
    fi
    say "configuring $1"
    # Unquoted on purpose: a list of arguments.
    # shellcheck disable=SC2086
    (cd "$CULLET_ROOT" && run_quietly cmake --preset "$1" $arguments) || return
    printf '%s\n' "$arguments" >"$build/configured"
}

# prepare <preset without CUDA>: installs and configures; sets $preset to the one to build.
prepare()
{
    need_packages "${CULLET_PACKAGES[@]}"
    preset=${CULLET_PRESET:-$1}
    if [ -z "${CULLET_PRESET:-}" ]; then
        if ! nvcc_path >/dev/null && has_nvidia_gpu; then
            offer_cuda
        fi
        if nvcc_path >/dev/null; then
            if configure cuda; then
                preset=cuda
                return
            fi
            # An nvcc that does not accept the installed C++ compiler, most often.
            say "the CUDA build cannot be configured (see above); going on without CUDA"
        fi
    fi
    configure "$preset" || die "the configure step failed"
}

# program_of <argument>...: the program of demos/ that these arguments need, and no more than that is built.
program_of()
{
    local name=cullet argument previous=""
    if [ "${1:-run}" = run ]; then
        name=cullet-run
    fi
    for argument in "$@"; do
        case $previous$argument in
            --precision=double | --precision/double) name+=-float64 && break ;;
            --precision=* | --precision/*) break ;;
        esac
        previous=""
        if [ "$argument" = --precision ]; then
            previous=--precision/
        fi
    done
    printf '%s\n' "$name"
}

# build <preset> [<target>...]: quiet when there is nothing to do.
build()
{
    local preset=$1
    shift
    local targets=()
    if [ "$#" -gt 0 ]; then
        targets=(--target "$@")
    fi
    # To stderr: a demo's own output may be piped into something.
    (cd "$CULLET_ROOT" && cmake --build --preset "$preset" -j "$(job_count)" "${targets[@]}" |
        { grep --line-buffered -v '^ninja: no work to do\.$' || true; }) >&2
}
