// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/cullet.h"

namespace cullet::abi
{
/// Checks a batch and computes its pairs, see cullet_hull_query_batch(). Throws Failure, and std::bad_alloc.
///
/// @return whether every pair has an answer
bool runHullBatch(const cullet_hull_batch& batch, const cullet_hull_results& results);
}  // namespace cullet::abi
