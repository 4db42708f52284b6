// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/comparison/backends.h"
#include "cullet/cuda/device_pairs.h"

#include <memory>
#include <string>

namespace cullet
{
/// The thesis's search for boxes in device memory, or null with the reason in `*why`, as makeDevicePairFinder(). enqueue()
/// waits for the number of entries.
std::unique_ptr<DevicePairFinder> makeThesisPairFinder(const ThesisOptions& options, CUstream_st* stream,
                                                       std::string* why);
}  // namespace cullet
