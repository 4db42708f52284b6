// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

namespace cullet
{
/// Turns the first Ctrl-C (SIGINT) or SIGTERM into a request to stop; another one, more than 0.2 s later, ends the
/// program as usual.
void catchInterrupts();

/// True once the user asked to stop. Long loops test this between steps and finish with the results so far.
bool isInterrupted() noexcept;
}  // namespace cullet
