// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What changes between sets of boxes in an executor's memory, against every pair.

#include "broad/host_exec.h"
#include "broad/psap_delta_search.h"
#include "tests/support/delta_oracle.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet::test
{
namespace
{
/// A program with boxes in the memory of a HostExec.
class HostDeltas
{
public:
    explicit HostDeltas(const PsapOptions& options) : m_exec(options), m_search(options) {}

    FoundDeltas operator()(const std::vector<Aabb>& boxes)
    {
        m_boxes = boxes;
        m_search.prepare(m_exec, m_boxes.data(), m_boxes.size());
        m_search.launch(m_exec);
        // Somebody is quick to use that memory for something else.
        m_boxes.assign(m_boxes.size(), cube(0, 1));
        m_repeats += m_search.finish(m_exec) ? 0 : 1;
        const DeltaCounts counts = m_search.counts();
        return {{m_search.kept(), m_search.kept() + counts.kept},
                {m_search.added(), m_search.added() + counts.added},
                {m_search.removed(), m_search.removed() + counts.removed}};
    }
    void forget() { m_search.forget(); }
    int repeats() const { return m_repeats; }

private:
    psap::HostExec m_exec;
    psap::DeltaSearch<psap::HostExec> m_search;
    std::vector<Aabb> m_boxes;
    int m_repeats = 0;
};

PsapOptions literal()
{
    PsapOptions options;
    options.variant = PsapVariant::Literal;
    return options;
}

PsapOptions ordered(PsapOrder order, std::uint32_t capacity = PsapOptions{}.initialCapacity)
{
    PsapOptions options;
    options.order = order;
    options.initialCapacity = capacity;
    return options;
}

TEST(PsapDeltas, EqualThoseOfEveryPairInAnyOrderOfTheSteps)
{
    const auto sets = changingBoxes(600, 11);
    for (const PsapExecutor executor : {PsapExecutor::InOrder, PsapExecutor::Shuffled, PsapExecutor::Threads})
    {
        for (PsapOptions options :
             {literal(), ordered(PsapOrder::Automatic), ordered(PsapOrder::Counting),
              ordered(PsapOrder::Radix), ordered(PsapOrder::Bins), ordered(PsapOrder::Tiles)})
        {
            SCOPED_TRACE(std::to_string(static_cast<int>(executor)) + " " +
                         std::to_string(static_cast<int>(options.variant)) + " " +
                         std::to_string(static_cast<int>(options.order)));
            options.executor = executor;
            options.threads = 3;
            HostDeltas deltas(options);
            expectChanges(sets, [&](const std::vector<Aabb>& boxes) { return deltas(boxes); });
        }
    }
}

TEST(PsapDeltas, ListsThatAreTooShortGrowAndNothingIsLost)
{
    const auto sets = changingBoxes(300, 12);
    for (const PsapOrder order : {PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles})
    {
        SCOPED_TRACE(static_cast<int>(order));
        HostDeltas deltas(ordered(order, 1));
        expectChanges(sets, [&](const std::vector<Aabb>& boxes) { return deltas(boxes); });
        EXPECT_GT(deltas.repeats(), 2);
    }
}

/// The pair of two boxes through one update after the other, none of which looks at them.
float depthAfter(int updates, float way, float depth)
{
    const std::uint32_t motion = bitsOf(way);
    const DeltaCounts counts = {1, 0, 0};
    const IdPair pair = {0, 1};
    for (int update = 0; update < updates; ++update)
    {
        IdPair kept = {}, removed = {};
        std::uint64_t keptCount = 0, removedCount = 0;
        float left = 0;
        psap::HostExec exec{PsapOptions{}};
        exec.forEachParted(1, psap::PartPairs{{&pair, &depth, nullptr, &counts}, nullptr, 2, &motion},
                           psap::DepthList{{&kept, 1, &keptCount}, &left}, {&removed, 1, &removedCount});
        EXPECT_EQ(keptCount, 1u);
        depth = left;
    }
    return depth;
}

TEST(PsapDeltas, WhatIsLeftOfADepthIsNeverMoreThanItIs)
{
    EXPECT_LT(depthAfter(10, 0.01f, 1.0f), 1 - 10 * 0.02);
    EXPECT_GT(depthAfter(10, 0.01f, 1.0f), 1 - 10 * 0.0201);
    // So short a way that one minus twice that is one again.
    const float way = 0x1p-28f;
    ASSERT_EQ(1.0f - 2 * way, 1.0f);
    EXPECT_LT(depthAfter(1000, way, 1.0f), 1 - 1000 * 2.0 * way);
    EXPECT_GT(depthAfter(1000, way, 1.0f), 0.999f);
}

TEST(PsapDeltas, WhatIsForgottenEntersAgain)
{
    const auto sets = changingBoxes(300, 13);
    HostDeltas deltas{PsapOptions{}};
    DeltaOracle oracle;
    for (int set = 0; set < 8; ++set)
    {
        if (set % 3 == 2)
        {
            deltas.forget();
            oracle.forget();
        }
        oracle.expect(sets[set], deltas(sets[set]));
    }
    EXPECT_GT(oracle.added(), 500u);
}
}  // namespace
}  // namespace cullet::test
