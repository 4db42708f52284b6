// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/world_boxes.h"

#include <BulletDynamics/Dynamics/btSimpleDynamicsWorld.h>

#include <type_traits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// One of Bullet's worlds whose updateAabbs() uses all cores: `World<btDiscreteDynamicsWorld> world(...)` instead of
/// `btDiscreteDynamicsWorld world(...)`, with the same constructors.
///
/// Boxes, pairs, deactivated bodies, warnings and so the simulation are the same as with Base, bit for bit, with any
/// number of threads and any broad phase; WorldBoxes lists the shapes that are handled on the calling thread.
///
/// @tparam Base btCollisionWorld, btDiscreteDynamicsWorld, btSimpleDynamicsWorld, btMultiBodyDynamicsWorld, a soft or
///              deformable world, or a class of the application that inherits updateAabbs() from one of these
///
/// Threads: as for Base. During updateAabbs() no other thread may change bodies or shapes, which holds for Base too.
/// Callbacks of the broad phase may add and remove bodies during the call, but must not move existing ones.
template <class Base>
class World : public Base
{
public:
    using Base::Base;

    /// @param threads 0, the default: as many as the machine has
    void setUpdateThreads(int threads) { m_boxes.setThreads(threads); }

    void updateAabbs() override
    {
        if (!m_boxes.update(*this, kRule))
            Base::updateAabbs();
    }

    /// Statistics of the last updateAabbs() with at least 512 objects; with fewer, Base::updateAabbs() runs.
    const WorldBoxesStats& updateStats() const { return m_boxes.stats(); }

private:
    using Update = decltype(&Base::updateAabbs);
    static constexpr bool kIsSimple = std::is_same_v<Update, void (btSimpleDynamicsWorld::*)()>;
    static_assert(kIsSimple || std::is_same_v<Update, void (btCollisionWorld::*)()>,
                  "Base has an updateAabbs() of its own, which World would replace");
    static constexpr BoxRule kRule = kIsSimple ? BoxRule::Simple : BoxRule::Collision;

    WorldBoxes m_boxes;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
