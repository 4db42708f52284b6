// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"

#include <cstdint>
#include <functional>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The backend that the options ask a new world to begin with; the grid where there is no CUDA device, which is worth a
/// warning only if CUDA was asked for.
std::unique_ptr<Backend> makeBackend(const BroadphaseOptions& options);

/// The fastest backend for a world of so many bodies: CUDA from options.deviceBodies on, where a device answers; else the
/// grid.
std::unique_ptr<Backend> makeBestBackend(const BroadphaseOptions& options, std::uint32_t bodies);

/// The backend that takes over when another one fails: the grid.
std::unique_ptr<Backend> makeFallbackBackend(const BroadphaseOptions& options);

/// Moves a world to a device when it has grown, and back when it has shrunk to half of that.
///
/// A switch costs a restart, so that a world has to keep its size for some updates first. A backend that the chooser
/// did not make itself, because another one failed or the application set it, stays.
class BackendChooser
{
public:
    using Make = std::function<std::unique_ptr<Backend>()>;

    /// Chooses nothing, ever.
    BackendChooser() = default;

    /// @param begin        the backend in use, one for small worlds
    /// @param deviceBodies bodies from which on `makeLarge` is asked for a backend; it may return null, once
    BackendChooser(const Backend& begin, std::uint32_t deviceBodies, Make makeSmall, Make makeLarge);

    /// To be called before every update.
    ///
    /// @return the backend that is to take over from `now`; null: `now` stays
    std::unique_ptr<Backend> choose(const Backend& now, std::uint32_t bodies);

    static constexpr int kUpdatesOfPatience = 8;

private:
    const Backend* m_known = nullptr;  ///< null: nothing is chosen any more
    std::uint32_t m_deviceBodies = 0;
    Make m_makeSmall, m_makeLarge;
    bool m_isLarge = false;
    int m_misfits = 0;  ///< updates in a row for which the other backend is the better one
};

/// The chooser that the options ask for, for a world that begins with makeBackend(options).
BackendChooser makeBackendChooser(const BroadphaseOptions& options, const Backend& begin);
}  // namespace CULLET_PRECISION
}  // namespace cullet
