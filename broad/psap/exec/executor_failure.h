// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

namespace cullet::psap
{
/// Thrown inside an update when the executor's machine fails; update() turns it into its Status.
struct ExecutorFailure
{
    Status status;
    const char* call;    ///< what failed, static text
    const char* reason;  ///< in words, static text
};
}  // namespace cullet::psap
