// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// After an update that fails for lack of memory, a restart clears all of its remains. The memory that a backend reports
// is what it holds.

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
        ASSERT_TRUE(session.step());  // from now on the margin keeps some pairs
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

/// Updates a backend in which boxes drift, and then most of them rest.
void updateOften(Backend& backend, ProxyTable& table, Random& random)
{
    for (std::uint32_t id = 1; id <= 3000; ++id)
        table.create(boxAt(random.point(0, 24)), id, {1, -1});
    PairDelta delta;
    for (int update = 0; update < 16; ++update)
    {
        ASSERT_EQ(backend.update(table.beginUpdate(0.0625f, true), delta), Status::Ok);
        table.endUpdate();
        for (ProxyId row = 0; row < table.size(); row += update < 4 ? 1 : 8)
            table.setBox(row, translated(table.box(row), random.point(-0.05f, 0.05f)));
    }
}

TEST_P(BackendMemory, ReportsTheBytesThatItHolds)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    std::unique_ptr<Backend> backend = GetParam().make();
    ProxyTable table;
    updateOften(*backend, table, random);
    const auto reported = static_cast<double>(backend->stats().bytes);
    const std::int64_t before = liveNewBytes();
    backend.reset();
    const auto held = static_cast<double>(before - liveNewBytes());
    if (held == 0)
        GTEST_SKIP() << "the C library does not tell";
    EXPECT_GT(reported, 3000.0 * sizeof(Aabb));
    EXPECT_GT(reported, 0.97 * held) << held;
    EXPECT_LT(reported, 1.02 * held) << held;
}
}  // namespace
}  // namespace cullet::test
