// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// How many pairs stay, enter and leave from one set of boxes to the next.
struct DeltaCounts
{
    std::uint64_t kept;
    std::uint64_t added;
    std::uint64_t removed;

    std::uint64_t pairs() const { return kept + added; }
};
}  // namespace cullet
