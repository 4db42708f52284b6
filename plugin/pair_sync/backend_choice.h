// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/plugin/core/broadphase_options.h"

#include <cstdint>
#include <functional>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The backend with which a new world starts, by its options. Without a CUDA device it is the grid, with a warning only
/// if the options require CUDA.
std::unique_ptr<Backend> makeBackend(const BroadphaseOptions& options);

/// The fastest backend for a number of bodies: CUDA from options.deviceBodies on, if a device is available; otherwise
/// the grid.
std::unique_ptr<Backend> makeBestBackend(const BroadphaseOptions& options, std::uint32_t bodies);

/// The backend that replaces one that has failed: the grid.
std::unique_ptr<Backend> makeFallbackBackend(const BroadphaseOptions& options);

/// Moves a world to a device when it has grown, and back when it has shrunk to half of that.
///
/// A switch costs a restart, so a world must keep its size for some updates first. A backend that the chooser did not
/// create, because the previous one failed or the application set it, is kept.
class BackendChooser
{
public:
    using Make = std::function<std::unique_ptr<Backend>()>;

    /// A chooser that never replaces the backend.
    BackendChooser() = default;

    /// @param begin        the current backend, one for small worlds
    /// @param deviceBodies number of bodies from which on `makeLarge` creates the backend; it is not called again once
    ///                     it has returned null
    BackendChooser(const Backend& begin, std::uint32_t deviceBodies, Make makeSmall, Make makeLarge);

    /// Call before every update.
    ///
    /// @return the backend that replaces `now`; null: keep `now`
    std::unique_ptr<Backend> choose(const Backend& now, std::uint32_t bodies);

    static constexpr int kSwitchDelay = 8;

private:
    const Backend* m_ownBackend = nullptr;  ///< the chooser's own backend; null: the chooser is inactive
    std::uint32_t m_deviceBodies = 0;
    Make m_makeSmall, m_makeLarge;
    bool m_isLarge = false;
    int m_mismatches = 0;  ///< consecutive updates for which the other backend would be better
};

/// The chooser for a world that starts with makeBackend(options).
BackendChooser makeBackendChooser(const BroadphaseOptions& options, const Backend& begin);
}  // namespace CULLET_PRECISION
}  // namespace cullet
