// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/commands/argument_checks.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/recording/replay.h"

// The options that replay and verify share.
namespace cullet
{
/// Adds the file, --backend, --threads, --steps, --trace and --quiet.
inline void addReplayArguments(CLI::App& command, ReplayOptions& options)
{
    command.add_option("file", options.path, "recording made by 'cullet record' or RecordingBroadphase")
        ->required();
    command
        .add_option("--backend", options.backends,
                    "one or several ('cullet list'); exact: sort and sweep anew")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str();
    command.add_option("--threads", options.threads, "of the CPU backends; 0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0, 4096));
    command.add_option("--steps", options.frames, "frames to play; 0: all")
        ->capture_default_str()
        ->check(notNegative());
    command.add_option("--trace", options.trace, "write every frame to this file, for Perfetto");
    command.add_flag("--quiet", options.quiet, "no progress bar");
}

inline Json toJson(const char* command, const ReplayOptions& options)
{
    return {{"command", command},         {"file", options.path},    {"backend", options.backends},
            {"threads", options.threads}, {"steps", options.frames}, {"precision", ownPrecision()}};
}
}  // namespace cullet
