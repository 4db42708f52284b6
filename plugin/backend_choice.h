// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "plugin/broadphase.h"

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The backend that the options ask for; the grid where there is no CUDA device, which is worth a warning only if CUDA
/// was asked for.
std::unique_ptr<Backend> makeBackend(const BroadphaseOptions& options);

/// The backend that takes over when another one fails: the grid.
std::unique_ptr<Backend> makeFallbackBackend(const BroadphaseOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
