// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Calls and assignments of applications that were written for btDbvtBroadphase.
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
/// Uses every public setting and counter, and every function outside of btBroadphaseInterface.
template <class AnyBroadphase>
void useAll(AnyBroadphase& broadphase)
{
    broadphase.setVelocityPrediction(btScalar(0.25));
    EXPECT_EQ(broadphase.getVelocityPrediction(), btScalar(0.25));
    EXPECT_EQ(broadphase.m_prediction, btScalar(0.25));
    broadphase.m_prediction = 0;
    broadphase.m_deferedcollide = true;
    broadphase.m_needcleanup = true;
    broadphase.m_fupdates = 2;
    broadphase.m_dupdates = 1;
    broadphase.m_cupdates = 100;
    broadphase.m_newpairs = 1;
    broadphase.m_fixedleft = 0;
    broadphase.m_stageCurrent = 0;
    broadphase.m_updates_call = broadphase.m_updates_done = 0;
    broadphase.m_updates_ratio = 0;
    broadphase.m_pid = broadphase.m_cid = 0;
    EXPECT_GE(broadphase.m_gid, 0);
    EXPECT_EQ(AnyBroadphase::STAGECOUNT, AnyBroadphase::DYNAMIC_SET + 2 * AnyBroadphase::FIXED_SET);
    EXPECT_EQ(broadphase.m_paircache, broadphase.getOverlappingPairCache());
    broadphase.optimize();
    broadphase.performDeferredRemoval(nullptr);
    AnyBroadphase::benchmark(&broadphase);
}

/// The pairs of a scene with such calls in between.
template <class AnyBroadphase>
void expectPairsAmongAllCalls()
{
    AnyBroadphase broadphase;
    useAll(broadphase);
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(5, 0, 0));
    broadphase.collide(nullptr);
    EXPECT_TRUE(pairsOf(broadphase).empty());
    useAll(broadphase);
    broadphase.setAabbForceUpdate(b, vec(0.25, 0, 0), vec(0.5, 1, 1), nullptr);
    broadphase.collide(nullptr);
    EXPECT_TRUE(hasPair(broadphase, a, b));
    btVector3 min, max;
    broadphase.getAabb(b, min, max);
    EXPECT_EQ(min, vec(0.25, 0, 0));
    EXPECT_EQ(max, vec(0.5, 1, 1));
    EXPECT_EQ(rayHits(broadphase, vec(0.375, -9, 0.75), vec(0.375, 9, 0.75)), Ids{idOf(b)})
        << "the box shrank";
    broadphase.destroyProxy(a, nullptr);
    broadphase.destroyProxy(b, nullptr);
    useAll(broadphase);
    EXPECT_TRUE(updatedPairs(broadphase).empty());
}

TEST(BroadphaseDbvtCalls, CompileAndLeavePairsUnchanged)
{
    expectPairsAmongAllCalls<btDbvtBroadphase>();
    expectPairsAmongAllCalls<Broadphase>();
}

TEST(BroadphaseDbvtCalls, StartWithFieldValuesOfDbvt)
{
    const btDbvtBroadphase stock;
    const Broadphase own;
    EXPECT_EQ(own.m_prediction, stock.m_prediction);
    EXPECT_EQ(own.m_stageCurrent, stock.m_stageCurrent);
    EXPECT_EQ(own.m_fupdates, stock.m_fupdates);
    EXPECT_EQ(own.m_dupdates, stock.m_dupdates);
    EXPECT_EQ(own.m_cupdates, stock.m_cupdates);
    EXPECT_EQ(own.m_newpairs, stock.m_newpairs);
    EXPECT_EQ(own.m_fixedleft, stock.m_fixedleft);
    EXPECT_EQ(own.m_updates_call, stock.m_updates_call);
    EXPECT_EQ(own.m_updates_done, stock.m_updates_done);
    EXPECT_EQ(own.m_updates_ratio, stock.m_updates_ratio);
    EXPECT_EQ(own.m_pid, stock.m_pid);
    EXPECT_EQ(own.m_cid, stock.m_cid);
    EXPECT_EQ(own.m_gid, stock.m_gid);
    EXPECT_EQ(own.m_deferedcollide, stock.m_deferedcollide);
    EXPECT_EQ(own.m_needcleanup, stock.m_needcleanup);
}
}  // namespace
}  // namespace cullet::test
