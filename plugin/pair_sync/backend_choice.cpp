// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/backend_choice.h"

#include "cullet/broad/log.h"

#include <string>
#include <utility>

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
            return makeBestBackend(options, 0);
        case BackendChoice::Cuda:
            break;
    }
    return makeCudaOrFallback(options);
}

std::unique_ptr<Backend> makeBestBackend(const BroadphaseOptions& options, std::uint32_t bodies)
{
    return bodies < options.deviceBodies ? makeFallbackBackend(options) : makeCudaOrFallback(options);
}

BackendChooser::BackendChooser(const Backend& begin, std::uint32_t deviceBodies, Make makeSmall,
                               Make makeLarge)
    : m_ownBackend(&begin),
      m_deviceBodies(deviceBodies),
      m_makeSmall(std::move(makeSmall)),
      m_makeLarge(std::move(makeLarge))
{
}

std::unique_ptr<Backend> BackendChooser::choose(const Backend& now, std::uint32_t bodies)
{
    if (m_ownBackend == nullptr)
        return nullptr;
    if (&now != m_ownBackend)
        m_ownBackend = nullptr;
    const bool isLarge = bodies >= (m_isLarge ? m_deviceBodies / 2 : m_deviceBodies);
    m_mismatches = isLarge == m_isLarge ? 0 : m_mismatches + 1;
    if (m_ownBackend == nullptr || m_mismatches < kSwitchDelay)
        return nullptr;
    std::unique_ptr<Backend> next = isLarge ? m_makeLarge() : m_makeSmall();
    m_ownBackend = next.get();
    m_isLarge = isLarge;
    m_mismatches = 0;
    return next;
}

BackendChooser makeBackendChooser(const BroadphaseOptions& options, const Backend& begin)
{
    if (options.backend != BackendChoice::Auto || options.deviceBodies == 0)
        return {};
    const auto makeSmall = [options] { return makeFallbackBackend(options); };
    const auto makeLarge = [options]
    {
        std::string why;
        std::unique_ptr<Backend> cuda = makeCudaPsapBackend(options.psap, &why);
        if (cuda == nullptr)
            log(LogLevel::Info, ("no CUDA backend (" + why + "); the grid on the CPU stays").c_str());
        return cuda;
    };
    return {begin, options.deviceBodies, makeSmall, makeLarge};
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
