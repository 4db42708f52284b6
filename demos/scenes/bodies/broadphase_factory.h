// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/exact_pairs.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class Broadphase;

/// A broad phase with its name and its margin.
struct NamedBroadphase
{
    std::string name;
    std::unique_ptr<btBroadphaseInterface> broadphase;
    const Broadphase* cullet = nullptr;  ///< the broadphase if it is cullet's, else null
    btScalar margin = 0;                 ///< see MarginScope
    int threads = 1;                     ///< maximum number that it uses
};

struct BroadphaseInfo
{
    const char* name;
    const char* summary;
};

/// The names that makeNamedBroadphase() accepts.
const std::vector<BroadphaseInfo>& broadphaseNames();

struct BroadphaseRequest
{
    std::string name;
    int threads = 0;  ///< 0: as many as the machine has; for the CPU backends
    ExactBox worldBounds = {{-1e4, -1e4, -1e4}, {1e4, 1e4, 1e4}};  ///< axissweep clamps boxes to it
    std::uint32_t mostProxies = 1u << 20;                          ///< for axissweep, which cannot grow
};

/// Makes a broad phase by name.
///
/// @throws std::invalid_argument for an unknown name, listing the known ones; std::runtime_error if there is no CUDA
///         device for "cuda"
NamedBroadphase makeNamedBroadphase(const BroadphaseRequest& request);

/// Sets Bullet's global gDbvtMargin for its own lifetime, which is the only way to give one of several DBVTs a
/// different margin.
class MarginScope
{
public:
    explicit MarginScope(btScalar margin) : m_saved(gDbvtMargin) { gDbvtMargin = margin; }
    ~MarginScope() { gDbvtMargin = m_saved; }
    MarginScope(const MarginScope&) = delete;
    MarginScope& operator=(const MarginScope&) = delete;

private:
    btScalar m_saved;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
