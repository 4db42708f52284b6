// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A GPU that fails loses nothing: whichever CUDA call fails, and however, the update says so, the object can be
// destroyed or started again, and another backend goes on with the known pairs.

#include "broad/proxy_table.h"
#include "cuda/cuda_fault.h"
#include "tests/support/box_scenes.h"
#include "tests/support/boxes.h"

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
/// How many boxes there are, and that every so many-th one moves.
struct Motion
{
    std::uint32_t count;
    std::uint32_t every;
};
constexpr Motion kAllMove = {300, 1};
// As many as a device picks boxes of from the table.
constexpr Motion kSomeMove = {3000, 5};
// So many that a device takes all boxes from the table, in parts.
constexpr Motion kMostMove = {3000, 2};

struct FaultEnd
{
    ~FaultEnd() { setCudaFault(CudaFault::None, 0); }
};

/// Three updates of a world with the `call`-th CUDA call failing; true when it did.
class FailingWorld
{
public:
    FailingWorld(PsapVariant variant, bool usesSameBackendAgain, Motion motion)
        : m_usesSameAgain(usesSameBackendAgain),
          m_motion(motion),
          m_scene(SceneKind::Uniform, motion.count, 5)
    {
        PsapOptions options;
        options.variant = variant;
        options.initialCapacity = 1;
        m_backend = makeCudaPsapBackend(options);
        for (std::uint32_t body = 0; body < m_motion.count; ++body)
            m_table.create(m_scene.boxes()[body], body + 1, kEverything);
    }

    bool run(CudaFault fault, std::uint64_t call)
    {
        const FaultEnd end;
        setCudaFault(fault, call);
        for (int step = 0; step < 3; ++step)
        {
            update(fault, step);
            m_scene.step();
            for (std::uint32_t body = 0; body < m_motion.count; body += m_motion.every)
                m_table.setBox(body, m_scene.boxes()[body]);
        }
        return m_failed != 0;
    }

private:
    void update(CudaFault fault, int step)
    {
        SCOPED_TRACE("step " + std::to_string(step));
        const ProxyView view = m_table.beginUpdate(0.05f, true);
        PairDelta delta;
        Status status = m_backend->update(view, delta);
        if (status != Status::Ok)
        {
            ++m_failed;
            EXPECT_EQ(status, fault == CudaFault::OutOfMemory ? Status::OutOfMemory : Status::DeviceLost);
            EXPECT_TRUE(delta.added.empty() && delta.removed.empty());
            setCudaFault(CudaFault::None, 0);
            if (!m_usesSameAgain)
                m_backend = makeGridBackend();
            m_backend->restart(m_pairs);
            status = m_backend->update(view, delta);
        }
        ASSERT_EQ(status, Status::Ok);
        PairDelta expected;
        ASSERT_EQ(m_oracle->update(view, expected), Status::Ok);
        m_table.endUpdate();
        std::vector<Pair> stayed;
        std::set_difference(m_pairs.begin(), m_pairs.end(), expected.removed.begin(), expected.removed.end(),
                            std::back_inserter(stayed));
        m_pairs.clear();
        std::set_union(stayed.begin(), stayed.end(), expected.added.begin(), expected.added.end(),
                       std::back_inserter(m_pairs));
        EXPECT_EQ(delta.added, expected.added);
        EXPECT_EQ(delta.removed, expected.removed);
    }

    bool m_usesSameAgain;
    Motion m_motion;
    BoxScene m_scene;
    ProxyTable m_table;
    std::unique_ptr<Backend> m_oracle = makeBruteForceBackend();
    std::vector<Pair> m_pairs;
    std::unique_ptr<Backend> m_backend;
    int m_failed = 0;
};

/// Fails every call once; returns how many there were.
std::uint64_t failEveryCall(PsapVariant variant, CudaFault fault, bool usesSameBackendAgain,
                            Motion motion = kAllMove)
{
    for (std::uint64_t call = 0;; ++call)
    {
        SCOPED_TRACE("call " + std::to_string(call));
        FailingWorld world(variant, usesSameBackendAgain, motion);
        if (!world.run(fault, call) || testing::Test::HasFailure())
            return call;
    }
}

TEST(CudaFailures, AnyCallMayRunOutOfMemoryAndAnotherBackendGoesOn)
{
    EXPECT_GT(failEveryCall(PsapVariant::Rows, CudaFault::OutOfMemory, false), 50u);
    EXPECT_GT(failEveryCall(PsapVariant::Literal, CudaFault::OutOfMemory, false), 50u);
}

TEST(CudaFailures, AnyCallMayRunOutOfMemoryAndTheBackendStartsAgain)
{
    EXPECT_GT(failEveryCall(PsapVariant::Rows, CudaFault::OutOfMemory, true), 50u);
    EXPECT_GT(failEveryCall(PsapVariant::Literal, CudaFault::OutOfMemory, true), 50u);
}

TEST(CudaFailures, AnyCallMayLoseTheDeviceAndAnotherBackendGoesOn)
{
    EXPECT_GT(failEveryCall(PsapVariant::Rows, CudaFault::DeviceLost, false), 50u);
    EXPECT_GT(failEveryCall(PsapVariant::Literal, CudaFault::DeviceLost, false), 50u);
}

TEST(CudaFailures, AnyCallMayFailWhereTheDeviceReadsTheTable)
{
    EXPECT_GT(failEveryCall(PsapVariant::Rows, CudaFault::DeviceLost, false, kSomeMove), 50u);
    EXPECT_GT(failEveryCall(PsapVariant::Rows, CudaFault::OutOfMemory, true, kSomeMove), 50u);
    EXPECT_GT(failEveryCall(PsapVariant::Rows, CudaFault::DeviceLost, true, kMostMove), 50u);
}

TEST(CudaFailures, TheFactoryTellsWhyThereIsNoBackend)
{
    const FaultEnd end;
    setCudaFault(CudaFault::DeviceLost, 0);
    std::string why;
    EXPECT_EQ(makeCudaPsapBackend({}, &why), nullptr);
    EXPECT_FALSE(why.empty());
    setCudaFault(CudaFault::None, 0);
    PsapOptions options;
    options.device = 1000;
    why.clear();
    EXPECT_EQ(makeCudaPsapBackend(options, &why), nullptr);
    EXPECT_FALSE(why.empty());
    EXPECT_NE(makeCudaPsapBackend({}, &why), nullptr) << "a failed start must leave no trace";
}
}  // namespace
}  // namespace cullet::test
