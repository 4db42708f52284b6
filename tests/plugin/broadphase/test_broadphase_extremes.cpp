// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/core/box_convert.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/broadphase/exact_oracle.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

std::vector<BroadphaseOptions> cpuBackends()
{
    BroadphaseOptions grid;
    grid.backend = BackendChoice::Grid;
    BroadphaseOptions rows = grid;
    rows.grid.flatLimit = 0;
    return {grid, rows, bruteOptions()};
}

btBroadphaseProxy* addBox(btBroadphaseInterface& broadphase, const btVector3& min, const btVector3& max)
{
    return broadphase.createProxy(min, max, 0, nullptr, 1, kAllGroups, nullptr);
}

/// The pairs after an update, checked against the exact boxes.
void expectExactPairs(Broadphase& broadphase, const std::vector<btBroadphaseProxy*>& proxies)
{
    EXPECT_EQ(updatedPairs(broadphase), exactPairs(proxies)) << broadphase.stats().backendName;
}

TEST(BroadphaseExtremes, FindsAllOverlapsOfPlanesAndInfiniteBoxes)
{
    for (const BroadphaseOptions& options : cpuBackends())
    {
        Broadphase broadphase(options);
        std::vector<btBroadphaseProxy*> proxies;
        const double plane = double(BT_LARGE_FLOAT);  // 1e18 in float builds, 1e30 in double builds
        for (const double size : {plane, 5e29, kInf})
            proxies.push_back(addBox(broadphase, vec(-size, -size, -size), vec(size, size, size)));
        proxies.push_back(addBox(broadphase, vec(-kInf, 0, -kInf), vec(kInf, 0.5, kInf)));
        for (int i = 0; i < 300; ++i)
            proxies.push_back(addCube(broadphase, vec(0.0009 * i, 0.01 * i, 0), 0.0005));
        expectExactPairs(broadphase, proxies);
        ASSERT_GT(pairsOf(broadphase).size(), 900u);
        for (std::size_t i = 4; i < proxies.size(); ++i)
            moveCube(broadphase, proxies[i], vec(0.0009 * double(i), 0.011 * double(i), 0), 0.0005);
        // No separated pair is nearer than the margin.
        for (const Pair pair : updatedPairs(broadphase))
            EXPECT_LE(pair.first, 303u);
        btVector3 min;
        btVector3 max;
        broadphase.getBroadphaseAabb(min, max);
        EXPECT_EQ(double(max.y()), kInf);
    }
}

TEST(BroadphaseExtremes, KeepsAllPairsWithMarginThatNoFloatHolds)
{
    for (BroadphaseOptions options : cpuBackends())
    {
        for (const btScalar margin : {std::numeric_limits<btScalar>::max(), btScalar(kInf), btScalar(1e30)})
        {
            options.margin = margin;
            Broadphase broadphase(options);
            std::vector<btBroadphaseProxy*> cubes;
            for (int i = 0; i < 40; ++i)
                cubes.push_back(addCube(broadphase, vec(0.9 * i, 0, 0)));
            ASSERT_EQ(updatedPairs(broadphase).size(), 39u);
            // Every second one leaves for the side, and meets the next of them there.
            for (int i = 0; i < 40; i += 2)
                moveCube(broadphase, cubes[std::size_t(i)], vec(0.45 * i, 50, 0));
            EXPECT_EQ(updatedPairs(broadphase).size(), 39u + 19u)
                << broadphase.stats().backendName << ' ' << margin;
        }
    }
}

TEST(BroadphaseExtremes, CountsInvalidBoxesAndPairsThemOnlyOnceValidAgain)
{
    for (const BroadphaseOptions& options : cpuBackends())
    {
        Broadphase broadphase(options);
        std::vector<btBroadphaseProxy*> proxies;
        for (int i = 0; i < 50; ++i)
            proxies.push_back(addCube(broadphase, vec(0.9 * i, 0, 0)));
        ASSERT_EQ(updatedPairs(broadphase).size(), 49u);
        broadphase.setAabb(proxies[10], vec(kNotANumber, 0, 0), vec(1, 1, 1), nullptr);
        broadphase.setAabb(proxies[20], vec(1, 1, 1), vec(-1, -1, -1), nullptr);
        broadphase.setAabb(proxies[30], vec(0, 0, 0), vec(1, 1, kNotANumber), nullptr);
        btBroadphaseProxy* born = addBox(broadphase, vec(0, kNotANumber, 0), vec(1, 1, 1));
        EXPECT_EQ(updatedPairs(broadphase).size(), 49u - 6u);
        EXPECT_EQ(broadphase.stats().invalidBoxesTotal, 4u);
        Ids valid;
        for (std::uint32_t id = 1; id <= 50; ++id)
        {
            if (id != 11 && id != 21 && id != 31)
                valid.push_back(id);
        }
        EXPECT_EQ(boxHits(broadphase, vec(-99, -99, -99), vec(99, 99, 99)), valid);
        EXPECT_EQ(rayHits(broadphase, vec(-9, 0, 0), vec(99, 0, 0)), valid);
        for (const int i : {10, 20, 30})
            moveCube(broadphase, proxies[i], vec(0.9 * i, 0, 0));
        moveCube(broadphase, born, vec(0, 0, 0));
        EXPECT_EQ(updatedPairs(broadphase).size(), 49u + 2u);
    }
}

TEST(BroadphaseExtremes, CountsNanBoxOnceWhenSetRepeatedly)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* proxy = addCube(broadphase, vec(0, 0, 0));
    const btVector3 nan = vec(kNotANumber, kNotANumber, kNotANumber);
    for (int i = 0; i < 5; ++i)
        broadphase.setAabb(proxy, nan, nan, nullptr);
    EXPECT_EQ(broadphase.stats().invalidBoxesTotal, 1u);
}

TEST(BroadphaseExtremes, RejectsBarelyInvertedDoubleBoxDespiteRounding)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    const double third = 1.0 / 3.0;
    const double below = std::nextafter(third, 0.0);
    // Both round to the same float; in a double build min > max.
    addBox(broadphase, vec(third, 0, 0), vec(below, 1, 1));
    EXPECT_EQ(updatedPairs(broadphase).size(), sizeof(btScalar) == 8 ? 0u : 1u);
}

struct Layout
{
    const char* name;
    std::function<btVector3(int, Random&)> centre;
    double half;
};

TEST(BroadphaseExtremes, FindsExactPairsInDegenerateLayouts)
{
    const std::vector<Layout> layouts = {
        {"far from the origin", [](int i, Random& r) { return vec(1e5 + 0.7 * i, 1e5 + r.unit(), -1e5); },
         0.5},
        {"one point", [](int, Random&) { return vec(3, 3, 3); }, 0.0},
        {"concentric", [](int i, Random&) { return vec(0, 0, 1e-3 * i); }, 2.0},
        {"a line", [](int i, Random&) { return vec(0, 0.4 * i, 0); }, 0.5},
        {"a diagonal", [](int i, Random&) { return vec(0.3 * i, 0.3 * i, 0.3 * i); }, 0.5},
        {"one cell", [](int, Random& r) { return vec(r.point(0, 1)); }, 0.05},
        {"tiny in a large space",
         [](int, Random& r)
         {
             const float z = r.between(0, 1), y = r.between(0, 1), x = r.between(-1e3f, 1e3f);
             return vec(x, y, z);
         },
         1e-3},
    };
    for (const BroadphaseOptions& options : cpuBackends())
    {
        for (const Layout& layout : layouts)
        {
            SCOPED_TRACE(layout.name);
            Broadphase broadphase(options);
            Random random(5);
            std::vector<btBroadphaseProxy*> proxies;
            for (int i = 0; i < 400; ++i)
                proxies.push_back(addCube(broadphase, layout.centre(i, random), layout.half));
            // A kilometre by a millimetre by a kilometre, through the middle of the scene.
            const btVector3 middle = proxies[200]->m_aabbMin;
            proxies.push_back(
                addBox(broadphase, middle - vec(500, 0.0005, 500), middle + vec(500, 0.0005, 500)));
            expectExactPairs(broadphase, proxies);
            EXPECT_FALSE(pairsOf(broadphase).empty()) << "or the layout is void";
            // Every other box changes places with one far from it, and the plate goes aside.
            for (std::size_t i = 0; i < 200; i += 2)
            {
                const btVector3 min = proxies[i]->m_aabbMin, max = proxies[i]->m_aabbMax;
                broadphase.setAabb(proxies[i], proxies[i + 200]->m_aabbMin, proxies[i + 200]->m_aabbMax,
                                   nullptr);
                broadphase.setAabb(proxies[i + 200], min, max, nullptr);
            }
            moveCube(broadphase, proxies[400], middle + vec(0, 0, 5000));
            const Pairs moved = updatedPairs(broadphase);
            EXPECT_TRUE(containsAll(moved, exactPairs(proxies))) << broadphase.stats().backendName;
            for (const Pair pair : moved)
                EXPECT_LT(pair.second, 401u) << "of the plate";
        }
    }
}

TEST(BroadphaseExtremes, FindsPairsOfLongBoxesWithin40MiB)
{
    // 1000 bodies at 1,000 m/s: boxes of 0.5 x 0.5 x 17 m, rotated in every step.
    BroadphaseOptions grid;
    grid.backend = BackendChoice::Grid;
    grid.grid.flatLimit = 0;
    Broadphase broadphase(grid);
    Random random(3);
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 1000; ++i)
        proxies.push_back(addCube(broadphase, vec(random.point(0, 60))));
    for (int step = 0; step < 5; ++step)
    {
        for (btBroadphaseProxy* proxy : proxies)
        {
            const btVector3 centre = vec(random.point(0, 60));
            const btVector3 extent = vec(0.25, 0.25, 8.5);
            broadphase.setAabb(proxy, centre - extent, centre + extent, nullptr);
        }
        ASSERT_TRUE(containsAll(updatedPairs(broadphase), exactPairs(proxies)));
    }
    EXPECT_LT(broadphase.stats().bytes + broadphase.stats().backend.bytes, 40u << 20);
}

TEST(BroadphaseExtremes, FindsAllPairsOfThousandCoincidentBoxes)
{
    for (const BroadphaseOptions& options : cpuBackends())
    {
        Broadphase broadphase(options);
        for (int i = 0; i < 1000; ++i)
            addCube(broadphase, vec(0, 0, 0));
        EXPECT_EQ(updatedPairs(broadphase).size(), 1000u * 999u / 2u);
    }
}

TEST(BroadphaseExtremes, KeepsDoubleResolutionFarFromOrigin)
{
    if (sizeof(btScalar) == 4)
        GTEST_SKIP() << "for double builds";
    for (const BroadphaseOptions& options : cpuBackends())
    {
        Broadphase broadphase(options);
        std::vector<btBroadphaseProxy*> proxies;
        // A float has a spacing of 1 m at 1e7 m; the boxes are 0.1 m apart. Most boxes are at the origin, which stays that
        // of the table.
        for (int i = 0; i < 100; ++i)
            proxies.push_back(addCube(broadphase, vec(1e7 + 0.3 * i, 0, 0), 0.1 + 0.06 * (i % 2)));
        for (int i = 0; i < 120; ++i)
            proxies.push_back(addCube(broadphase, vec(0.9 * i, 0, 0)));
        const Pairs exact = exactPairs(proxies);
        EXPECT_EQ(updatedPairs(broadphase), exact);
        EXPECT_GT(broadphase.stats().pendingPairs, 100u)
            << "float boxes overlap more often, or the test is void";
    }
}

/// Boxes of 10 cm that walk in a cube of 2 m, and a floor without bounds, compared with the exact pairs.
struct FarCrowd
{
    FarCrowd(const BroadphaseOptions& options, const btVector3& place_) : broadphase(options), place(place_)
    {
        for (int i = 0; i < 300; ++i)
        {
            places.push_back(randomPlace());
            proxies.push_back(addCube(broadphase, place + places.back(), 0.05));
        }
        const btVector3 most(btScalar(1e18), btScalar(1e18), btScalar(1e18));
        proxies.push_back(broadphase.createProxy(-most, btVector3(most.x(), place.y() - 1, most.z()), 0,
                                                 nullptr, 1, -1, nullptr));
    }

    btVector3 randomPlace()
    {
        const std::array<float, 3> point = random.point(-1, 1);
        return vec(point[0], point[1], point[2]);
    }

    void step()
    {
        for (std::size_t i = 0; i < places.size(); i += 2)
        {
            places[i] = btScalar(0.9) * places[i] + btScalar(0.05) * randomPlace();
            moveCube(broadphase, proxies[i], place + places[i], 0.05);
        }
    }

    /// Expects the exact pairs, and others only if they are within the margin.
    void expectPairs(const Pairs& exact)
    {
        const Pairs pairs = updatedPairs(broadphase);
        EXPECT_TRUE(std::includes(pairs.begin(), pairs.end(), exact.begin(), exact.end()));
        for (const Pair pair : pairs)
            EXPECT_FALSE(areSeparatedBy(*proxies[pair.first - 1], *proxies[pair.second - 1], kMargin));
    }

    static constexpr btScalar kMargin = btScalar(0.001);
    static constexpr std::uint32_t kSeed = 51;
    Random random{kSeed};
    Broadphase broadphase;
    btVector3 place;
    std::vector<btVector3> places;
    std::vector<btBroadphaseProxy*> proxies;
};

TEST(BroadphaseExtremes, KeepsNoRoundingsOfDoubleWorldThatIsFarFromOrigin)
{
    if (sizeof(btScalar) == sizeof(float))
        GTEST_SKIP() << "a float has no such resolution";
    SCOPED_TRACE("seed " + std::to_string(FarCrowd::kSeed));
    for (BroadphaseOptions options : cpuBackends())
    {
        options.margin = FarCrowd::kMargin;
        FarCrowd crowd(options, vec(6.4e6, -6.4e6, 1e6));
        std::size_t mostPairs = 0;
        for (int update = 0; update < 60; ++update)
        {
            crowd.step();
            // The world travels: its boxes become coarse again, until the origin follows.
            if (update >= 20)
                crowd.place += vec(3e4, 0, 0);
            const Pairs exact = exactPairs(crowd.proxies);
            mostPairs = std::max(mostPairs, exact.size());
            crowd.expectPairs(exact);
            if (update < 20)
            {
                ASSERT_LT(crowd.broadphase.stats().pendingPairs, 10u) << update;
            }
            const btVector3 low = crowd.place - vec(0.2, 0.2, 0.2), high = crowd.place + vec(0.2, 0.2, 0.2);
            std::vector<std::uint32_t> inside;
            for (const btBroadphaseProxy* proxy : crowd.proxies)
            {
                if (overlapsExactly(proxy->m_aabbMin, proxy->m_aabbMax, low, high))
                    inside.push_back(idOf(proxy));
            }
            ASSERT_EQ(boxHits(crowd.broadphase, low, high), inside) << update;
        }
        EXPECT_GT(mostPairs, 100u);
    }
}

TEST(BroadphaseExtremes, AddsPairsOfGhostsAtOnceAfterOriginOfTableMoved)
{
    btGhostPairCallback callback;
    Broadphase broadphase(bruteOptions());
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
    btGhostObject ghost;
    btCollisionObject object, other;
    btBroadphaseProxy* trigger = addCube(broadphase, vec(6.4e6, 0, 0), 0.5, 1, kAllGroups, &ghost);
    btBroadphaseProxy* walker = addCube(broadphase, vec(6.4e6, 0, 5), 0.5, 1, kAllGroups, &object);
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
    moveCube(broadphase, walker, vec(6.4e6, 0, 0.5));
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 1);
    btBroadphaseProxy* third = addCube(broadphase, vec(6.4e6, 0, -0.5), 0.5, 1, kAllGroups, &other);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 2);
    moveCube(broadphase, trigger, vec(6.4e6, 9, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{2, 3}}));
    for (btBroadphaseProxy* proxy : {trigger, walker, third})
        broadphase.destroyProxy(proxy, nullptr);
}

TEST(BroadphaseExtremes, RemovesSeparatedPairsOfDoubleWorldFarFromOrigin)
{
    if (sizeof(btScalar) == sizeof(float))
        GTEST_SKIP() << "a float has no such resolution";
    btGhostPairCallback callback;
    for (const double at : {6.4e6, 1e9, 1.5e11})
    {
        Broadphase broadphase(bruteOptions());
        broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
        btGhostObject ghost;
        btCollisionObject object, other;
        btBroadphaseProxy* first = addCube(broadphase, vec(at, 0, 0), 0.5, 1, kAllGroups, &object);
        btBroadphaseProxy* second = addCube(broadphase, vec(at, 0, 0), 0.5, 1, kAllGroups, &other);
        btBroadphaseProxy* third = addCube(broadphase, vec(at, 0, 0), 0.5, 1, kAllGroups, &ghost);
        ASSERT_EQ(updatedPairs(broadphase).size(), 3u);
        for (int visit = 0; visit < 3; ++visit)
        {
            moveCube(broadphase, second, vec(at + 1.2, 0, 0));
            EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 3}})) << at;
            EXPECT_EQ(ghost.getNumOverlappingObjects(), 1);
            EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 3}})) << at;
            moveCube(broadphase, second, vec(at + 0.9, 0, 0));
            EXPECT_EQ(updatedPairs(broadphase).size(), 3u) << at;
        }
        for (btBroadphaseProxy* proxy : {first, second, third})
            broadphase.destroyProxy(proxy, nullptr);
        EXPECT_EQ(updatedPairs(broadphase), Pairs{});
    }
}

TEST(BroadphaseExtremes, RemovesSeparatedPairsTooLateByHalfTheMarginAtMost)
{
    if (sizeof(btScalar) == sizeof(float))
        GTEST_SKIP() << "floats are exact";
    constexpr double kMargin = 0.05;
    int late = 0;
    for (int i = 0; i < 200; ++i)
    {
        BroadphaseOptions options = bruteOptions();
        options.margin = kMargin;
        Broadphase broadphase(options);
        const double at = 104000 - 0.37 * i;
        addCube(broadphase, vec(at, 0, 0));
        btBroadphaseProxy* mover = addCube(broadphase, vec(at, 0, 0));
        const auto isThereAt = [&](double gap)
        {
            moveCube(broadphase, mover, vec(at + 1 + gap, 0, 0));
            return updatedPairs(broadphase).size() == 1;
        };
        ASSERT_TRUE(isThereAt(-0.5));
        EXPECT_TRUE(isThereAt(1.999 * kMargin)) << at;
        late += isThereAt(2.001 * kMargin) ? 1 : 0;
        EXPECT_FALSE(isThereAt(2.5 * kMargin)) << at;
    }
    EXPECT_GT(late, 20) << "the sample has roundings that matter";
}
}  // namespace
}  // namespace cullet::test
