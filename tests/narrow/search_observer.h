// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>

#include <functional>

namespace cullet::test
{
/// The observer of all tests that watch a search (NoObserver says when it is called): one type, since every type of an
/// observer is an instance of the whole search for the compiler.
using SearchObserver = std::function<void(const Eigen::Vector3d&, double)>;
}  // namespace cullet::test
