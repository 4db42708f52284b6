#!/usr/bin/env bash
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# preload/demonstration/upstream.sh <libcullet-preload.so> <folder with Debian's sources of dart and siconos>
#
# Builds unchanged test programs from the sources of DART and Siconos against Debian's packages, and runs each without
# cullet, with its broad phase, and with ISA-GJK too. Prints whether its own checks pass, and whether its output is the
# same. Preparation, with a deb-src line in apt's sources:
#
#   apt-get install libdart-all-dev libgtest-dev libcppunit-dev libsiconos-mechanics-dev libsiconos-control-dev
#   cd <folder> && apt-get source dart siconos
set -euo pipefail

library=$(realpath "$1")
sources=$(realpath "$2")
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
# Avoids spinning BLAS threads on a busy machine.
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1

# show <name> <pattern of the lines to compare> <program> [argument]
show()
{
    local pattern=$2 settings status
    echo "== $1"
    shift 2
    # Removes times, which differ in every run.
    steady()
    {
        grep -aE "$pattern" "$1" | sed -E 's/\([0-9]+ ms( total)?\)//'
    }
    for settings in CULLET_DISABLE=1 CULLET_NARROW=0 CULLET_NARROW=1; do
        status=passes
        env LD_PRELOAD="$library" CULLET_STATS=1 $settings "$@" >"$out/$settings" 2>"$out/summary" || status=FAILS
        printf '  %s: %s' "$settings" "$status"
        if cmp -s <(steady "$out/CULLET_DISABLE=1") <(steady "$out/$settings"); then
            echo ", $(steady "$out/$settings" | wc -l) lines as without cullet"
        else
            echo ", prints something else"
        fi
        grep -a '^cullet\[' "$out/summary" | sed 's/^cullet\[[0-9]*\]/    cullet[]/' || true
    done
}

# dart <folder and name of a test> [argument]: compares only the lines of passed tests; some print random positions.
dart()
{
    local tests name
    tests=$(echo "$sources"/dart-6*/unittests)
    name=$(basename "$1")
    # NDEBUG enables all of its cases. The flags of DART select C++11, which its headers no longer support.
    # shellcheck disable=SC2046
    g++ $(pkg-config --cflags dart bullet) -std=c++17 -include memory -w -DNDEBUG "-I$tests" "$tests/$1.cpp" -o "$out/$name" \
        -ldart -ldart-collision-bullet -ldart-collision-ode -ldart-utils -lgtest -lgtest_main -lfcl -lccd -lassimp \
        -loctomap -loctomath -lboost_filesystem -lLinearMath -lBulletCollision -lpthread
    show "DART's $name" '^\[' "$out/$name" "${@:2}"
}

siconos()
{
    local folder
    folder=$(echo "$sources"/siconos-4*/mechanics/src/collision/bullet/test)
    cat >"$out/main.cpp" <<'END'
#include <cppunit/extensions/TestFactoryRegistry.h>
#include <cppunit/ui/text/TestRunner.h>
int main()
{
    CppUnit::TextUi::TestRunner runner;
    runner.addTest(CppUnit::TestFactoryRegistry::getRegistry().makeTest());
    return runner.run() ? 0 : 1;
}
END
    # shellcheck disable=SC2046
    g++ -std=c++17 -w $(pkg-config --cflags bullet) $(find /usr/include/siconos -type d -printf '-I%p ') "-I$folder" \
        "$folder/ContactTest.cpp" "$out/main.cpp" -o "$out/siconos" \
        -lsiconos_mechanics -lsiconos_kernel -lsiconos_numerics -lcppunit -lBulletCollision -lLinearMath
    show "Siconos' ContactTest" '' "$out/siconos"
}

dart regression/test_Issue1184
dart comprehensive/test_Raycast
# The excluded test needs files of DART that are not in Debian's package.
dart comprehensive/test_Collision --gtest_filter=-Collision.CollisionOfPrescribedJoints
siconos
