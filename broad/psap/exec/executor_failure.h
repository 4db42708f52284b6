// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

namespace cullet::psap
{
/// Thrown inside an update when the executor's device fails; update() converts it to its Status.
struct ExecutorFailure
{
    Status status;
    const char* call;    ///< the call that failed, static text
    const char* reason;  ///< in words, static text
};
}  // namespace cullet::psap
