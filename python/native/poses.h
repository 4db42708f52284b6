// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/cullet.h"
#include "cullet/python/native/arrays.h"

#include <vector>

namespace cullet::python
{
/// Poses of an array: position and quaternion (n x 7, or 7), or matrices (n x 4 x 4, or 4 x 4). Throws nb::value_error.
///
/// @param name of the argument, for messages
std::vector<cullet_pose> readPoses(const AnyArray& array, const char* name);
}  // namespace cullet::python
