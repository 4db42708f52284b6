// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/queries/query_index.h"
#include "cullet/broad/row_source.h"

namespace cullet
{
/// Prepares a ray; false for one with a number that is none, an infinite length, or coordinates beyond 1e15.
bool makeRayPath(const RaySegment& segment, RayPath& path) noexcept;
}  // namespace cullet
