// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A GPU that fails loses nothing: whichever CUDA call fails, and however, the update says so, the object can be
// destroyed or started again, and another backend goes on with the known pairs.

#include "broad/proxy_table.h"
#include "cuda/cuda_fault.h"
#include "tests/support/backend_session.h"
#include "tests/support/box_scenes.h"
#include "tests/support/boxes.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kCount = 300;

struct FaultEnd
{
    ~FaultEnd() { setCudaFault(CudaFault::None, 0); }
};

/// Three updates of a world with the `call`-th CUDA call failing; true when it did.
class FailingWorld
{
public:
    FailingWorld(PsapVariant variant, bool usesSameBackendAgain) : m_usesSameAgain(usesSameBackendAgain)
    {
        PsapOptions options;
        options.variant = variant;
        options.initialCapacity = 1;
        m_backend = makeCudaPsapBackend(options);
        for (std::uint32_t body = 0; body < kCount; ++body)
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
            for (const std::uint32_t body : m_scene.moved())
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
                m_backend = makeBruteForceBackend();
            m_backend->restart(m_oracle.pairs());
            status = m_backend->update(view, delta);
        }
        ASSERT_EQ(status, Status::Ok);
        const PairDelta expected = m_oracle.update(view);
        m_table.endUpdate();
        EXPECT_EQ(delta.added, expected.added);
        EXPECT_EQ(delta.removed, expected.removed);
    }

    bool m_usesSameAgain;
    BoxScene m_scene{SceneKind::Uniform, kCount, 5};
    ProxyTable m_table;
    PairOracle m_oracle;
    std::unique_ptr<Backend> m_backend;
    int m_failed = 0;
};

/// Fails every call once; returns how many there were.
std::uint64_t failEveryCall(PsapVariant variant, CudaFault fault, bool usesSameBackendAgain)
{
    for (std::uint64_t call = 0;; ++call)
    {
        SCOPED_TRACE("call " + std::to_string(call));
        FailingWorld world(variant, usesSameBackendAgain);
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
