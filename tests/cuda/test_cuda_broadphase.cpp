// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The broad phase for Bullet on a real device, compared with brute force: when the device fails, when the world moves
// to the device and back, and with filters.

#include "cullet/cuda/runtime/fault_injection.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/broadphase/exact_oracle.h"
#include "cullet/tests/plugin/log_scope.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr double kSide = 25;

/// Two broad phases with the same calls: cubes in a cube, about a pair per body with 5,000 bodies.
class Twins
{
public:
    explicit Twins(const BroadphaseOptions& options) : device(options), oracle(bruteOptions()) {}

    void add(std::uint32_t count)
    {
        for (std::uint32_t i = 0; i < count; ++i)
        {
            Body body;
            body.centre = place();
            // Three of four bodies pair with every body whose mask allows it.
            const bool isPicky = m_random.below(4) == 0;
            const int group = 1 << m_random.below(4);
            const int mask = isPicky ? static_cast<int>(m_random.below(16)) : kAllGroups;
            body.onDevice = addCube(device, body.centre, 0.5, group, mask);
            body.inOracle = addCube(oracle, body.centre, 0.5, group, mask);
            m_bodies.push_back(body);
        }
    }

    void remove(std::uint32_t count)
    {
        for (std::uint32_t i = 0; i < count; ++i)
        {
            device.destroyProxy(m_bodies.back().onDevice, nullptr);
            oracle.destroyProxy(m_bodies.back().inOracle, nullptr);
            m_bodies.pop_back();
        }
    }

    /// Moves all bodies, and compares the pairs.
    void step()
    {
        for (Body& body : m_bodies)
        {
            body.centre += way();
            moveCube(device, body.onDevice, body.centre);
            moveCube(oracle, body.inOracle, body.centre);
        }
        device.calculateOverlappingPairs(nullptr);
        oracle.calculateOverlappingPairs(nullptr);
        ASSERT_EQ(pairsOf(device), pairsOf(oracle));
    }

    void steps(int count)
    {
        for (int i = 0; i < count && !testing::Test::HasFatalFailure(); ++i)
        {
            SCOPED_TRACE("step " + std::to_string(i));
            step();
        }
    }

    void setFilter(btOverlapFilterCallback* filter)
    {
        device.getOverlappingPairCache()->setOverlapFilterCallback(filter);
        oracle.getOverlappingPairCache()->setOverlapFilterCallback(filter);
    }

    /// Changes the masks so that every `every`-th body forms no new pairs.
    void closeMasks(std::size_t every)
    {
        for (std::size_t i = 0; i < m_bodies.size(); i += every)
            m_bodies[i].onDevice->m_collisionFilterMask = m_bodies[i].inOracle->m_collisionFilterMask = 0;
    }

    /// Number of pairs on the device that the masks would refuse.
    int pairsAgainstMasks()
    {
        const btBroadphasePairArray& pairs = device.getOverlappingPairCache()->getOverlappingPairArray();
        int count = 0;
        for (int i = 0; i < pairs.size(); ++i)
            count += maskRule(*pairs[i].m_pProxy0, *pairs[i].m_pProxy1) ? 0 : 1;
        return count;
    }

    std::string backendName() const { return device.backend().name(); }

    Broadphase device;
    Broadphase oracle;

private:
    struct Body
    {
        btVector3 centre;
        btBroadphaseProxy* onDevice;
        btBroadphaseProxy* inOracle;
    };

    btVector3 place() { return vec(m_random.point(0, static_cast<float>(kSide))); }
    btVector3 way() { return vec(m_random.point(-0.2f, 0.2f)); }

    Random m_random{11};
    std::vector<Body> m_bodies;
};

BroadphaseOptions cudaOptions()
{
    BroadphaseOptions options;
    options.backend = BackendChoice::Cuda;
    return options;
}

TEST(CudaBroadphase, FallsBackToGridWhenDeviceFails)
{
    const LogScope log;
    for (const FaultInjection fault : {FaultInjection::DeviceLost, FaultInjection::OutOfMemory})
    {
        for (const std::uint64_t call : {0u, 3u, 12u})
        {
            SCOPED_TRACE("call " + std::to_string(call));
            loggedLines().clear();
            Twins twins(cudaOptions());
            twins.add(2000);
            twins.steps(5);
            ASSERT_EQ(twins.backendName(), "cuda");
            ASSERT_GT(pairsOf(twins.device).size(), 100u);
            // If the device is lost, every call fails from here on; the grid needs none.
            setCudaFault(fault, call);
            twins.steps(5);
            EXPECT_TRUE(hasCudaFaultHappened());
            setCudaFault(FaultInjection::None, 0);
            const BroadphaseStats stats = twins.device.stats();
            EXPECT_EQ(twins.backendName(), makeGridBackend()->name());
            EXPECT_EQ(std::string(stats.backendName), makeGridBackend()->name());
            EXPECT_EQ(stats.fallbacksTotal, 1u);
            EXPECT_EQ(stats.pairs, pairsOf(twins.oracle).size());
            ASSERT_EQ(loggedLines().size(), 1u);
            EXPECT_NE(loggedLines()[0].find("'cuda'"), std::string::npos) << loggedLines()[0];
        }
    }
}

TEST(CudaBroadphase, MovesWorldToDeviceWhenItGrowsAndBackWhenItShrinks)
{
    const LogScope log;
    const BroadphaseOptions options;
    Twins twins{options};
    for (int round = 0; round < 2; ++round)
    {
        SCOPED_TRACE("round " + std::to_string(round));
        twins.add(options.deviceBodies - 500 - twins.device.stats().bodies);
        twins.steps(10);
        EXPECT_EQ(twins.backendName(), makeGridBackend()->name());
        twins.add(1000);
        twins.steps(20);
        EXPECT_EQ(twins.backendName(), "cuda");
        EXPECT_GT(pairsOf(twins.device).size(), 500u);
        twins.remove(1500);
        twins.steps(10);
        EXPECT_EQ(twins.backendName(), "cuda") << "half of its size is enough";
        twins.remove(twins.device.stats().bodies - options.deviceBodies / 2 + 1);
        twins.steps(20);
        EXPECT_EQ(twins.backendName(), makeGridBackend()->name());
    }
    EXPECT_EQ(twins.device.stats().fallbacksTotal, 0u);
    EXPECT_TRUE(loggedLines().empty());
}

TEST(CudaBroadphase, AppliesMasksOnDeviceOnlyWithoutFilterCallback)
{
    struct OddSums final : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
        {
            return (a->m_uniqueId + b->m_uniqueId) % 2 != 0;
        }
    } filter;
    Twins twins(cudaOptions());
    twins.add(4000);
    twins.steps(4);
    ASSERT_GT(pairsOf(twins.device).size(), 1000u);
    EXPECT_EQ(twins.pairsAgainstMasks(), 0);
    twins.setFilter(&filter);
    twins.steps(6);
    EXPECT_GT(twins.pairsAgainstMasks(), 20) << "the callback lets in what the masks keep out";
    twins.setFilter(nullptr);
    twins.closeMasks(3);
    twins.steps(6);
    EXPECT_GT(twins.pairsAgainstMasks(), 0) << "pairs that exist stay";
    twins.setFilter(&filter);
    twins.steps(3);
    twins.setFilter(nullptr);
    twins.steps(3);
    EXPECT_EQ(twins.backendName(), "cuda");
    EXPECT_EQ(twins.device.stats().fallbacksTotal, 0u);
}
}  // namespace
}  // namespace cullet::test
