// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// How often an update waits for its executor: a GPU stands idle then.

#include "broad/host_exec.h"
#include "broad/proxy_table.h"
#include "broad/psap_backend.h"
#include "tests/support/boxes.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace cullet::test
{
namespace
{
/// HostExec that counts how often it is waited for.
class CountingExec : public psap::HostExec
{
public:
    CountingExec(const PsapOptions& options, int& waits) : HostExec(options), m_waits(waits) {}

    void wait() { ++m_waits; }

private:
    int& m_waits;
};

/// Bodies in a row, each touching the next one.
class PsapWaits : public ::testing::Test
{
protected:
    PsapWaits()
    {
        for (std::uint32_t body = 0; body < 500; ++body)
            m_table.create(boxOf(body, 0), body + 1, kEverything);
    }

    void move(std::uint32_t body, float by) { m_table.setBox(body, boxOf(body, by)); }

    /// @return waits of an update
    int update(PairDelta& delta)
    {
        m_waits = 0;
        EXPECT_EQ(m_backend.update(m_table.beginUpdate(0, true), delta), Status::Ok);
        m_table.endUpdate();
        return m_waits;
    }

    static constexpr std::uint32_t kCapacity = 64;

private:
    static Aabb boxOf(std::uint32_t body, float by)
    {
        const float low = static_cast<float>(body) + by;
        return cube(low, low + 1.25f);
    }

    static PsapOptions options()
    {
        PsapOptions options;
        options.initialCapacity = kCapacity;
        return options;
    }

    int m_waits = 0;
    psap::PsapBackend<CountingExec> m_backend{options(), "psap", options(), m_waits};
    ProxyTable m_table;
};

TEST_F(PsapWaits, OnceForAsManyChangesAsTheLastUpdatesHad)
{
    PairDelta delta;
    EXPECT_GT(update(delta), 1) << "all pairs are new, and the lists too short for them";
    ASSERT_EQ(delta.added.size(), 499u);
    for (int frame = 0; frame < 4; ++frame)
    {
        for (std::uint32_t body = 100; body < 120; ++body)
            move(body, frame % 2 == 0 ? 4.0f * static_cast<float>(500 + body) : 0.0f);
        EXPECT_EQ(update(delta), 1) << frame;
        EXPECT_EQ(delta.added.size() + delta.removed.size(), 21u) << frame;
    }
}

TEST_F(PsapWaits, OnceMoreForManyChangesAfterFew)
{
    PairDelta delta;
    update(delta);
    for (std::uint32_t body = 0; body < 500; body += 2)
        move(body, -0.1f);
    EXPECT_EQ(update(delta), 1);
    EXPECT_TRUE(delta.added.empty() && delta.removed.empty());
    for (std::uint32_t body = 0; body < 500; body += 2)
        move(body, 4.0f * static_cast<float>(500 + body));
    EXPECT_EQ(update(delta), 2);
    EXPECT_EQ(delta.removed.size(), 499u);
}
}  // namespace
}  // namespace cullet::test
