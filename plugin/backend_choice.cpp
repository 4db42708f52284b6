// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/backend_choice.h"

#include "broad/log.h"

#include <string>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::unique_ptr<Backend> makeCudaOrFallback(const BroadphaseOptions& options)
{
    std::string why;
    if (std::unique_ptr<Backend> cuda = makeCudaPsapBackend(options.psap, &why))
        return cuda;
    const std::string message = "no CUDA backend (" + why + "); the grid on the CPU is used";
    log(options.backend == BackendChoice::Cuda ? LogLevel::Warning : LogLevel::Info, message.c_str());
    return makeFallbackBackend(options);
}
}  // namespace

std::unique_ptr<Backend> makeFallbackBackend(const BroadphaseOptions& options)
{
    GridOptions grid = options.grid;
    if (options.threads != 0)
        grid.threads = options.threads;
    return makeGridBackend(grid);
}

std::unique_ptr<Backend> makeBackend(const BroadphaseOptions& options)
{
    switch (options.backend)
    {
        case BackendChoice::Grid:
            return makeFallbackBackend(options);
        case BackendChoice::Brute:
            return makeBruteForceBackend();
        case BackendChoice::Auto:
        case BackendChoice::Cuda:
            break;
    }
    return makeCudaOrFallback(options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
