// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/backend.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
/// A backend with options, as `bench broad` knows it.
struct NamedBackend
{
    const char* name;
    const char* summary;
    /// @param threads 0: as many as the machine has; null or std::runtime_error when it cannot run here
    std::function<std::unique_ptr<Backend>(int threads)> make;
};

/// Every backend, the default one first.
const std::vector<NamedBackend>& namedBackends();

/// The backend of that name, or null.
const NamedBackend* findBackend(const std::string& name);

/// What "ablation" stands for: all CPU backends but brute force.
std::vector<std::string> ablationNames();

/// What "choices" stands for: the grid, and the grid with one of the choices of its cost model fixed.
std::vector<std::string> choiceNames();
}  // namespace cullet
