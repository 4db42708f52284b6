// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/huge_vector.h"

#include <cstdint>

namespace cullet
{
/// Keys of pairs (pairKey(), rowKey()). Bodies at one spot have millions, whose lists live for one update: in pages of 4 KiB the
/// system would take as long to hand these out as the update takes to write them.
using PairKeys = HugeVector<std::uint64_t>;
}  // namespace cullet
