// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/backend.h"

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
    std::unique_ptr<Backend> (*make)(int threads);
};

/// Every backend, the default one first.
const std::vector<NamedBackend>& namedBackends();

/// The backend of that name, or null.
const NamedBackend* findBackend(const std::string& name);

/// What "ablation" stands for: all CPU backends but brute force.
std::vector<std::string> ablationNames();
}  // namespace cullet
