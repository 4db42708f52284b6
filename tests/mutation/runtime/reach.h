// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

/// Which mutants a test reaches.
namespace cullet_mutants
{
/// Mutants of one build; their ids are from 1 on.
constexpr int kCapacity = 1 << 14;

/// Begins to record anew. Does nothing unless CULLET_MUTANT is "reach".
void forgetReached();

/// Appends a line with what was reached since forgetReached().
void writeReached(const char* name, long milliseconds);
}  // namespace cullet_mutants
