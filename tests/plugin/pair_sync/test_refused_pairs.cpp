// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Pairs that the filter refuses, more of them than are listed.
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <LinearMath/btAabbUtil2.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

namespace cullet::test
{
namespace
{
/// Answers by a rule of the two ids, and remembers the last answer and the number of questions for each pair.
struct RememberingFilter final : btOverlapFilterCallback
{
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        const Pair pair = makePair(uniqueIdOf(a), uniqueIdOf(b));
        ++asked;
        return answers[pairKey(pair)] = rule(pair);
    }
    std::function<bool(Pair)> rule = [](Pair) { return false; };
    mutable std::map<std::uint64_t, bool> answers;
    mutable int asked = 0;
};

/// Cubes at one place, each pair of which the filter has refused.
class RefusedPairs : public testing::Test
{
protected:
    static constexpr int kCubes = 100;
    static constexpr int kPairs = kCubes * (kCubes - 1) / 2;

    void SetUp() override
    {
        cache().setOverlapFilterCallback(&m_filter);
        for (int i = 0; i < kCubes; ++i)
            m_cubes.push_back(addCube(m_broadphase, vec(0, 0, 0)));
        m_broadphase.calculateOverlappingPairs(nullptr);
        ASSERT_EQ(m_filter.asked, kPairs);
        ASSERT_LT(m_broadphase.stats().pendingPairs, std::uint64_t{kPairs}) << "not all are listed";
    }
    void TearDown() override { cache().setOverlapFilterCallback(nullptr); }

    btOverlappingPairCache& cache() { return *m_broadphase.getOverlappingPairCache(); }
    std::size_t pairsAfterUpdate() { return updatedPairs(m_broadphase).size(); }

    Broadphase m_broadphase{bruteOptions()};
    RememberingFilter m_filter;
    std::vector<btBroadphaseProxy*> m_cubes;
};

TEST_F(RefusedPairs, AreNotAskedAboutAgainWhileTheirBoxesStayWithinTheirSkins)
{
    for (const double x : {0.01, 0.03, -0.03, 0.0})
    {
        for (btBroadphaseProxy* cube : m_cubes)
            moveCube(m_broadphase, cube, vec(x, 0, 0));
        EXPECT_EQ(pairsAfterUpdate(), 0u);
    }
    EXPECT_EQ(m_filter.asked, kPairs);
}

TEST_F(RefusedPairs, AreAskedAboutOnceWhenOneOrBothBoxesLeaveTheirSkins)
{
    moveCube(m_broadphase, m_cubes[7], vec(0.2, 0, 0));
    EXPECT_EQ(pairsAfterUpdate(), 0u);
    EXPECT_EQ(m_filter.asked, kPairs + kCubes - 1);
    moveCube(m_broadphase, m_cubes[90], vec(0.2, 0, 0));
    moveCube(m_broadphase, m_cubes[3], vec(0.2, 0, 0));
    EXPECT_EQ(pairsAfterUpdate(), 0u);
    EXPECT_EQ(m_filter.asked, kPairs + kCubes - 1 + 2 * (kCubes - 1) - 1);
}

TEST_F(RefusedPairs, EnterWhenTheFilterAcceptsThemAndTheirBoxLeavesItsSkin)
{
    m_filter.rule = [](Pair pair) { return pair.first == 8 || pair.second == 8; };
    moveCube(m_broadphase, m_cubes[3], vec(0.2, 0, 0));
    EXPECT_EQ(updatedPairs(m_broadphase), (Pairs{{4, 8}}));
    moveCube(m_broadphase, m_cubes[7], vec(0.2, 0, 0));
    EXPECT_EQ(pairsAfterUpdate(), std::size_t{kCubes - 1});
    const int before = m_filter.asked;
    moveCube(m_broadphase, m_cubes[7], vec(0.4, 0, 0));
    EXPECT_EQ(pairsAfterUpdate(), std::size_t{kCubes - 1});
    EXPECT_EQ(m_filter.asked, before) << "pairs that are in the cache";
}

TEST_F(RefusedPairs, AreAskedAboutInTheNextUpdateWhenAnotherFilterIsSet)
{
    RememberingFilter other;
    other.rule = [](Pair) { return true; };
    cache().setOverlapFilterCallback(&other);
    EXPECT_EQ(pairsAfterUpdate(), std::size_t{kPairs});
    cache().setOverlapFilterCallback(&m_filter);
}

TEST_F(RefusedPairs, EnterInTheNextUpdateWhenTheFilterIsTakenAway)
{
    cache().setOverlapFilterCallback(nullptr);
    EXPECT_EQ(pairsAfterUpdate(), std::size_t{kPairs});
}

TEST_F(RefusedPairs, EnterWhenTheFilterIsTakenAwayAfterAPairWasTakenOutOfTheCache)
{
    m_filter.rule = [](Pair pair) { return pair.first == 8 || pair.second == 8; };
    moveCube(m_broadphase, m_cubes[7], vec(0.2, 0, 0));
    ASSERT_EQ(pairsAfterUpdate(), std::size_t{kCubes - 1});
    cache().removeOverlappingPair(m_cubes[7], m_cubes[20], nullptr);
    cache().setOverlapFilterCallback(nullptr);
    EXPECT_EQ(pairsAfterUpdate(), std::size_t{kPairs});
}

TEST_F(RefusedPairs, AreListedAgainWhenNoneIsLeft)
{
    for (int i = 0; i < kCubes; ++i)
        moveCube(m_broadphase, m_cubes[std::size_t(i)], vec(3 * i, 0, 0));
    EXPECT_EQ(pairsAfterUpdate(), 0u);
    moveCube(m_broadphase, m_cubes[0], vec(3.5, 0, 0));
    EXPECT_EQ(pairsAfterUpdate(), 0u);
    EXPECT_EQ(m_broadphase.stats().pendingPairs, 1u);
}

TEST_F(RefusedPairs, StayRefusedWhenPairsAreTakenOutOfTheCache)
{
    m_filter.rule = [](Pair pair) { return pair.first == 8 || pair.second == 8; };
    moveCube(m_broadphase, m_cubes[7], vec(0.2, 0, 0));
    ASSERT_EQ(pairsAfterUpdate(), std::size_t{kCubes - 1});
    cache().removeOverlappingPair(m_cubes[7], m_cubes[20], nullptr);
    for (int update = 0; update < 3; ++update)
        EXPECT_EQ(pairsAfterUpdate(), std::size_t{kCubes - 2}) << "nothing has moved";
    moveCube(m_broadphase, m_cubes[7], vec(0.4, 0, 0));
    EXPECT_EQ(pairsAfterUpdate(), std::size_t{kCubes - 1});
}

TEST_F(RefusedPairs, AreAskedAboutAgainWhenTheFilterMovesBoxes)
{
    // The box of the last cube is elsewhere while the filter is asked about the one that has moved, and then back.
    bool isAway = false;
    m_filter.rule = [&](Pair)
    {
        if (!isAway)
            moveCube(m_broadphase, m_cubes.back(), vec(50, 0, 0));
        isAway = true;
        return true;
    };
    moveCube(m_broadphase, m_cubes[7], vec(0.2, 0, 0));
    m_broadphase.calculateOverlappingPairs(nullptr);
    ASSERT_TRUE(isAway);
    moveCube(m_broadphase, m_cubes.back(), vec(0, 0, 0));
    m_broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_NE(cache().findPair(m_cubes[7], m_cubes.back()), nullptr);
}

/// Cubes at one place, a third of whose pairs the filter has refused: more than are listed, and too few for AllowedPairs.
class PartlyRefusedPairs : public testing::Test
{
protected:
    static constexpr int kCubes = 100;
    static bool isAllowed(Pair pair) { return (pair.first + pair.second) % 3 != 0; }

    void SetUp() override
    {
        m_filter.rule = isAllowed;
        cache().setOverlapFilterCallback(&m_filter);
        for (int i = 0; i < kCubes; ++i)
            m_cubes.push_back(addCube(m_broadphase, vec(0, 0, 0)));
        m_broadphase.calculateOverlappingPairs(nullptr);
        ASSERT_EQ(m_broadphase.stats().pendingPairs, 0u);
        ASSERT_STRNE(m_broadphase.stats().backend.path, "allowed pairs");
    }
    void TearDown() override { cache().setOverlapFilterCallback(nullptr); }

    btOverlappingPairCache& cache() { return *m_broadphase.getOverlappingPairCache(); }
    Pairs pairsAfterUpdate() { return updatedPairs(m_broadphase); }
    std::uint64_t listed() const { return m_broadphase.stats().pendingPairs; }

    /// Moves the cubes apart, the first two by less than the margin.
    void scatter()
    {
        for (int i = 0; i < kCubes; ++i)
            moveCube(m_broadphase, m_cubes[std::size_t(i)], vec(3 * i, 1, 0));
        moveCube(m_broadphase, m_cubes[1], vec(1.05, 1, 0));
        EXPECT_EQ(pairsAfterUpdate(), Pairs{});
    }

    /// A cube that all others come near to, and which they have never overlapped. The filter allows its pairs.
    btBroadphaseProxy* addNearAll(btCollisionObject* object = nullptr)
    {
        btBroadphaseProxy* const cube = addCube(m_broadphase, vec(3, 0, 0), 0.5, 1, kAllGroups, object);
        m_filter.rule = [](Pair pair) { return pair.second == kCubes + 1 || isAllowed(pair); };
        for (btBroadphaseProxy* other : m_cubes)
            moveCube(m_broadphase, other, vec(1.95, 0, 0));
        m_pairsOfOthers = pairsAfterUpdate().size();
        EXPECT_EQ(listed(), std::uint64_t{kCubes});
        return cube;
    }

    Broadphase m_broadphase{bruteOptions()};
    RememberingFilter m_filter;
    std::vector<btBroadphaseProxy*> m_cubes;
    std::size_t m_pairsOfOthers = 0;
};

TEST_F(PartlyRefusedPairs, EnterWhenFilterAcceptsThemAfterTheyPartedByLessThanTheMargin)
{
    scatter();
    m_filter.rule = [](Pair) { return true; };
    moveCube(m_broadphase, m_cubes[1], vec(0.5, 1, 0));
    EXPECT_EQ(pairsAfterUpdate(), (Pairs{{1, 2}}));
}

TEST_F(PartlyRefusedPairs, EnterWhenFilterIsTakenAwayAfterTheyPartedByLessThanTheMargin)
{
    scatter();
    cache().setOverlapFilterCallback(nullptr);
    EXPECT_EQ(pairsAfterUpdate(), Pairs{});
    moveCube(m_broadphase, m_cubes[1], vec(0.5, 1, 0));
    EXPECT_EQ(pairsAfterUpdate(), (Pairs{{1, 2}}));
}

TEST_F(PartlyRefusedPairs, EnterWhenFilterHasAcceptedThemWithinTheMarginAndTheyMeetAgain)
{
    m_filter.rule = [](Pair) { return true; };
    scatter();
    const auto pairsAt = [&](double x)
    {
        moveCube(m_broadphase, m_cubes[1], vec(x, 1, 0));
        return pairsAfterUpdate();
    };
    EXPECT_EQ(pairsAt(1.01), Pairs{});
    EXPECT_EQ(pairsAt(0.99), (Pairs{{1, 2}}));
    EXPECT_EQ(pairsAt(1.01), (Pairs{{1, 2}}));
    EXPECT_EQ(pairsAt(1.5), Pairs{});
}

TEST_F(PartlyRefusedPairs, EnterAndLeaveAsOthersWhenBoxesWereNearAndHadNeverOverlapped)
{
    btBroadphaseProxy* const cube = addNearAll();
    const std::uint64_t restarts = m_broadphase.stats().restartsTotal;
    for (const double x : {2.9, 3.04})
    {
        moveCube(m_broadphase, cube, vec(x, 0, 0));
        EXPECT_EQ(pairsAfterUpdate().size(), m_pairsOfOthers + kCubes) << "at " << x;
        EXPECT_EQ(listed(), 0u);
    }
    moveCube(m_broadphase, cube, vec(3.2, 0, 0));
    EXPECT_EQ(pairsAfterUpdate().size(), m_pairsOfOthers);
    EXPECT_EQ(m_broadphase.stats().restartsTotal, restarts);
}

TEST_F(PartlyRefusedPairs, EnterAtOnceAndLeaveWhenAGhostWasNearAndHadNeverOverlapped)
{
    btGhostPairCallback callback;
    btCollisionObject object;
    btGhostObject ghost;
    for (btBroadphaseProxy* cube : m_cubes)
        cube->m_clientObject = &object;
    cache().setInternalGhostPairCallback(&callback);
    btBroadphaseProxy* const cube = addNearAll(&ghost);
    const auto pairsNow = [&] { return std::size_t(cache().getNumOverlappingPairs()); };
    moveCube(m_broadphase, cube, vec(2.9, 0, 0));
    EXPECT_EQ(pairsNow(), m_pairsOfOthers + kCubes);
    moveCube(m_broadphase, cube, vec(3.2, 0, 0));
    EXPECT_EQ(pairsAfterUpdate().size(), m_pairsOfOthers) << "the backend has not seen them";
    m_broadphase.destroyProxy(cube, nullptr);
}

TEST_F(PartlyRefusedPairs, AreForgottenWhenBoxesWereNearAndPart)
{
    moveCube(m_broadphase, addNearAll(), vec(3.2, 0, 0));
    EXPECT_EQ(pairsAfterUpdate().size(), m_pairsOfOthers);
    EXPECT_EQ(listed(), 0u);
}

/// Cubes that walk in a cube of 2 m, so that each overlaps a large share of the others, and a filter for their pairs.
class WalkingCrowd
{
public:
    static constexpr std::uint32_t kBodies = 2000;

    /// @param allowedShare the filter allows one pair in so many; 0: none
    explicit WalkingCrowd(std::uint64_t allowedShare) : m_refusal(allowedShare), m_broadphase(options())
    {
        cache().setOverlapFilterCallback(&m_refusal);
        for (std::uint32_t i = 0; i < kBodies; ++i)
        {
            m_places.push_back(draw());
            m_cubes.push_back(addCube(m_broadphase, m_places.back()));
        }
        for (int update = 0; update < 20; ++update)
        {
            m_broadphase.calculateOverlappingPairs(nullptr);
            for (std::uint32_t i = 0; i < kBodies; ++i)
                moveCube(m_broadphase, m_cubes[i], m_places[i] += btScalar(0.02) * draw());
        }
    }
    ~WalkingCrowd() { cache().setOverlapFilterCallback(nullptr); }
    WalkingCrowd(const WalkingCrowd&) = delete;
    WalkingCrowd& operator=(const WalkingCrowd&) = delete;

    PairCache& cache() { return dynamic_cast<PairCache&>(*m_broadphase.getOverlappingPairCache()); }
    std::uint64_t asked() const { return m_refusal.asked; }
    std::string path() const { return m_broadphase.stats().backend.path; }
    /// Of the broad phase and its backend, without the cache.
    std::uint64_t bytes() const
    {
        const BroadphaseStats stats = m_broadphase.stats();
        return stats.bytes + stats.backend.bytes;
    }

private:
    struct Refusal final : btOverlapFilterCallback
    {
        explicit Refusal(std::uint64_t share) : allowedShare(share) {}
        bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
        {
            ++asked;
            return allowedShare != 0 && (uniqueIdOf(a) * 31 + uniqueIdOf(b) * 17) % allowedShare == 0;
        }
        std::uint64_t allowedShare;
        mutable std::uint64_t asked = 0;
    };

    static BroadphaseOptions options()
    {
        BroadphaseOptions options;
        options.backend = BackendChoice::Grid;
        options.threads = 1;
        return options;
    }

    btVector3 draw()
    {
        std::uniform_real_distribution<double> place(-1.0, 1.0);
        const double x = place(m_random);
        const double y = place(m_random);
        return vec(x, y, place(m_random));
    }

    std::mt19937 m_random{1};
    Refusal m_refusal;
    Broadphase m_broadphase;
    std::vector<btVector3> m_places;
    std::vector<btBroadphaseProxy*> m_cubes;
};

/// What DBVT takes for a proxy and its node.
constexpr std::uint64_t kDbvtBytesOfBody = sizeof(btScalar) == 4 ? 216 : 312;

TEST(RefusedPairsOfManyBodies, TakeNoMemoryEach)
{
    WalkingCrowd crowd(0);
    EXPECT_GT(crowd.asked(), 500000u) << "the sample has many refusals";
    EXPECT_LT(crowd.cache().stats().bytes, 64u * 1024);
    // As few bytes as DBVT's proxies and nodes, backend included: nothing for the refused pairs.
    EXPECT_EQ(crowd.path(), "allowed pairs");
    EXPECT_LT(crowd.bytes(), kDbvtBytesOfBody * WalkingCrowd::kBodies);
}

TEST(RefusedPairsOfManyBodies, LeaveFewBytesOutsideOfCacheForEachAllowedPair)
{
    WalkingCrowd crowd(16);
    const auto pairs = static_cast<std::uint64_t>(crowd.cache().getNumOverlappingPairs());
    EXPECT_GT(pairs, 30000u) << "the sample has many allowed pairs";
    EXPECT_EQ(crowd.path(), "allowed pairs");
    // Pairs whose larger boxes overlap are listed too, a seventh more; lists of changes keep what they have needed.
    EXPECT_LT(crowd.bytes(), kDbvtBytesOfBody * WalkingCrowd::kBodies + 8 * pairs);
    // The lists serve for the pairs of a body, too. A quarter more than there are is room to grow.
    EXPECT_FALSE(crowd.cache().isLinked());
    EXPECT_LT(crowd.cache().stats().bytes, 53 * pairs);
}

/// Bodies from -reach to reach on each axis: so many refused pairs that none are listed, or few.
constexpr double kCrowded = 1.5, kLoose = 3.5;

/// The cache has the pairs that the filter accepted when it was last asked, while bodies walk, come and go, and the
/// filter changes its mind.
void expectAnswersOfFilter(const BroadphaseOptions& options, double reach, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-reach, reach);
    std::uniform_real_distribution<double> step(-0.04, 0.04);
    Broadphase broadphase(options);
    RememberingFilter filter;
    unsigned phase = 0, refused = 0, accepted = 0, mostListed = 0;
    filter.rule = [&](Pair pair) { return (pair.first * 31 + pair.second * 17 + phase) % 16 == 0; };
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    std::vector<btBroadphaseProxy*> cubes;
    const auto add = [&]
    {
        const double x = place(random);
        const double y = place(random);
        cubes.push_back(addCube(broadphase, vec(x, y, place(random))));
    };
    for (int i = 0; i < 150; ++i)
        add();
    for (int update = 0; update < 60; ++update)
    {
        phase = static_cast<unsigned>(update / 10);
        for (std::size_t i = 0; i < cubes.size(); ++i)
        {
            const double x = step(random);
            const double y = step(random);
            const btVector3 by = vec(x, y, step(random));
            if (update % 3 != 0 || i % 4 == 0)
                broadphase.setAabb(cubes[i], cubes[i]->m_aabbMin + by, cubes[i]->m_aabbMax + by, nullptr);
        }
        if (update % 7 == 3)
        {
            const std::size_t victim = random() % cubes.size();
            broadphase.destroyProxy(cubes[victim], nullptr);
            cubes.erase(cubes.begin() + static_cast<std::ptrdiff_t>(victim));
            add();
        }
        broadphase.calculateOverlappingPairs(nullptr);
        mostListed = std::max(mostListed, static_cast<unsigned>(broadphase.stats().pendingPairs));
        for (std::size_t i = 0; i < cubes.size(); ++i)
        {
            for (std::size_t j = 0; j < i; ++j)
            {
                const bool isThere =
                    broadphase.getOverlappingPairCache()->findPair(cubes[i], cubes[j]) != nullptr;
                const std::uint64_t key = pairKey(makePair(uniqueIdOf(cubes[i]), uniqueIdOf(cubes[j])));
                // The larger boxes of a crowd reach beyond the boxes by up to twice the margin.
                const btScalar reached = (reach == kCrowded ? 2 : 1) * gDbvtMargin;
                const btVector3 margin(reached, reached, reached);
                if (!TestAabbAgainstAabb2(cubes[i]->m_aabbMin, cubes[i]->m_aabbMax, cubes[j]->m_aabbMin,
                                          cubes[j]->m_aabbMax))
                {
                    // As far apart as that, they are a new pair when they meet again.
                    if (!TestAabbAgainstAabb2(cubes[i]->m_aabbMin - margin, cubes[i]->m_aabbMax + margin,
                                              cubes[j]->m_aabbMin - margin, cubes[j]->m_aabbMax + margin))
                        filter.answers.erase(key);
                    continue;
                }
                ASSERT_TRUE(filter.answers.count(key) != 0) << "seed " << seed << " update " << update;
                ASSERT_EQ(isThere, filter.answers[key]) << "seed " << seed << " update " << update;
                ++(isThere ? accepted : refused);
            }
        }
    }
    EXPECT_GT(refused, 5000u) << "seed " << seed;
    EXPECT_GT(accepted, 500u) << "seed " << seed;
    EXPECT_EQ(mostListed == 0, reach == kCrowded) << "seed " << seed;
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
}

/// What a filter that refuses all but one in 32 pairs is asked, and the box tests, in updates of a walking crowd.
struct CrowdWork
{
    std::uint64_t asked = 0;
    std::uint64_t mostTests = 0;  ///< of an update
    std::string path;
};

template <class AnyBroadphase>
CrowdWork workOfCrowd(AnyBroadphase& broadphase, int bodies, unsigned seed)
{
    CrowdWork work;
    RememberingFilter filter;
    filter.rule = [](Pair pair) { return (pair.first * 31 + pair.second * 17) % 32 == 0; };
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-1.0, 1.0);
    const auto draw = [&]
    {
        const double x = place(random);
        const double y = place(random);
        return vec(x, y, place(random));
    };
    std::vector<btVector3> places;
    std::vector<btBroadphaseProxy*> cubes;
    for (int i = 0; i < bodies; ++i)
    {
        places.push_back(draw());
        cubes.push_back(addCube(broadphase, places.back()));
    }
    // DBVT's boxes become larger, and its tree good, in the first updates.
    constexpr int kFirstUpdates = 20, kUpdates = 60;
    for (int update = 0; update < kUpdates; ++update)
    {
        if (update == kFirstUpdates)
            filter.asked = 0;
        for (std::size_t i = 0; i < cubes.size(); ++i)
            moveCube(broadphase, cubes[i], places[i] += btScalar(0.02) * draw());
        broadphase.calculateOverlappingPairs(nullptr);
        if constexpr (std::is_same_v<AnyBroadphase, Broadphase>)
        {
            const BroadphaseStats stats = broadphase.stats();
            work.path = stats.backend.path;
            if (update >= kFirstUpdates)
                work.mostTests = std::max(work.mostTests, stats.backend.candidates);
        }
    }
    work.asked = static_cast<std::uint64_t>(filter.asked);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
    return work;
}

TEST(RefusedPairsOfManyBodies, AreAskedAboutNoOftenerThanByDbvtAndTestedBySkinsThatAreLeft)
{
    constexpr int kBodies = 400;
    BroadphaseOptions options;
    options.backend = BackendChoice::Grid;
    options.threads = 1;
    Broadphase broadphase(options);
    const CrowdWork own = workOfCrowd(broadphase, kBodies, 1);
    StockBroadphase stock;
    const CrowdWork other = workOfCrowd(stock, kBodies, 1);
    EXPECT_EQ(own.path, "allowed pairs");
    EXPECT_GT(other.asked, 100000u) << "the sample has many questions";
    EXPECT_LE(own.asked, other.asked);
    // One in eight bodies leaves its skin in an update, and is compared with all.
    EXPECT_LT(own.mostTests, std::uint64_t{kBodies} * kBodies / 3);
}

/// Gathers and scatters bodies under a filter that never changes its mind, so that the cache has all overlaps that it
/// allows; bodies come, go and change their words.
void expectExactPairsOfCrowd(const BroadphaseOptions& options, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-1.0, 1.0);
    Broadphase broadphase(options);
    struct Rule final : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
        {
            return (a->m_collisionFilterGroup & b->m_collisionFilterGroup) != 0 &&
                   (uniqueIdOf(a) * 31 + uniqueIdOf(b) * 17) % 8 == 0;
        }
    } rule;
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&rule);
    std::vector<btBroadphaseProxy*> cubes;
    const auto draw = [&](double reach)
    {
        const double x = reach * place(random);
        const double y = reach * place(random);
        return vec(x, y, reach * place(random));
    };
    for (int i = 0; i < 120; ++i)
        cubes.push_back(addCube(broadphase, draw(0.5), 0.5, 1 + i % 3));
    std::uint64_t held = 0;
    int switches = 0;
    std::string last;
    for (int update = 0; update < 120; ++update)
    {
        const bool isGathered = update / 20 % 2 == 0;
        for (std::size_t i = 0; i < cubes.size(); ++i)
        {
            const btVector3 low = cubes[i]->m_aabbMin;
            const btVector3 to = update % 20 == 0 ? draw(isGathered ? 0.5 : 20.0) : low + draw(0.03);
            if (update % 20 == 0 || i % 3 != 0)
                broadphase.setAabb(cubes[i], to, to + vec(1, 1, 1), nullptr);
        }
        btBroadphaseProxy& changed = *cubes[random() % cubes.size()];
        changed.m_collisionFilterGroup = 1 + update % 3;
        broadphase.setAabb(&changed, changed.m_aabbMin, changed.m_aabbMax, nullptr);
        const std::size_t victim = random() % cubes.size();
        broadphase.destroyProxy(cubes[victim], nullptr);
        cubes[victim] = addCube(broadphase, draw(isGathered ? 0.5 : 20.0), 0.5, 1 + update % 3);
        const Pairs pairs = updatedPairs(broadphase);
        held += pairs.size();
        const std::string path = broadphase.stats().backend.path;
        switches += path == "allowed pairs" && last != path ? 1 : 0;
        last = path;
        const auto& cache = dynamic_cast<const PairCache&>(*broadphase.getOverlappingPairCache());
        ASSERT_EQ(cache.isLinked(), path != "allowed pairs") << "seed " << seed << " update " << update;
        ASSERT_TRUE(cache.isConsistent()) << "seed " << seed << " update " << update;
        for (std::size_t i = 0; i < cubes.size(); ++i)
        {
            for (std::size_t j = 0; j < i; ++j)
            {
                const bool mustBeThere =
                    TestAabbAgainstAabb2(cubes[i]->m_aabbMin, cubes[i]->m_aabbMax, cubes[j]->m_aabbMin,
                                         cubes[j]->m_aabbMax) &&
                    rule.needBroadphaseCollision(cubes[std::min(i, j)], cubes[std::max(i, j)]);
                const Pair pair = makePair(idOf(cubes[i]), idOf(cubes[j]));
                ASSERT_TRUE(!mustBeThere || std::binary_search(pairs.begin(), pairs.end(), pair))
                    << "seed " << seed << " update " << update;
            }
        }
    }
    EXPECT_GT(held, 10000u) << "seed " << seed;
    EXPECT_GE(switches, 3) << "seed " << seed;
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
}

TEST(RefusedPairsOfManyBodies, AreNoneOfThosePairsThatFilterAllowsWhileCrowdsGatherAndScatter)
{
    for (const unsigned seed : {1u, 2u})
    {
        BroadphaseOptions grid;
        grid.backend = BackendChoice::Grid;
        grid.grid.flatLimit = 0;
        grid.threads = 2;
        expectExactPairsOfCrowd(bruteOptions(), seed);
        expectExactPairsOfCrowd(grid, seed);
    }
}

TEST(RefusedPairsOfManyBodies, FollowTheLastAnswerOfTheFilter)
{
    for (const unsigned seed : {1u, 2u, 3u})
    {
        BroadphaseOptions grid;
        grid.backend = BackendChoice::Grid;
        grid.grid.flatLimit = 0;
        grid.threads = 2;
        for (const double reach : {kCrowded, kLoose})
        {
            expectAnswersOfFilter(bruteOptions(), reach, seed);
            expectAnswersOfFilter(grid, reach, seed);
        }
    }
}
}  // namespace
}  // namespace cullet::test
