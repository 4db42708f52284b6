// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

namespace cullet::test
{
/// Runs the target of the program on the corpus and on inputs that it makes, as the arguments of main() say.
///
/// @return exit status
int runFuzzDriver(int count, char** arguments);
}  // namespace cullet::test
