// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "tests/plugin/convex_contacts.h"
#include "tests/plugin/faulty_cube.h"

#include <gtest/gtest.h>

#include <limits>

namespace cullet::test
{
TEST(IsaGjkFallback, AQueryThatMeetsANanIsCountedAndAnsweredByBullet)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    const btTransform turned(btQuaternion(vec(1, 2, 3).normalized(), btScalar(0.3)), vec(0.1, 0, 0.05));
    int failed = 0, delegated = 0;
    for (const double height : {3.0, 1.09, 0.5})
    {
        for (int badCall = -1; badCall < 8; ++badCall)
        {
            SCOPED_TRACE(testing::Message() << "height " << height << ", call " << badCall);
            ConvexBench bench;
            FaultyCube faulty(badCall,
                              [] { return btVector3(std::numeric_limits<btScalar>::quiet_NaN(), 0, 0); });
            ConvexPairProbe probe(bench.dispatcher, faulty, *cube);
            btTransform above = turned;
            above.setOrigin(turned.getOrigin() + vec(0, height, 0));
            probe.place(above, btTransform::getIdentity());
            EXPECT_EQ(probe.query().empty(), height > 2);
            const IsaGjkStats stats = bench.registration->stats();
            EXPECT_EQ(stats.separatedTotal + stats.notConvergedTotal + stats.delegatedTotal, 1u);
            // The first axis needs a support of the faulty shape whatever the pair is like.
            EXPECT_TRUE(badCall != 0 || stats.notConvergedTotal == 1);
            failed += int(stats.notConvergedTotal);
            delegated += int(stats.delegatedTotal);
        }
    }
    EXPECT_GE(failed, 5);
    EXPECT_GE(delegated, 5);
}
}  // namespace cullet::test
