// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Updates of small worlds that no pair can notice.
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
bool isQuiet(const Broadphase& broadphase)
{
    return std::strcmp(broadphase.stats().backend.path, "quiet") == 0;
}

/// The pair array, in its order.
std::vector<Pair> arrayOf(Broadphase& broadphase)
{
    const btBroadphasePairArray& array = broadphase.getOverlappingPairCache()->getOverlappingPairArray();
    std::vector<Pair> pairs;
    for (int i = 0; i < array.size(); ++i)
        pairs.push_back({idOf(array[i].m_pProxy0), idOf(array[i].m_pProxy1)});
    return pairs;
}

/// The same calls for a broad phase that may be quiet and for one that tests all boxes in each update.
class Twins
{
public:
    explicit Twins(std::uint32_t seed) : m_random(seed)
    {
        m_share = m_random.chance(0.5f) ? 0.05f : 0.5f;
        const int count = 2 + int(m_random.below(36));
        for (int i = 0; i < count; ++i)
            add();
    }

    /// Some boxes move a little, and rarely something else happens.
    void change()
    {
        for (std::size_t i = 0; i < m_own.size(); ++i)
        {
            if (m_random.chance(m_share))
                move(i, m_random.chance(0.0025f) ? 2.0f : 0.01f);
        }
        switch (m_random.below(120))
        {
            case 0:
                return add();
            case 1:
                return remove(any());
            case 2:
                return setMask(any());
            case 3:
                return setBox(any(), vec(1, 1, 1), -1);
            case 4:
                return removePair();
            default:
                return;
        }
    }

    void update()
    {
        own.calculateOverlappingPairs(nullptr);
        all.calculateOverlappingPairs(nullptr);
    }

    Broadphase own, all{bruteOptions()};

private:
    struct Cube
    {
        btVector3 centre;
        double half;
    };

    std::size_t any() { return m_random.below(static_cast<std::uint32_t>(m_own.size())); }

    void add()
    {
        const Cube cube{vec(m_random.point(-4, 4)), 0.5};
        m_cubes.push_back(cube);
        m_own.push_back(addCube(own, cube.centre, cube.half));
        m_all.push_back(addCube(all, cube.centre, cube.half));
    }
    void setBox(std::size_t i, const btVector3& centre, double half)
    {
        m_cubes[i] = {centre, half};
        moveCube(own, m_own[i], centre, half);
        moveCube(all, m_all[i], centre, half);
    }
    void move(std::size_t i, float way)
    {
        setBox(i, m_cubes[i].centre + vec(m_random.point(-way, way)), 0.5);
    }
    void setMask(std::size_t i)
    {
        const int mask = m_random.chance(0.5f) ? 0 : kAllGroups;
        m_own[i]->m_collisionFilterMask = m_all[i]->m_collisionFilterMask = mask;
        move(i, 0.001f);
    }
    void remove(std::size_t i)
    {
        if (m_own.size() <= 2)
            return;
        own.destroyProxy(m_own[i], nullptr);
        all.destroyProxy(m_all[i], nullptr);
        const auto at = static_cast<std::ptrdiff_t>(i);
        m_own.erase(m_own.begin() + at);
        m_all.erase(m_all.begin() + at);
        m_cubes.erase(m_cubes.begin() + at);
    }
    /// As an application does.
    void removePair()
    {
        const std::vector<Pair> pairs = arrayOf(own);
        if (pairs.empty())
            return;
        const Pair pair = pairs[m_random.below(static_cast<std::uint32_t>(pairs.size()))];
        for (Broadphase* broadphase : {&own, &all})
        {
            const auto& proxies = broadphase == &own ? m_own : m_all;
            btBroadphaseProxy *first = nullptr, *second = nullptr;
            for (btBroadphaseProxy* proxy : proxies)
            {
                first = idOf(proxy) == pair.first ? proxy : first;
                second = idOf(proxy) == pair.second ? proxy : second;
            }
            broadphase->getOverlappingPairCache()->removeOverlappingPair(first, second, nullptr);
        }
    }

    Random m_random;
    float m_share = 0;  ///< of the boxes that move in a step
    std::vector<Cube> m_cubes;
    std::vector<btBroadphaseProxy*> m_own, m_all;
};
}  // namespace

TEST(QuietBoxes, GiveSamePairsAsTestsOfAllBoxes)
{
    int updates = 0, quiet = 0, changes = 0;
    for (std::uint32_t seed = 1; seed <= 200; ++seed)
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Twins twins(seed);
        std::vector<Pair> before;
        for (int step = 0; step < 400; ++step)
        {
            twins.change();
            twins.update();
            const std::vector<Pair> pairs = arrayOf(twins.own);
            ASSERT_TRUE(pairs == arrayOf(twins.all)) << "update " << step;
            ++updates;
            quiet += isQuiet(twins.own) ? 1 : 0;
            changes += pairs == before ? 0 : 1;
            before = pairs;
        }
    }
    EXPECT_GT(10 * quiet, updates) << "the sample has quiet updates";
    EXPECT_GT(changes, 200 * 5) << "and changes of pairs";
}

TEST(QuietBoxes, TestNoPairWhileBoxesKeepTheirDistance)
{
    Broadphase broadphase;
    std::vector<btBroadphaseProxy*> proxies = {addCube(broadphase, vec(0, -50, 0), 49.5)};
    for (int i = 0; i < 8; ++i)
        proxies.push_back(addCube(broadphase, vec(3 * i - 10, 2, 0)));
    std::uint64_t tests = 0;
    int quiet = 0;
    for (int step = 0; step < 100; ++step)
    {
        for (std::size_t i = 1; i < proxies.size(); ++i)
            moveCube(broadphase, proxies[i], vec(3 * double(i) - 13 + 0.001 * step, 2, 0));
        broadphase.calculateOverlappingPairs(nullptr);
        tests += broadphase.stats().backend.candidates;
        quiet += isQuiet(broadphase) ? 1 : 0;
    }
    EXPECT_GE(quiet, 96);
    EXPECT_LE(tests, 64u * 9 + 3 * 36) << "a restart, and three updates of all pairs";
}

TEST(QuietBoxes, LeaveOtherBackendsTheirUpdates)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* const proxy = addCube(broadphase, vec(0, 0, 0));
    addCube(broadphase, vec(5, 0, 0));
    for (int step = 0; step < 10; ++step)
    {
        moveCube(broadphase, proxy, vec(0.001 * step, 0, 0));
        broadphase.calculateOverlappingPairs(nullptr);
        EXPECT_FALSE(isQuiet(broadphase));
    }
}
}  // namespace cullet::test
