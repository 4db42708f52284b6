// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What the order of creation changes: the ids, and with them the order of pairs. Not the set of pairs, and not the contacts of
// two bodies that keep their order.
#include "cullet/tests/determinism/box_history.h"
#include "cullet/tests/determinism/hash_ledger.h"
#include "cullet/tests/determinism/matrix_backends.h"
#include "cullet/tests/support/number_hash.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace cullet::test
{
namespace
{
/// Backwards, and in random orders.
std::vector<std::vector<std::size_t>> ordersOf(std::size_t count)
{
    std::vector<std::vector<std::size_t>> orders(4, std::vector<std::size_t>(count));
    Random random(20261126);
    for (auto& order : orders)
    {
        std::iota(order.rbegin(), order.rend(), std::size_t{0});
        for (std::size_t i = count; &order != &orders[0] && i > 1; --i)
            std::swap(order[i - 1], order[random.below(static_cast<std::uint32_t>(i))]);
    }
    return orders;
}

TEST(DeterminismOfBoxes, GivesSameChangesWhateverRowsTheIdsAreIn)
{
    const auto orders = ordersOf(kHistoryBoxes);
    for (const SceneKind kind : kBoxScenes)
    {
        SCOPED_TRACE(sceneName(kind));
        const auto expected = boxHistory(*makeBruteForceBackend(), kind);
        for (const MatrixBackend& backend : matrixBackends())
        {
            for (std::size_t order = 0; order < orders.size(); ++order)
            {
                const auto hashes = boxHistory(*backend.make(2), kind, orders[order]);
                for (std::size_t step = 0; step < expected.size(); ++step)
                    HashLedger::instance().expectSame(
                        "boxes: rows", expected[step], hashes[step],
                        backend.name + ", order " + std::to_string(order) + ", step " + std::to_string(step));
                ASSERT_FALSE(HasFailure());
            }
        }
    }
}

using BodyPair = std::pair<int, int>;

std::set<BodyPair> pairsByNumber(HistoryWorld& world)
{
    std::set<BodyPair> pairs;
    const btBroadphasePairArray& array = world.world().getPairCache()->getOverlappingPairArray();
    for (int i = 0; i < array.size(); ++i)
    {
        const auto number = [](const btBroadphaseProxy* proxy)
        { return static_cast<const btCollisionObject*>(proxy->m_clientObject)->getUserIndex(); };
        pairs.insert(std::minmax(number(array[i].m_pProxy0), number(array[i].m_pProxy1)));
    }
    return pairs;
}

std::uint64_t hashOf(const std::set<BodyPair>& pairs)
{
    NumberHash hash;
    for (const auto& [a, b] : pairs)
    {
        hash.add(a);
        hash.add(b);
    }
    return hash.value();
}

/// Hash of the points of each manifold, by its first and second body.
std::map<BodyPair, std::uint64_t> contactsByNumber(HistoryWorld& world)
{
    std::map<BodyPair, std::uint64_t> contacts;
    btDispatcher& dispatcher = *world.world().getDispatcher();
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
    {
        const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
        NumberHash hash;
        for (int k = 0; k < manifold.getNumContacts(); ++k)
        {
            hash.add(manifold.getContactPoint(k).getDistance());
            hash.addVector(manifold.getContactPoint(k).getPositionWorldOnB());
            hash.addVector(manifold.getContactPoint(k).m_normalWorldOnB);
        }
        const BodyPair pair(manifold.getBody0()->getUserIndex(), manifold.getBody1()->getUserIndex());
        contacts[pair] = hash.value();
    }
    return contacts;
}

class DeterminismOfOrders : public testing::TestWithParam<Narrow>
{
};

TEST_P(DeterminismOfOrders, GivesSamePairsAndContactsOfBodiesThatKeepTheirOrder)
{
    HistoryOptions options;
    options.scene = HistoryScene::Drift;
    options.narrow = GetParam();
    HistoryWorld numbered(options);
    const auto orders = ordersOf(numbered.bodies().size());
    std::vector<std::unique_ptr<HistoryWorld>> others;
    for (const auto& order : orders)
    {
        options.order = order;
        others.push_back(std::make_unique<HistoryWorld>(options));
    }
    HashLedger& ledger = HashLedger::instance();
    std::size_t kept = 0, swapped = 0;
    for (int step = 0; step < stepsOf(HistoryScene::Drift); ++step)
    {
        numbered.step();
        const auto pairs = hashOf(pairsByNumber(numbered));
        const auto contacts = contactsByNumber(numbered);
        for (std::size_t order = 0; order < others.size(); ++order)
        {
            const std::string how = "order " + std::to_string(order) + ", step " + std::to_string(step);
            others[order]->step();
            ledger.expectSame("orders of creation: pairs", pairs, hashOf(pairsByNumber(*others[order])), how);
            for (const auto& [bodies, hash] : contactsByNumber(*others[order]))
            {
                const auto same = contacts.find(bodies);
                swapped += same == contacts.end();
                if (same == contacts.end())
                    continue;
                ++kept;
                ledger.expectSame("orders of creation: contacts", same->second, hash,
                                  how + ", bodies " + std::to_string(bodies.first) + " and " +
                                      std::to_string(bodies.second));
            }
            ASSERT_FALSE(HasFailure());
        }
    }
    EXPECT_GT(kept, 5000u);
    EXPECT_GT(swapped, 5000u);
}

INSTANTIATE_TEST_SUITE_P(NarrowPhases, DeterminismOfOrders,
                         testing::Values(Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher),
                         testing::PrintToStringParamName());
}  // namespace
}  // namespace cullet::test
