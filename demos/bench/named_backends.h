// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

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

/// Every backend without a number, the default one first.
const std::vector<NamedBackend>& namedBackends();

/// A backend whose name ends in a number of the user's: "psap-cells:900".
struct NumberedBackend
{
    const char* name;  ///< ends in ":N"
    const char* summary;
    std::unique_ptr<Backend> (*make)(int threads, double number);
};

const std::vector<NumberedBackend>& numberedBackends();

/// The name as the lists have it: "psap-cells:900" becomes "psap-cells:N".
std::string listedName(const std::string& name);

/// @param threads as in NamedBackend::make
/// @return null when it cannot run here, or there is no such backend
/// @throws std::invalid_argument for a number that is none or not positive; std::runtime_error as in NamedBackend::make
std::unique_ptr<Backend> makeBackend(const std::string& name, int threads);

/// What "ablation" stands for: all CPU backends but brute force.
std::vector<std::string> ablationNames();

/// What "choices" stands for: the grid, and the grid with one of the choices of its cost model fixed.
std::vector<std::string> choiceNames();
}  // namespace cullet
