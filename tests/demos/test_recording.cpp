// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/recording/replay.h"
#include "cullet/demos/scenes/bodies/world_scene.h"
#include "cullet/plugin/recording_broadphase.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>

namespace cullet
{
namespace
{
std::string temporaryFile(const std::string& name)
{
    return testing::TempDir() + "cullet_recording_" + std::to_string(sizeof(btScalar)) + name + ".cbx";
}

btVector3 vec(double x, double y, double z)
{
    return btVector3(btScalar(x), btScalar(y), btScalar(z));
}

/// All events of a recording.
std::vector<BoxEvent> readEvents(const std::string& path)
{
    std::string why;
    const auto reader = BoxStreamReader::open(path, why);
    EXPECT_TRUE(reader) << why;
    std::vector<BoxEvent> events;
    BoxEvent event;
    while (reader && reader->next(event) == BoxStreamReader::Next::Event)
        events.push_back(event);
    EXPECT_TRUE(!reader || reader->error().empty()) << reader->error();
    return events;
}

TEST(RecordingBroadphase, RecordsEveryCallInItsOrder)
{
    const std::string path = temporaryFile("calls");
    btDbvtBroadphase inner;
    RecordingBroadphase broadphase(inner, path);
    btBroadphaseProxy* a = broadphase.createProxy(vec(0, 0, 0), vec(1, 1, 1), 0, nullptr, 1, -1, nullptr);
    btBroadphaseProxy* b = broadphase.createProxy(vec(2, 0, 0), vec(3, 1, 1), 0, nullptr, 2, 3, nullptr);
    broadphase.setAabb(b, vec(0.1, 0.25, 0), vec(3, 1, 1), nullptr);
    b->m_collisionFilterGroup = 4;
    b->m_collisionFilterMask = 5;
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(broadphase.getOverlappingPairCache()->getNumOverlappingPairs(), 1);
    broadphase.getOverlappingPairCache()->removeOverlappingPair(a, b, nullptr);
    broadphase.destroyProxy(a, nullptr);
    a = broadphase.createProxy(vec(5, 5, 5), vec(6, 6, 6), 0, nullptr, 1, -1, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(broadphase.frames(), 2u);
    ASSERT_TRUE(broadphase.finish()) << broadphase.error();
    broadphase.destroyProxy(a, nullptr);
    broadphase.destroyProxy(b, nullptr);

    const std::vector<BoxEvent> events = readEvents(path);
    using Kind = BoxEvent::Kind;
    const std::vector<std::pair<Kind, std::uint32_t>> expected = {
        {Kind::Create, 0}, {Kind::Create, 1},  {Kind::Set, 1},    {Kind::Filter, 1},
        {Kind::Frame, 0},  {Kind::Destroy, 0}, {Kind::Create, 0}, {Kind::Frame, 0}};
    ASSERT_EQ(events.size(), expected.size());
    for (std::size_t i = 0; i < events.size(); ++i)
    {
        EXPECT_EQ(events[i].kind, expected[i].first) << i;
        EXPECT_EQ(events[i].id, expected[i].second) << i;
    }
    EXPECT_EQ(events[1].group, 2);
    EXPECT_EQ(events[1].mask, 3);
    EXPECT_EQ(events[2].box.min[0], double(btScalar(0.1))) << "bit by bit";
    EXPECT_EQ(events[3].group, 4);
    EXPECT_EQ(events[3].mask, 5);
    std::remove(path.c_str());
}

TEST(RecordingBroadphase, RecordsNoProxyThatTheBroadphaseInsideDoesNotCreate)
{
    struct Full final : btDbvtBroadphase
    {
        btBroadphaseProxy* createProxy(const btVector3&, const btVector3&, int, void*, int, int,
                                       btDispatcher*) override
        {
            return nullptr;
        }
    } inner;
    const std::string path = temporaryFile("full");
    RecordingBroadphase broadphase(inner, path);
    EXPECT_EQ(broadphase.createProxy(vec(0, 0, 0), vec(1, 1, 1), 0, nullptr, 1, -1, nullptr), nullptr);
    ASSERT_TRUE(broadphase.finish()) << broadphase.error();
    EXPECT_TRUE(readEvents(path).empty());
    std::remove(path.c_str());
}

TEST(RecordingBroadphase, LeavesTheWorldAsItIsAndReplaysToTheSamePairs)
{
    const std::string path = temporaryFile("world");
    WorldSceneOptions options;
    options.bodies = 60;
    options.backend = "grid";
    options.threads = 1;
    const auto plain = makeWorldScene("boxes", options);
    NamedBroadphase inner = makeNamedBroadphase(requestForScene("boxes", options));
    auto owned = std::make_unique<RecordingBroadphase>(*inner.broadphase, path);
    RecordingBroadphase& recorder = *owned;
    const auto recorded = makeWorldScene(
        "boxes", options, {inner.name, std::move(owned), inner.cullet, inner.margin, inner.threads});
    for (int step = 0; step < 60; ++step)
    {
        plain->step();
        recorded->step();
    }
    EXPECT_EQ(recorded->stateHash(), plain->stateHash());
    ASSERT_GT(recorded->contactPairCount(), 40u) << "nothing has landed: the recording shows nothing";
    const std::uint64_t held = recorded->pairCount();
    ASSERT_TRUE(recorder.finish()) << recorder.error();

    RecordingFile file(path);
    const RecordingSummary summary = file.summarise();
    EXPECT_EQ(summary.info.frames, 60u);
    EXPECT_EQ(summary.mostBoxes, 65u);
    EXPECT_LT(summary.bounds.min[1], -1.9) << "the ground";
    const auto players = makePlayers({"grid", "exact", "dbvt", "sap", "axissweep"}, 1, summary);
    ResultFile results({}, "", "");
    const ReplayResult result = runVerify({path, {}, 1, 0, true}, file, players, results);
    EXPECT_EQ(result.difference, "");
    EXPECT_EQ(result.frames, 60u);
    EXPECT_EQ(players[0]->heldPairs(), held) << "margins included";
    ASSERT_EQ(results.rows().size(), 5u);
    EXPECT_GT(results.rows()[0]["pairs"], 60 * 60);
    EXPECT_EQ(results.rows()[0]["hash"], results.rows()[4]["hash"]);
    std::remove(path.c_str());
}

/// A player that omits one pair in one frame.
class Forgetful : public Player
{
public:
    explicit Forgetful(std::unique_ptr<Player> player) : m_player(std::move(player)) {}
    const std::string& name() const override { return m_name; }
    int threads() const override { return 1; }
    void apply(const std::vector<BoxEvent>& events) override { m_player->apply(events); }
    void findPairs() override { m_player->findPairs(); }
    Pairs pairs(const RecordedBoxes& boxes) override
    {
        Pairs pairs = m_player->pairs(boxes);
        if (m_frame++ == 2)
            pairs.erase(pairs.begin() + 1);
        return pairs;
    }
    std::uint64_t heldPairs() override { return m_player->heldPairs(); }

private:
    std::string m_name = "forgetful";
    std::unique_ptr<Player> m_player;
    int m_frame = 0;
};

/// Records three boxes in a row that all touch in frame 2 and later.
std::string writeThreeBoxes()
{
    const std::string path = temporaryFile("three");
    BoxStreamWriter writer(path, StreamPrecision::Float);
    for (std::uint32_t id = 0; id < 3; ++id)
        writer.create(id, {{2.0 * id, 0, 0}, {2.0 * id + 1, 1, 1}}, 1, -1);
    for (int frame = 0; frame < 4; ++frame)
    {
        if (frame == 2)
            for (std::uint32_t id = 0; id < 3; ++id)
                writer.set(id, {{0.5 * id, 0, 0}, {0.5 * id + 1, 1, 1}});
        writer.frame();
    }
    EXPECT_TRUE(writer.finish());
    return path;
}

TEST(Verification, NamesFramePairAndBoxesOfTheFirstDifference)
{
    const std::string path = writeThreeBoxes();
    RecordingFile file(path);
    const RecordingSummary summary = file.summarise();
    std::vector<std::unique_ptr<Player>> players = makePlayers({"exact", "grid", "grid"}, 1, summary);
    players.back() = std::make_unique<Forgetful>(std::move(players.back()));
    ResultFile results({}, "", "");
    const ReplayResult result = runVerify({path, {}, 1, 0, true}, file, players, results);
    EXPECT_EQ(result.frames, 3u) << "stops there";
    EXPECT_EQ(result.difference,
              "frame 2: pair (0, 2) is found by 'exact' and not by 'forgetful'\n"
              "  box 0: (0, 0, 0) to (1, 1, 1), group 1, mask -1\n"
              "  box 2: (1, 0, 0) to (2, 1, 1), group 1, mask -1");
    std::remove(path.c_str());
}

TEST(Verification, IgnoresNanBoxAndRefusesInvertedOneForDbvt)
{
    const std::string path = temporaryFile("nan");
    BoxStreamWriter writer(path, StreamPrecision::Double);
    writer.create(0, {{0, 0, 0}, {1, 1, 1}}, 1, -1);
    writer.create(1, {{0, 0, 0}, {1, std::numeric_limits<double>::quiet_NaN(), 1}}, 1, -1);
    writer.create(2, {{0, 0, 0}, {1, 1, 1}}, 1, -1);
    writer.frame();
    ASSERT_TRUE(writer.finish());
    RecordingFile file(path);
    const RecordingSummary summary = file.summarise();
    EXPECT_EQ(summary.isRounded, sizeof(btScalar) == 4);
    ResultFile results({}, "", "");
    EXPECT_EQ(runVerify({path, {}, 1, 0, true}, file, makePlayers({"exact", "grid"}, 1, summary), results)
                  .difference,
              "");
    EXPECT_EQ(results.rows()[0]["pairs"], 1);
    try
    {
        makePlayer("dbvt", 1, summary)->apply({{BoxEvent::Kind::Create, 1, 1, -1, {{1, 0, 0}, {0, 0, 0}}}});
        FAIL() << "no exception";
    }
    catch (const ProgramError& error)
    {
        EXPECT_EQ(error.code(), kExitInput);
        EXPECT_NE(std::string(error.what()).find("box 1"), std::string::npos);
    }
    std::remove(path.c_str());
}

TEST(Replay, GivesOneHashAndThreeRowsPerBackend)
{
    const std::string path = writeThreeBoxes();
    ResultFile results({}, "", "");
    const ReplayResult result = runReplay({path, {"grid", "dbvt", "brute"}, 1, 0, true}, results);
    EXPECT_EQ(result.difference, "");
    EXPECT_EQ(result.frames, 4u);
    ASSERT_EQ(results.rows().size(), 9u);
    for (const Json& row : results.rows())
    {
        EXPECT_EQ(row["hash"], results.rows()[0]["hash"]);
        EXPECT_EQ(row["pairs"], 3);
        EXPECT_EQ(row["bodies"], 3);
        EXPECT_EQ(row["frames"], 4);
    }
    EXPECT_EQ(runReplay({path, {"grid"}, 1, 2, true}, results).frames, 2u);
    EXPECT_EQ(results.rows().back()["pairs"], 0) << "they touch in frame 2 only";
    std::remove(path.c_str());
}

TEST(RecordingBroadphase, PassesEveryQuestionOnToTheBroadphaseInside)
{
    struct Inner final : btDbvtBroadphase
    {
        void printStats() override { ++printCount; }
        void resetPool(btDispatcher*) override { ++resetCount; }
        int printCount = 0, resetCount = 0;
    } inner;
    const std::string path = temporaryFile("questions");
    RecordingBroadphase broadphase(inner, path);
    btBroadphaseProxy* proxy = broadphase.createProxy(vec(1, 2, 3), vec(2, 3, 4), 0, nullptr, 1, -1, nullptr);
    broadphase.printStats();
    EXPECT_EQ(inner.printCount, 1);
    broadphase.resetPool(nullptr);
    EXPECT_EQ(inner.resetCount, 1);
    btVector3 min, max;
    broadphase.getAabb(proxy, min, max);
    EXPECT_EQ(min, vec(1, 2, 3));
    EXPECT_EQ(max, vec(2, 3, 4));
    struct Hits final : btBroadphaseRayCallback
    {
        bool process(const btBroadphaseProxy*) override
        {
            ++count;
            return true;
        }
        int count = 0;
    } hits;
    broadphase.aabbTest(vec(0, 0, 0), vec(9, 9, 9), hits);
    EXPECT_EQ(hits.count, 1);
    broadphase.destroyProxy(proxy, nullptr);
    ASSERT_TRUE(broadphase.finish()) << broadphase.error();
    std::remove(path.c_str());
}
}  // namespace
}  // namespace cullet
