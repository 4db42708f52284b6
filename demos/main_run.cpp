// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/commands.h"

// `cullet-run`: the program `cullet` with the subcommand `run` alone, which takes a fraction of the time to build.
int main(int argc, char** argv)
{
    return cullet::runCommandLine(argc, argv, {cullet::addRunCommand}, "  cullet-run run --scene domino\n");
}
