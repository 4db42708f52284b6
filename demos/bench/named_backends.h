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
/// A backend with options, by its name in `bench broad`.
struct NamedBackend
{
    const char* name;
    const char* summary;
    /// @param threads 0: as many as the machine has; returns null or throws std::runtime_error if the backend cannot
    ///                run here
    std::function<std::unique_ptr<Backend>(int threads)> make;
};

/// Every backend without a number, the default one first.
const std::vector<NamedBackend>& namedBackends();

/// A backend whose name ends in a number chosen by the user: "psap-cells:900".
struct NumberedBackend
{
    const char* name;  ///< ends in ":N"
    const char* summary;
    std::unique_ptr<Backend> (*make)(int threads, double number);
};

const std::vector<NumberedBackend>& numberedBackends();

/// The name in the lists: "psap-cells:900" becomes "psap-cells:N".
std::string listedName(const std::string& name);

/// @param threads as in NamedBackend::make
/// @return null if the backend cannot run here or does not exist
/// @throws std::invalid_argument for an invalid or non-positive number; std::runtime_error as NamedBackend::make
std::unique_ptr<Backend> makeBackend(const std::string& name, int threads);

/// Expansion of "ablation": all CPU backends but brute force.
std::vector<std::string> ablationNames();

/// Expansion of "choices": the grid, and the grid with one of the choices of its cost model fixed.
std::vector<std::string> choiceNames();
}  // namespace cullet
