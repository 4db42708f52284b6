// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

namespace cullet
{
/// Makes the first Ctrl-C (SIGINT) or SIGTERM a request; another one, more than 0.2 s later, ends the program as usual.
void catchInterrupts();

/// True once the user asked to stop. Long loops ask between steps and finish with what they have.
bool isInterrupted() noexcept;
}  // namespace cullet
