// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Without memory for neighbour lists, updates search as without lists, and do not fail.

#include "cullet/broad/psap/delta_search.h"
#include "cullet/broad/psap/psap_backend.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/delta_oracle.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Has no memory, but remembers what was requested.
struct NoMemory
{
    static constexpr std::size_t kAlignment = 128;
    static inline std::uint64_t requested = 0;
    [[noreturn]] static void* allocateBytes(std::uint64_t bytes)
    {
        requested = bytes;
        throw std::bad_alloc();
    }
    static void deallocate(void* /*memory*/) noexcept {}
};

TEST(ExecutorBuffer, RequestsNoFewerBytesThanItsElementsTake)
{
    psap::ExecutorBuffer<std::uint64_t, NoMemory> buffer;
    EXPECT_THROW(buffer.allocate(1000), std::bad_alloc);
    EXPECT_EQ(NoMemory::requested, 8000u);
    // 8 times as many wrap to 8 bytes.
    EXPECT_THROW(buffer.allocate((std::uint64_t{1} << 61) + 1), std::bad_alloc);
    EXPECT_GT(NoMemory::requested, std::uint64_t{1} << 62);
    EXPECT_EQ(buffer.size(), 0u);
    EXPECT_EQ(buffer.data(), nullptr);
}

/// HostExec whose allocations fail for long lists of held flags.
class TightExec : public psap::HostExec
{
public:
    using HostExec::HostExec;
    using HostExec::reserve;

    void reserve(psap::HostBuffer<std::uint8_t>& buffer, std::uint64_t count)
    {
        if (count > mostFlags)
        {
            ++failures;
            throw std::bad_alloc();
        }
        HostExec::reserve(buffer, count);
    }

    static inline std::uint64_t mostFlags = 0;
    static inline int failures = 0;
};

PsapOptions keepingNear(std::uint32_t capacity)
{
    PsapOptions options;
    options.nearPairs = PsapNearPairs::Always;
    options.initialCapacity = capacity;
    return options;
}

// The allocation fails for a new list, or for a list that turns out longer.
constexpr std::uint32_t kCapacities[] = {8192, 1};
constexpr std::uint32_t kBoxes = 600;

TEST(PsapNeighbourListMemory, FallsBackToSearchWhenFirstNeighbourListAllocationFails)
{
    for (const std::uint32_t capacity : kCapacities)
    {
        SCOPED_TRACE(capacity);
        TightExec::mostFlags = kBoxes;
        TightExec::failures = 0;
        const PsapOptions options = keepingNear(capacity);
        BackendSession session(std::make_unique<psap::PsapBackend<TightExec>>(options, "tight", options));
        BoxScene scene(SceneKind::Uniform, kBoxes, 31);
        for (const Aabb& box : scene.boxes())
            session.add(box);
        for (int step = 0; step < 12; ++step)
        {
            ASSERT_TRUE(session.step());
            scene.step();
            for (ProxyId row = 0; row < kBoxes; ++row)
                session.table.setBox(row, scene.boxes()[row]);
        }
        EXPECT_GT(session.addedTotal(), 500u);
        EXPECT_GT(session.removedTotal(), 100u);
        EXPECT_EQ(TightExec::failures, 1);
        EXPECT_STREQ(session.backend().stats().path, "rebuild");
    }
}

// The current list is then lost, while the result of the update that begins the next list was not collected.
TEST(PsapNeighbourListMemory, FallsBackToSearchWhenLaterNeighbourListAllocationFails)
{
    TightExec::mostFlags = 1u << 30;
    TightExec::failures = 0;
    const PsapOptions options = keepingNear(1);
    BackendSession session(std::make_unique<psap::PsapBackend<TightExec>>(options, "tight", options));
    BoxScene scene(SceneKind::Uniform, kBoxes, 33);
    for (const Aabb& box : scene.boxes())
        session.add(box);
    // Boxes move together, so that the next list is longer, and separate again.
    int followed = 0;
    for (int step = 0; step < 60; ++step)
    {
        SCOPED_TRACE(step);
        ASSERT_TRUE(session.step());
        if (session.backend().stats().path == std::string("near pairs") && ++followed == 3)
            TightExec::mostFlags = kBoxes;
        const float scale =
            step < 30 ? -0.004f * static_cast<float>(step) : 0.1f * static_cast<float>(step - 30);
        for (ProxyId row = 0; row < kBoxes; ++row)
        {
            Aabb box = scene.boxes()[row];
            for (int axis = 0; axis < 3; ++axis)
            {
                const float way = scale * (box.min[axis] + box.max[axis]) / 2;
                box.min[axis] += way;
                box.max[axis] += way;
            }
            session.table.setBox(row, box);
        }
    }
    EXPECT_GE(followed, 3);
    EXPECT_EQ(TightExec::failures, 1);
    EXPECT_GT(session.addedTotal(), 500u);
    EXPECT_GT(session.removedTotal(), 500u);
    EXPECT_STREQ(session.backend().stats().path, "rebuild");
}

TEST(PsapNeighbourListMemory, FallsBackToSearchInDeltaSearchWhenListAllocationFails)
{
    for (const std::uint32_t capacity : kCapacities)
    {
        SCOPED_TRACE(capacity);
        TightExec::mostFlags = kBoxes;
        TightExec::failures = 0;
        const PsapOptions options = keepingNear(capacity);
        TightExec exec(options);
        psap::DeltaSearch<TightExec> search(options);
        BoxScene scene(SceneKind::Uniform, kBoxes, 32);
        DeltaOracle oracle;
        std::vector<Aabb> boxes;
        for (int step = 0; step < 12; ++step)
        {
            boxes = scene.boxes();
            search.prepare(exec, boxes.data(), boxes.size());
            search.launch(exec);
            search.advanceNextPlan(exec);
            boxes.assign(boxes.size(), cube(0, 1));
            search.finish(exec);
            const DeltaCounts counts = search.counts();
            oracle.expect(scene.boxes(), {{search.kept(), search.kept() + counts.kept},
                                          {search.added(), search.added() + counts.added},
                                          {search.removed(), search.removed() + counts.removed}});
            scene.step();
        }
        EXPECT_GT(oracle.added(), 500u);
        EXPECT_GT(oracle.removed(), 100u);
        EXPECT_EQ(TightExec::failures, 1);
        EXPECT_EQ(search.mode(), psap::NeighbourMode::Search);
    }
}
}  // namespace
}  // namespace cullet::test
