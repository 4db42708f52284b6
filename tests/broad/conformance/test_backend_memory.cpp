// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// After an update that fails for lack of memory, a restart clears all of its remains.

#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/process/failing_new.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kSeed = 41;

class BackendMemory : public BackendTest
{
protected:
    Aabb randomBox()
    {
        const float x = random.between(0, 4);
        const float y = random.between(0, 4);
        return boxAt(x, y, random.between(0, 4));
    }

    void addBoxes(BackendSession& session, int count)
    {
        for (int i = 0; i < count; ++i)
            session.add(randomBox());
    }

    void moveAll(BackendSession& session)
    {
        for (ProxyId row = 0; row < session.table.size(); ++row)
            session.table.setBox(
                row, row % 3 == 0 ? randomBox()
                                  : translated(session.table.box(row), random.between(-0.3f, 0.3f), 0, 0));
    }

    /// Updates the backend alone, with a failing allocation.
    ///
    /// @return whether that allocation was reached
    static bool updateWithFailure(BackendSession& session, std::uint64_t after)
    {
        PairDelta delta;
        const ProxyView view = session.table.beginUpdate(session.margin, true);
        bool hasFailed = false;
        {
            const OneNewFails failure(after);
            session.backend().update(view, delta);
            hasFailed = failure.hasHappened();
        }
        session.table.endUpdate();
        return hasFailed;
    }

    Random random{kSeed};
};

CULLET_ON_EVERY_BACKEND(BackendMemory);

TEST_P(BackendMemory, RestartsExactlyAfterFailedUpdateWhenNextTableIsSmaller)
{
    bool hasFailed = true;
    std::uint64_t failures = 0;
    for (std::uint64_t after = 0; hasFailed; after += 1 + after / 8)
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", allocation " + std::to_string(after));
        BackendSession session{GetParam().make()};
        session.margin = 0.1f;
        addBoxes(session, 30);
        ASSERT_TRUE(session.step());
        moveAll(session);
        addBoxes(session, 30);
        hasFailed = updateWithFailure(session, after);
        failures += hasFailed ? 1 : 0;

        session.table.clear();
        session.restart(session.pairs());
        addBoxes(session, 10);
        ASSERT_TRUE(session.step());
        moveAll(session);
        addBoxes(session, 40);
        ASSERT_TRUE(session.step());
        moveAll(session);
        ASSERT_TRUE(session.step());
    }
    EXPECT_GT(failures, 2u);
}
}  // namespace
}  // namespace cullet::test
