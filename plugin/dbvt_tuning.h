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
/// The public fields and functions by which applications tune btDbvtBroadphase, so that they compile with Broadphase.
///
/// They have no effect: there are no trees to balance, no velocity prediction and no deferred removal, and pairs are
/// found in calculateOverlappingPairs(), as with m_deferedcollide. Fields store what is written to them; their initial
/// values are Bullet's.
///
/// The trees themselves (m_sets, m_stageRoots, m_rayTestStacks) are missing on purpose: a traversal of empty trees
/// would silently find nothing. Use aabbTest() and rayTest() instead. m_releasepaircache is missing too: a pair cache
/// of the application always stays the application's.
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
