// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <LinearMath/btScalar.h>

class btBroadphaseInterface;
class btDispatcher;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The public fields and calls by which applications tune btDbvtBroadphase, so that they compile with Broadphase in its place.
///
/// They have no effect: there are no trees to balance and no velocity to guess, pairs come in calculateOverlappingPairs() as
/// with m_deferedcollide, and none waits for removal. Fields keep what is written to them; their first values are Bullet's.
///
/// The trees themselves (m_sets, m_stageRoots, m_rayTestStacks) are not here, since a walk over empty ones would find nothing
/// without a word: aabbTest() and rayTest() answer such questions. Neither is m_releasepaircache: a pair cache that was handed
/// in stays the application's.
struct DbvtTuning
{
    enum
    {
        DYNAMIC_SET = 0,
        FIXED_SET = 1,
        STAGECOUNT = 2
    };

    btScalar m_prediction = 0;
    int m_stageCurrent = 0;
    int m_fupdates = 1;
    int m_dupdates = 0;
    int m_cupdates = 10;
    int m_newpairs = 1;
    int m_fixedleft = 0;
    unsigned m_updates_call = 0;
    unsigned m_updates_done = 0;
    btScalar m_updates_ratio = 0;
    int m_pid = 0;
    int m_cid = 0;
    int m_gid = 0;
    bool m_deferedcollide = false;
    bool m_needcleanup = true;

    void optimize() {}
    void performDeferredRemoval(btDispatcher* /*dispatcher*/) {}
    void setVelocityPrediction(btScalar prediction) { m_prediction = prediction; }
    btScalar getVelocityPrediction() const { return m_prediction; }
    static void benchmark(btBroadphaseInterface* /*broadphase*/) {}
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
