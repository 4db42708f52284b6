// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Changes between sets of boxes in an executor's memory, against brute force.

#include "cullet/broad/psap/delta_search.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/support/delta_oracle.h"

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
        m_search.advanceNextPlan(m_exec);
        // The caller reuses the memory immediately.
        m_boxes.assign(m_boxes.size(), cube(0, 1));
        m_repeats += m_search.finish(m_exec) ? 0 : 1;
        ++m_frames[static_cast<int>(m_search.mode())];
        const DeltaCounts counts = m_search.counts();
        return {{m_search.kept(), m_search.kept() + counts.kept},
                {m_search.added(), m_search.added() + counts.added},
                {m_search.removed(), m_search.removed() + counts.removed}};
    }
    void forget() { m_search.forget(); }
    void recover(const PsapOptions& options) { m_search.recover(options); }
    std::uint64_t bytes() const { return m_exec.bytes(); }
    int repeats() const { return m_repeats; }
    psap::NeighbourMode mode() const { return m_search.mode(); }
    int frames(psap::NeighbourMode mode) const { return m_frames[static_cast<int>(mode)]; }

private:
    psap::HostExec m_exec;
    psap::DeltaSearch<psap::HostExec> m_search;
    std::vector<Aabb> m_boxes;
    int m_repeats = 0;
    int m_frames[3] = {};
};

/// Options that use neighbour lists for few boxes, too.
PsapOptions ordered(PsapOrder order, std::uint32_t capacity = PsapOptions{}.initialCapacity)
{
    PsapOptions options;
    options.order = order;
    options.initialCapacity = capacity;
    options.nearPairs = PsapNearPairs::Always;
    return options;
}

PsapOptions keeping(PsapNearPairs nearPairs)
{
    PsapOptions options = ordered(PsapOrder::Counting);
    options.nearPairs = nearPairs;
    return options;
}

TEST(PsapDeltas, EqualBruteForceWithEveryExecutorAndOrder)
{
    const auto sets = changingBoxes(600, 11);
    for (const PsapExecutor executor : {PsapExecutor::InOrder, PsapExecutor::Shuffled, PsapExecutor::Threads})
    {
        for (PsapOptions options : {ordered(PsapOrder::Automatic), ordered(PsapOrder::Counting),
                                    ordered(PsapOrder::Bins), ordered(PsapOrder::Tiles)})
        {
            SCOPED_TRACE(std::to_string(static_cast<int>(executor)) + " " +
                         std::to_string(static_cast<int>(options.order)));
            options.executor = executor;
            options.threads = 3;
            HostDeltas deltas(options);
            expectChanges(sets, [&](const std::vector<Aabb>& boxes) { return deltas(boxes); });
        }
    }
}

TEST(PsapDeltas, LoseNoPairWhenListsAreTooShortAndGrow)
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

TEST(PsapDeltas, ReportMissingPairsWhenNeighbourListIsTooShort)
{
    // Later steps on the device read these counts before any repetition.
    psap::HostExec exec{PsapOptions{}};
    psap::DeltaSearch<psap::HostExec> search(ordered(PsapOrder::Counting, 1));
    int begun = 0;
    int tooShort = 0;
    for (const std::vector<Aabb>& boxes : changingBoxes(300, 13))
    {
        search.prepare(exec, boxes.data(), boxes.size());
        search.launch(exec);
        exec.wait();
        const DeltaCounts before = *search.deviceCounts();
        const std::uint64_t room = search.addedRoom();
        const bool isBegun = search.mode() == psap::NeighbourMode::Begin;
        search.advanceNextPlan(exec);
        const bool wasComplete = search.finish(exec);
        begun += isBegun ? 1 : 0;
        tooShort += isBegun && !wasComplete ? 1 : 0;
        EXPECT_EQ(before.added > room, !wasComplete);
    }
    EXPECT_GT(begun, 3);
    EXPECT_GT(tooShort, 0);
}

/// Boxes with constant velocities; at times one teleports, is empty for a while, grows, becomes invalid, or goes to
/// infinity.
std::vector<std::vector<Aabb>> steadyBoxes(std::uint32_t count, float fastest, std::uint32_t seed)
{
    std::vector<Aabb> boxes = BoxScene(SceneKind::Uniform, count, seed).boxes();
    Random random(seed);
    std::vector<float> ways(3 * count);
    for (float& way : ways)
        way = random.between(-fastest, fastest);
    std::vector<std::vector<Aabb>> sets;
    for (int set = 0; set < 70; ++set)
    {
        for (std::uint32_t body = 0; body < count; ++body)
            for (int axis = 0; axis < 3; ++axis)
            {
                boxes[body].min[axis] += ways[3 * body + axis];
                boxes[body].max[axis] += ways[3 * body + axis];
            }
        if (set == 23)
            boxes[5] = boxes[6];
        if (set == 30)
            std::swap(boxes[7].min[1], boxes[7].max[1]);
        if (set == 34)
            boxes[7] = boxes[8];
        if (set == 41)
            boxes[9].max[2] += 3;
        if (set == 47)
            boxes[10].min[0] = kNan;
        if (set == 50)
        {
            boxes[11].min[0] = boxes[11].max[0] = kInfinity;
            boxes[12].min[1] = boxes[12].max[1] = -kInfinity;
            boxes[13] = cube(-kInfinity, kInfinity);
        }
        sets.push_back(boxes);
    }
    return sets;
}

TEST(PsapDeltas, NeedFewSearchesWhenBoxesMoveShortDistances)
{
    for (const PsapOrder order : {PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles})
    {
        for (const std::uint32_t capacity : {1u, 1024u})
        {
            SCOPED_TRACE(std::to_string(static_cast<int>(order)) + " " + std::to_string(capacity));
            HostDeltas deltas(ordered(order, capacity));
            DeltaOracle oracle;
            for (const std::vector<Aabb>& boxes : steadyBoxes(800, 0.05f, 14))
                oracle.expect(boxes, deltas(boxes));
            EXPECT_GT(oracle.added(), 1000u);
            EXPECT_GT(oracle.removed(), 500u);
            EXPECT_GT(deltas.frames(psap::NeighbourMode::Begin), 8);
            EXPECT_GT(deltas.frames(psap::NeighbourMode::Follow), 30);
            EXPECT_GE(deltas.repeats(), 5);  // one for each box that changed its velocity
        }
    }
}

TEST(PsapDeltas, CountTheMemoryThatTheyHold)
{
    const PsapOptions options = ordered(PsapOrder::Tiles, 1);
    HostDeltas deltas(options);
    const auto sets = steadyBoxes(800, 0.05f, 14);
    std::uint64_t first = 0;
    for (int run = 0; run < 3; ++run)
    {
        for (int set = 0; set < 12; ++set)
            deltas(sets[set]);
        first = run == 0 ? deltas.bytes() : first;
        EXPECT_EQ(deltas.bytes(), first) << run;
        deltas.recover(options);
        // Search memory is reallocated; boxes and lists are kept.
        EXPECT_LT(deltas.bytes(), first);
        EXPECT_GT(deltas.bytes(), 100000u);
    }
}

TEST(PsapDeltas, FallBackToSearchWhenBoxesMoveFar)
{
    HostDeltas always(keeping(PsapNearPairs::Always)), automatic(keeping(PsapNearPairs::Automatic)),
        never(keeping(PsapNearPairs::Never));
    DeltaOracle ofAlways, ofAutomatic, ofNever;
    for (const std::vector<Aabb>& boxes : steadyBoxes(800, 1.5f, 15))
    {
        ofAlways.expect(boxes, always(boxes));
        ofAutomatic.expect(boxes, automatic(boxes));
        ofNever.expect(boxes, never(boxes));
    }
    EXPECT_GT(ofNever.added(), 2000u);
    EXPECT_EQ(automatic.frames(psap::NeighbourMode::Search), 70);
    EXPECT_EQ(never.frames(psap::NeighbourMode::Search), 70);
    // Each list becomes invalid at once.
    EXPECT_GT(always.frames(psap::NeighbourMode::Begin), 50);
    EXPECT_GT(always.repeats(), 50);
}

/// Depth of a pair of boxes over several updates that do not test it.
float depthAfter(int updates, float way, float depth)
{
    const std::uint32_t motion = bitsOf(way);
    const DeltaCounts counts = {1, 0, 0};
    const RowPair pair = {0, 1};
    for (int update = 0; update < updates; ++update)
    {
        RowPair kept = {}, removed = {};
        std::uint64_t keptCount = 0, removedCount = 0;
        float left = 0;
        psap::HostExec exec{PsapOptions{}};
        exec.forEachPartition(1, psap::PartitionPairs{{&pair, &depth, nullptr, &counts}, nullptr, 2, &motion},
                              psap::DepthList{{&kept, 1, &keptCount}, &left},
                              psap::PairList{&removed, 1, &removedCount});
        EXPECT_EQ(keptCount, 1u);
        depth = left;
    }
    return depth;
}

TEST(PsapDeltas, NeverOverestimateDepthLeftAfterMotion)
{
    EXPECT_LT(depthAfter(10, 0.01f, 1.0f), 1 - 10 * 0.02);
    EXPECT_GT(depthAfter(10, 0.01f, 1.0f), 1 - 10 * 0.0201);
    // So short that 1 - 2 * way rounds to 1.
    const float way = 0x1p-28f;
    ASSERT_EQ(1.0f - 2 * way, 1.0f);
    EXPECT_LT(depthAfter(1000, way, 1.0f), 1 - 1000 * 2.0 * way);
    EXPECT_GT(depthAfter(1000, way, 1.0f), 0.999f);
}

// A list that begins after a search is made with another plan, since the boxes then have skins.
TEST(PsapDeltas, RepeatLaunchesOnlyOfSearchesInTheirUsualOrder)
{
    using psap::NeighbourMode;
    psap::HostExec exec{PsapOptions{}};
    psap::DeltaSearch<psap::HostExec> search(ordered(PsapOrder::Counting));
    NeighbourMode previous = search.mode();
    int usual[3] = {}, unusual[3] = {};
    bool hasPlan = false;  // the first search makes it
    for (const std::vector<Aabb>& boxes : steadyBoxes(800, 0.05f, 14))
    {
        search.prepare(exec, boxes.data(), boxes.size());
        const NeighbourMode mode = search.mode();
        const bool isRepeatable = search.isRepeatable(exec);
        const bool isUsual = mode == NeighbourMode::Follow ||
                             (previous == NeighbourMode::Follow) == (mode == NeighbourMode::Begin);
        EXPECT_EQ(isRepeatable, isUsual && hasPlan) << static_cast<int>(previous) << static_cast<int>(mode);
        hasPlan = true;
        ++(isUsual ? usual : unusual)[static_cast<int>(mode)];
        search.launch(exec);
        search.advanceNextPlan(exec);
        search.finish(exec);
        previous = search.mode();
    }
    EXPECT_GT(usual[static_cast<int>(NeighbourMode::Search)], 0);
    EXPECT_GT(usual[static_cast<int>(NeighbourMode::Begin)], 5);
    EXPECT_GT(unusual[static_cast<int>(NeighbourMode::Begin)], 0);
}

TEST(PsapDeltas, BehaveLikeNewOnesAfterRecovery)
{
    const PsapOptions options = ordered(PsapOrder::Counting);
    const auto sets = steadyBoxes(800, 0.05f, 14);
    HostDeltas fresh(options), recovered(options);
    for (int set = 0; set < 12; ++set)
        recovered(sets[set]);
    ASSERT_NE(recovered.frames(psap::NeighbourMode::Follow), 0);
    recovered.recover(options);
    DeltaOracle oracle;
    for (int set = 20; set < 40; ++set)
    {
        fresh(sets[set]);
        oracle.expect(sets[set], recovered(sets[set]));
        EXPECT_EQ(recovered.mode(), fresh.mode()) << set;
    }
    EXPECT_GT(oracle.added(), 500u);
}

TEST(PsapDeltas, AddAllPairsAgainAfterForget)
{
    const auto sets = changingBoxes(300, 13);
    HostDeltas deltas(ordered(PsapOrder::Automatic));
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
