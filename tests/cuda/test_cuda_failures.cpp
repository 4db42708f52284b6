// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A failing GPU loses no pairs: whichever CUDA call fails, and however, the update reports it, the object can be
// destroyed or restarted, and another backend continues with the known pairs.

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/cuda/support/failing_calls.h"
#include "cullet/tests/cuda/support/named_options.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Number of boxes, and the stride of moving ones.
struct Motion
{
    std::uint32_t count;
    std::uint32_t every;
};
constexpr Motion kAllMove = {300, 1};
// Few enough for a device to gather moved boxes from the table.
constexpr Motion kSomeMove = {3000, 5};
// So many that a device copies all boxes from the table, in parts.
constexpr Motion kMostMove = {3000, 2};

/// The backend that continues after a failure.
enum class Heir
{
    Grid,
    SameBackend
};

/// Some updates of a world while a CUDA call fails.
class FailingWorld
{
public:
    FailingWorld(SearchOptions options, Heir heir, Motion motion)
        : m_heir(heir),
          m_motion(motion),
          m_steps(framesWithPlan(options, 3)),
          m_scene(SceneKind::Uniform, motion.count, 5)
    {
        options.initialCapacity = 1;
        m_backend = makeCudaBackend(options);
        for (std::uint32_t body = 0; body < m_motion.count; ++body)
            m_table.create(m_scene.boxes()[body], body + 1, kEverything);
    }

    /// Without a fault: whether the updates used a neighbour list.
    bool followsNear() const { return m_followed > 0; }

    void run(FaultInjection fault)
    {
        for (int step = 0; step < m_steps; ++step)
        {
            update(fault, step);
            m_scene.step();
            for (std::uint32_t body = 0; body < m_motion.count; body += m_motion.every)
                m_table.setBox(body, m_scene.boxes()[body]);
        }
    }

private:
    void update(FaultInjection fault, int step)
    {
        SCOPED_TRACE("step " + std::to_string(step));
        const ProxyView view = m_table.beginUpdate(0.05f, true);
        PairDelta delta;
        Status status = m_backend->update(view, delta);
        if (status != Status::Ok)
        {
            EXPECT_EQ(status, statusOf(fault));
            EXPECT_TRUE(delta.added.empty() && delta.removed.empty());
            setCudaFault(FaultInjection::None, 0);
            if (m_heir == Heir::Grid)
                m_backend = makeGridBackend();
            m_backend->restart(m_pairs);
            status = m_backend->update(view, delta);
        }
        ASSERT_EQ(status, Status::Ok);
        m_followed += m_backend->stats().path == std::string("near pairs") ? 1 : 0;
        PairDelta expected;
        ASSERT_EQ(m_oracle->update(view, expected), Status::Ok);
        m_table.endUpdate();
        Pairs stayed;
        std::set_difference(m_pairs.begin(), m_pairs.end(), expected.removed.begin(), expected.removed.end(),
                            std::back_inserter(stayed));
        m_pairs.clear();
        std::set_union(stayed.begin(), stayed.end(), expected.added.begin(), expected.added.end(),
                       std::back_inserter(m_pairs));
        EXPECT_EQ(delta.added, expected.added);
        EXPECT_EQ(delta.removed, expected.removed);
    }

    Heir m_heir;
    Motion m_motion;
    int m_steps;
    int m_followed = 0;
    BoxScene m_scene;
    ProxyTable m_table;
    std::unique_ptr<Backend> m_oracle = makeBruteForceBackend();
    Pairs m_pairs;
    std::unique_ptr<Backend> m_backend;
};

/// Fails every call of such updates once; returns the number of calls.
std::uint64_t failEveryCall(const SearchOptions& options, FaultInjection fault, Heir heir,
                            Motion motion = kAllMove)
{
    return failEachCall(fault,
                        [&](const FaultPlan& plan)
                        {
                            FailingWorld world(options, heir, motion);
                            plan.begin();
                            world.run(fault);
                        });
}

class CudaFailuresOfVariants : public testing::TestWithParam<NamedOptions>
{
};

TEST_P(CudaFailuresOfVariants, LeavePairsExactWhenBackendRestartsAfterOutOfMemory)
{
    EXPECT_GT(failEveryCall(GetParam().options, FaultInjection::OutOfMemory, Heir::SameBackend), 50u);
}

TEST_P(CudaFailuresOfVariants, LeavePairsExactWhenGridTakesOverAfterDeviceLoss)
{
    EXPECT_GT(failEveryCall(GetParam().options, FaultInjection::DeviceLost, Heir::Grid), 50u);
}

std::vector<NamedOptions> variantsAndStages()
{
    std::vector<NamedOptions> all = allVariants();
    SearchOptions timed;
    timed.timeStages = true;
    all.push_back({"TimedStages", timed});
    all.push_back({"Near", keepingNear()});
    return all;
}
INSTANTIATE_TEST_SUITE_P(Cuda, CudaFailuresOfVariants, testing::ValuesIn(variantsAndStages()), nameOf);

TEST(CudaFailures, CoverUpdatesThatUseNeighbourLists)
{
    FailingWorld world(keepingNear(), Heir::Grid, kAllMove);
    world.run(FaultInjection::None);
    EXPECT_TRUE(world.followsNear());
}

TEST(CudaFailures, LeavePairsExactWhenDeviceReadsProxyTable)
{
    EXPECT_GT(failEveryCall({}, FaultInjection::DeviceLost, Heir::Grid, kSomeMove), 50u);
    EXPECT_GT(failEveryCall({}, FaultInjection::OutOfMemory, Heir::SameBackend, kSomeMove), 50u);
    EXPECT_GT(failEveryCall({}, FaultInjection::DeviceLost, Heir::SameBackend, kMostMove), 50u);
}
}  // namespace
}  // namespace cullet::test
