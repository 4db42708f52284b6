// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Number of times that an update waits for its executor, while a GPU is idle, and bytes transferred.

#include "cullet/broad/proxy_table.h"
#include "cullet/broad/psap/psap_backend.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace cullet::test
{
namespace
{
struct Counts
{
    int waits = 0;
    std::uint64_t bytesThere = 0, bytesBack = 0;  ///< to and from memory of the executor
};

/// HostExec that counts waits and the bytes that a GPU would transfer.
class TransferCountingExec : public psap::HostExec
{
public:
    TransferCountingExec(const PsapOptions& options, Counts& counts) : HostExec(options), m_counts(counts) {}

    void wait() { ++m_counts.waits; }
    template <class T>
    void upload(T* to, const T* from, std::uint64_t count)
    {
        m_counts.bytesThere += count * sizeof(T);
        HostExec::upload(to, from, count);
    }
    template <class T>
    void uploadParts(T* to, const T* from, std::uint64_t count, std::uint64_t part)
    {
        m_counts.bytesThere += count * sizeof(T);
        HostExec::uploadParts(to, from, count, part);
    }
    template <class T>
    const T* mapped(const T* memory, std::uint64_t count)
    {
        m_counts.bytesThere += count * sizeof(T);
        return memory;
    }
    template <class T>
    T* mappedForWriting(T* memory, std::uint64_t count = 1)
    {
        m_counts.bytesBack += count * sizeof(T);
        return memory;
    }
    template <class T>
    void download(T* to, const T* from, std::uint64_t count)
    {
        m_counts.bytesBack += count * sizeof(T);
        HostExec::download(to, from, count);
    }

private:
    Counts& m_counts;
};

/// Bodies in a row, each touching the next one.
class PsapSynchronisation : public ::testing::Test
{
protected:
    explicit PsapSynchronisation(std::uint64_t capacity = kCapacity)
        : m_options(optionsFor(capacity)), m_backend(m_options, "psap", m_options, m_counts)
    {
        for (std::uint32_t body = 0; body < 500; ++body)
            m_table.create(boxOf(body, 0), body + 1, kEverything);
    }

    void move(std::uint32_t body, float by) { m_table.setBox(body, boxOf(body, by)); }

    /// @return waits of an update
    int update(PairDelta& delta)
    {
        m_counts = {};
        EXPECT_EQ(m_backend.update(m_table.beginUpdate(0, true), delta), Status::Ok);
        m_table.endUpdate();
        return m_counts.waits;
    }
    /// Bytes to the executor in the last update.
    std::uint64_t bytesThere() const { return m_counts.bytesThere; }
    std::uint64_t bytesBack() const { return m_counts.bytesBack; }

    static constexpr std::uint32_t kCapacity = 64;

private:
    static Aabb boxOf(std::uint32_t body, float by)
    {
        const float low = static_cast<float>(body) + by;
        return cube(low, low + 1.25f);
    }

    static PsapOptions optionsFor(std::uint64_t capacity)
    {
        PsapOptions options;
        options.initialCapacity = capacity;
        return options;
    }

    Counts m_counts;
    PsapOptions m_options;
    psap::PsapBackend<TransferCountingExec> m_backend;
    ProxyTable m_table;
};

/// Fixture whose lists have room only for the expected changes.
class PsapTransfers : public PsapSynchronisation
{
protected:
    PsapTransfers() : PsapSynchronisation(1) {}
};

TEST_F(PsapSynchronisation, WaitsOnceForAsManyChangesAsLastUpdatesHad)
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

TEST_F(PsapSynchronisation, WaitsTwiceWhenManyChangesFollowFew)
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

TEST_F(PsapTransfers, WaitOnceForAsManyChangesAsBeforeWhenFewerCameBetween)
{
    PairDelta delta;
    update(delta);
    std::uint32_t frame = 0;
    for (const std::uint32_t moved : {150u, 150u, 150u, 150u, 105u, 105u, 150u, 105u, 105u, 150u})
    {
        // Every second body leaves while the others return.
        for (std::uint32_t k = 0; k < moved; ++k)
            move(3 * k, (k + frame) % 2 == 0 ? 10.0f * static_cast<float>(1000 + 3 * k) : 0.0f);
        const int waits = update(delta);
        const auto changed = static_cast<double>(delta.added.size() + delta.removed.size());
        if (frame >= 3)
        {
            EXPECT_EQ(waits, 1) << frame;
            EXPECT_NEAR(changed, 2.0 * moved, 2.0) << frame;
        }
        ++frame;
    }
}

TEST_F(PsapTransfers, MoveOnlyBytesOfChangesAndChangedRows)
{
    PairDelta delta;
    update(delta);
    for (const std::uint32_t moved : {10u, 60u, 150u})
    {
        for (int frame = 0; frame < 6; ++frame)
        {
            // Every second body leaves while the others return.
            for (std::uint32_t k = 0; k < moved; ++k)
                move(3 * k, (k + static_cast<std::uint32_t>(frame)) % 2 == 0
                                ? 10.0f * static_cast<float>(1000 + 3 * k)
                                : 0.0f);
            update(delta);
            if (frame < 3)
                continue;  // more than expected
            const std::uint64_t changed = delta.added.size() + delta.removed.size();
            EXPECT_NEAR(static_cast<double>(changed), 2.0 * moved, 2.0) << frame;
            // Eight bytes per pair, with room for a quarter more, a box and its row, and constant-size results.
            EXPECT_LE(bytesBack(), 10 * changed + 300) << moved;
            EXPECT_GE(bytesBack(), 8 * changed) << moved;
            EXPECT_LE(bytesThere(), (sizeof(Aabb) + 4 + 1) * moved + 300) << moved;
            EXPECT_GE(bytesThere(), (sizeof(Aabb) + 4) * moved) << moved;
        }
    }
}
}  // namespace
}  // namespace cullet::test
