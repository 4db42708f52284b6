#!/usr/bin/env bash
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# demos/run builds one program in one precision, by its arguments.

# shellcheck source=cmake/bootstrap.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../cmake/bootstrap.sh"

# expect <program> <argument>...
expect()
{
    local wanted=$1 got
    shift
    got=$(program_of "$@")
    [ "$got" = "$wanted" ] || die "demos/run $*: builds $got instead of $wanted"
}

expect cullet-run
expect cullet-run run --bodies 5
expect cullet-run run --precision float
expect cullet-run run --precision=float --precision double
expect cullet-run-float64 run --precision double --precision float
expect cullet-run-float64 run --bodies 5 --precision=double
expect cullet bench broad --scene W1
expect cullet --help
expect cullet render --gltf double
expect cullet-float64 record --precision double --out run
say "demos/run chooses the program that its arguments need"
