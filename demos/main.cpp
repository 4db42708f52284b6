// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/commands.h"

int main(int argc, char** argv)
{
    return cullet::runCommandLine(
        argc, argv,
        {cullet::addRunCommand, cullet::addBenchCommand, cullet::addFigureCommand, cullet::addRecordCommand,
         cullet::addReplayCommand, cullet::addVerifyCommand, cullet::addListCommand,
         cullet::addRenderCommand},
        "  cullet list\n"
        "  cullet run --scene domino\n");
}
