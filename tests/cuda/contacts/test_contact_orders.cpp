// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The same bits in any order of indices, and on several threads.

#include "cullet/tests/cuda/support/crowd_scene.h"
#include "cullet/tests/cuda/support/host_contacts.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet::test
{
namespace
{
class ContactOrders : public testing::TestWithParam<ConvexKind>
{
};

TEST_P(ContactOrders, GiveSameBitsInAnyOrder)
{
    const unsigned seed = 65;
    SCOPED_TRACE("seed " + std::to_string(seed));
    CrowdScene scene(GetParam(), 300, seed);
    HostContacts inOrder(scene.set, contactOptions(PsapExecutor::InOrder, 1));
    // With a list of neighbours, which few boxes have only if asked for.
    PsapOptions listing = contactOptions(PsapExecutor::Shuffled, 2, 1);
    listing.nearPairs = PsapNearPairs::Always;
    HostContacts shuffled(scene.set, listing);
    HostContacts threads(scene.set, contactOptions(PsapExecutor::Threads, 3));
    for (int frame = 0; frame < 10; ++frame)
    {
        const FoundContacts expected = inOrder.query(scene.poses, 0.01f, 1.0f);
        EXPECT_TRUE(haveSameBits(shuffled.query(scene.poses, 0.01f, 1.0f), expected));
        EXPECT_TRUE(haveSameBits(threads.query(scene.poses, 0.01f, 1.0f), expected));
        // In calm frames the list of neighbours is followed, until a box leaves its skin.
        scene.move(frame % 4 == 3 ? 0.1 : 0.0);
    }
    EXPECT_GT(shuffled.followed(), 1);
    EXPECT_GT(shuffled.repeats(), 1);
}

INSTANTIATE_TEST_SUITE_P(Host, ContactOrders, testing::ValuesIn(kConvexKinds), nameOfKind);
}  // namespace
}  // namespace cullet::test
