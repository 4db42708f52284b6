// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/recording/box_stream.h"
#include "cullet/recording/box_stream_format.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <random>
#include <sstream>

namespace cullet
{
namespace
{
using box_stream::Bytes;

std::string temporaryFile(const std::string& name)
{
    return testing::TempDir() + "cullet_box_stream_" + name + ".cbx";
}

Bytes readBytes(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    return Bytes(std::istreambuf_iterator<char>(file), {});
}

void writeBytes(const std::string& path, const Bytes& bytes)
{
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

bool isSame(const BoxEvent& a, const BoxEvent& b)
{
    if (a.kind != b.kind || a.id != b.id || a.group != b.group || a.mask != b.mask)
        return false;
    for (int axis = 0; axis < 3; ++axis)
    {
        // NaNs compare as equal here.
        const auto differ = [](double x, double y) { return x != y && (x == x || y == y); };
        if (differ(a.box.min[axis], b.box.min[axis]) || differ(a.box.max[axis], b.box.max[axis]))
            return false;
    }
    return true;
}

/// Reads to the end or to an error, and returns the error.
std::string readAll(BoxStreamReader* reader, std::vector<BoxEvent>* events = nullptr)
{
    BoxEvent event;
    while (reader->next(event) == BoxStreamReader::Next::Event)
    {
        if (events != nullptr)
            events->push_back(event);
    }
    return reader->error();
}

std::string readAll(const std::string& path, std::vector<BoxEvent>* events = nullptr)
{
    std::string why;
    const auto reader = BoxStreamReader::open(path, why);
    return reader ? readAll(reader.get(), events) : why;
}

/// Opens from memory, since thousands of files would take long.
std::unique_ptr<BoxStreamReader> openMemory(const Bytes& bytes, std::string& why,
                                            const BoxStreamLimits& limits = {})
{
    return BoxStreamReader::open(
        std::make_unique<std::istringstream>(std::string(bytes.begin(), bytes.end())), "memory", why, limits);
}

std::string readAll(const Bytes& bytes, const BoxStreamLimits& limits = {})
{
    std::string why;
    const auto reader = openMemory(bytes, why, limits);
    return reader ? readAll(reader.get()) : why;
}

StreamBox randomBox(std::mt19937& random, StreamPrecision precision)
{
    std::uniform_real_distribution<double> coordinate(-1e3, 1e3);
    StreamBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = coordinate(random);
        box.max[axis] = coordinate(random);
        if (precision == StreamPrecision::Float)
        {
            box.min[axis] = static_cast<float>(box.min[axis]);
            box.max[axis] = static_cast<float>(box.max[axis]);
        }
    }
    return box;
}

/// Writes random valid events through the interface; returns the events that a reader must return.
std::vector<BoxEvent> writeRandom(const std::string& path, StreamPrecision precision, int count,
                                  unsigned seed)
{
    std::mt19937 random(seed);
    BoxStreamWriter writer(path, precision);
    std::vector<BoxEvent> events;
    std::vector<StreamBox> boxes;
    std::vector<std::uint32_t> freeIds;
    std::vector<std::uint32_t> live;
    while (static_cast<int>(events.size()) < count)
    {
        BoxEvent event;
        const unsigned dice = random() % 20;
        if (dice < 5 || live.empty())
        {
            event.kind = BoxEvent::Kind::Create;
            event.id = static_cast<std::uint32_t>(boxes.size());
            if (!freeIds.empty())
            {
                event.id = freeIds.back();
                freeIds.pop_back();
            }
            else
                boxes.emplace_back();
            event.group = static_cast<std::int32_t>(random());
            event.mask = -1;
            event.box = boxes[event.id] = randomBox(random, precision);
            live.push_back(event.id);
            writer.create(event.id, event.box, event.group, event.mask);
        }
        else if (dice < 7)
        {
            const std::size_t at = random() % live.size();
            event.kind = BoxEvent::Kind::Destroy;
            event.id = live[at];
            live.erase(live.begin() + static_cast<std::ptrdiff_t>(at));
            freeIds.push_back(event.id);
            writer.destroy(event.id);
        }
        else if (dice < 17)
        {
            event.kind = BoxEvent::Kind::Set;
            event.id = live[random() % live.size()];
            if (dice < 13)
                boxes[event.id] = randomBox(random, precision);
            if (dice == 12)
                boxes[event.id].min[1] = std::numeric_limits<double>::quiet_NaN();
            event.box = boxes[event.id];
            writer.set(event.id, event.box);
        }
        else if (dice == 17)
        {
            event.kind = BoxEvent::Kind::Filter;
            event.id = live[random() % live.size()];
            event.group = 2;
            event.mask = static_cast<std::int32_t>(random());
            writer.filter(event.id, event.group, event.mask);
        }
        else
            writer.frame();
        events.push_back(event);
    }
    EXPECT_TRUE(writer.finish()) << writer.error();
    return events;
}

TEST(BoxStream, GivesBackEveryEventOverManyBlocks)
{
    for (const StreamPrecision precision : {StreamPrecision::Float, StreamPrecision::Double})
    {
        const std::string path = temporaryFile("random");
        const std::vector<BoxEvent> written = writeRandom(path, precision, 100000, 7);
        std::vector<BoxEvent> read;
        EXPECT_EQ(readAll(path, &read), "");
        ASSERT_EQ(read.size(), written.size());
        int kinds[6] = {};
        for (std::size_t i = 0; i < read.size(); ++i)
        {
            ASSERT_TRUE(isSame(read[i], written[i])) << "event " << i;
            ++kinds[static_cast<int>(read[i].kind)];
        }
        for (int kind = 1; kind < 6; ++kind)
            EXPECT_GT(kinds[kind], 1000) << kind;
        EXPECT_GT(readBytes(path).size(), box_stream::kMaxBlock) << "one block shows nothing";
        std::remove(path.c_str());
    }
}

TEST(BoxStream, CountsFramesAndIds)
{
    const std::string path = temporaryFile("counts");
    BoxStreamWriter writer(path, StreamPrecision::Float);
    const StreamBox box = {{0, 0, 0}, {1, 1, 1}};
    writer.create(0, box, 1, -1);
    writer.frame();
    writer.create(1, box, 1, -1);
    writer.set(0, box);
    writer.frame();
    writer.destroy(0);
    ASSERT_TRUE(writer.finish());
    writer.frame();
    std::string why;
    const auto reader = BoxStreamReader::open(path, why);
    ASSERT_TRUE(reader) << why;
    EXPECT_EQ(reader->info().frames, 2u);
    EXPECT_EQ(reader->info().events, 6u);
    EXPECT_EQ(reader->info().ids, 2u);
    std::vector<BoxEvent> events;
    EXPECT_EQ(reader->nextFrame(events), BoxStreamReader::Next::Event);
    EXPECT_EQ(events.size(), 1u);
    EXPECT_EQ(reader->nextFrame(events), BoxStreamReader::Next::Event);
    EXPECT_EQ(events.size(), 2u);
    EXPECT_EQ(reader->nextFrame(events), BoxStreamReader::Next::End);
    EXPECT_EQ(events.size(), 1u) << "what comes after the last frame";
    std::remove(path.c_str());
}

TEST(BoxStream, PacksBoxesThatDoNotMoveToNextToNothing)
{
    const std::string path = temporaryFile("still");
    BoxStreamWriter writer(path, StreamPrecision::Double);
    std::mt19937 random(3);
    std::vector<StreamBox> boxes;
    for (std::uint32_t id = 0; id < 1000; ++id)
    {
        boxes.push_back(randomBox(random, StreamPrecision::Double));
        writer.create(id, boxes.back(), 1, -1);
    }
    for (int frame = 0; frame < 100; ++frame)
    {
        for (std::uint32_t id = 0; id < 1000; ++id)
            writer.set(id, boxes[id]);
        writer.frame();
    }
    ASSERT_TRUE(writer.finish());
    // 61,000 bytes of random boxes, and 100,000 calls.
    EXPECT_LT(readBytes(path).size(), 75000u);
    std::remove(path.c_str());
}

TEST(BoxStream, NoticesEveryFlippedByteAndEveryTruncation)
{
    const std::string path = temporaryFile("flipped");
    writeRandom(path, StreamPrecision::Float, 60, 11);
    const Bytes good = readBytes(path);
    ASSERT_GT(good.size(), 300u);
    for (std::size_t at = 0; at < good.size(); ++at)
    {
        for (const std::uint8_t flip : {0x01, 0x80, 0xff})
        {
            Bytes bad = good;
            bad[at] ^= flip;
            const std::string error = readAll(bad);
            EXPECT_NE(error.find("recording 'memory'"), std::string::npos) << "byte " << at << ": " << error;
        }
        const Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(at));
        EXPECT_NE(readAll(cut), "") << "cut at " << at;
    }
    Bytes longer = good;
    longer.push_back(0);
    EXPECT_NE(readAll(longer), "");
    std::remove(path.c_str());
}

/// A file with valid checksums around any events.
Bytes hostile(const std::vector<Bytes>& blocks, const BoxStreamInfo& info)
{
    Bytes file = box_stream::encodeHead(info);
    for (const Bytes& events : blocks)
    {
        const Bytes block = box_stream::packBlock(events);
        file.insert(file.end(), block.begin(), block.end());
    }
    return file;
}

TEST(BoxStream, RefusesIdsThatAreNotThereAndEventsThatAreCutOff)
{
    Bytes create = {1};
    create.resize(1 + 12 + 24);
    Bytes farId = create;
    farId[4] = 0x7f;
    Bytes twice = create;
    twice.insert(twice.end(), create.begin(), create.end());
    std::fill(twice.end() - 36, twice.end() - 32, 0xff);
    Bytes gone = create;
    gone.insert(gone.end(), {2, 0xff, 0xff, 0xff, 0xff, 4, 0xff, 0xff, 0xff, 0xff});
    const std::vector<std::pair<Bytes, std::string>> cases = {
        {farId, "is created before"},          {twice, "is created twice"}, {gone, "is used without a box"},
        {{2, 0, 0, 0, 0}, "without a box"},    {{0}, "unknown kind"},       {{7}, "unknown kind"},
        {{255, 1, 2, 3}, "unknown kind"},      {{1, 0, 0}, "cut off"},      {{3}, "cut off"},
        {{6}, "its head promises 9, 9 and 9"},
    };
    BoxStreamInfo info;
    info.events = info.frames = info.ids = 9;
    for (const auto& [events, expected] : cases)
    {
        const std::string error = readAll(hostile({events}, info));
        EXPECT_NE(error.find(expected), std::string::npos) << error;
    }
}

TEST(BoxStream, RefusesEveryKindOfEventCutOffAtAnyByte)
{
    const Bytes again = {0xff, 0xff, 0xff, 0xff};
    Bytes create = {1};
    create.resize(1 + 12 + 24);
    // Destroy, Set, SetSame and Filter of the box just created, with the bytes that follow their code.
    const std::vector<std::pair<std::uint8_t, std::size_t>> kinds = {{2, 4}, {3, 4 + 24}, {4, 4}, {5, 12}};
    BoxStreamInfo info;
    info.events = 2;
    info.ids = 1;
    const auto errorOf = [&](const Bytes& events) { return readAll(hostile({events}, info)); };
    for (std::size_t size = 1; size < create.size(); ++size)
    {
        const Bytes cut(create.begin(), create.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_NE(errorOf(cut).find("cut off"), std::string::npos) << size << " bytes of Create";
    }
    for (const auto& [code, size] : kinds)
    {
        Bytes whole = create;
        whole.push_back(code);
        whole.insert(whole.end(), again.begin(), again.end());
        whole.resize(create.size() + 1 + size);
        EXPECT_EQ(errorOf(whole), "") << "code " << int(code);
        for (std::size_t left = 0; left < size; ++left)
        {
            Bytes cut = whole;
            cut.resize(create.size() + 1 + left);
            EXPECT_NE(errorOf(cut).find("cut off"), std::string::npos)
                << left << " bytes after code " << int(code);
        }
    }
}

TEST(BoxStream, RejectsCountsAndBlockSizesThatFileOnlyClaims)
{
    BoxStreamInfo info;
    info.ids = ~std::uint32_t(0);
    info.events = info.frames = ~std::uint64_t(0) - 1;
    EXPECT_NE(readAll(hostile({}, info)).find("promises"), std::string::npos);
    // A block that claims 4 GiB.
    Bytes file = box_stream::encodeHead(info);
    const Bytes block = {'C', 'B', 'L', 'K', 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0};
    file.insert(file.end(), block.begin(), block.end());
    EXPECT_NE(readAll(file).find("4294967295 bytes"), std::string::npos) << readAll(file);
}

TEST(BoxStream, ReadsBlocksUpToTheLargestSizeAndNoLargerOnes)
{
    constexpr std::size_t kLargest = box_stream::kMaxBlock;
    const auto errorOf = [](std::size_t unpackedSize, std::size_t packedSize)
    {
        Bytes bytes = {'C', 'B', 'L', 'K'};
        box_stream::put(bytes, unpackedSize, 4);
        box_stream::put(bytes, packedSize, 4);
        box_stream::put(bytes, 0, 4);
        box_stream::BlockHead head;
        return box_stream::decodeBlockHead(bytes.data(), head);
    };
    EXPECT_EQ(errorOf(1, 1), "");
    EXPECT_EQ(errorOf(kLargest, 1), "");
    EXPECT_NE(errorOf(0, 1), "");
    EXPECT_NE(errorOf(kLargest + 1, 1), "");
    EXPECT_NE(errorOf(1, 2 * kLargest), "");

    // Random bytes become longer when they are packed.
    std::mt19937 random(37);
    Bytes events(kLargest);
    for (std::uint8_t& byte : events)
        byte = static_cast<std::uint8_t>(random());
    const Bytes block = box_stream::packBlock(events);
    box_stream::BlockHead head;
    ASSERT_EQ(box_stream::decodeBlockHead(block.data(), head), "");
    EXPECT_GT(head.packedSize, kLargest) << "other bytes would show nothing";
    Bytes unpacked;
    EXPECT_EQ(box_stream::unpackBlock(block, head, unpacked), "");
    EXPECT_TRUE(unpacked == events);
}

/// `count` creations of boxes, or one creation and calls that change nothing.
Bytes manyEvents(std::uint32_t count, bool areCreations)
{
    Bytes create = {1};
    create.resize(1 + 12 + 24);
    const Bytes same = {4, 0xff, 0xff, 0xff, 0xff};
    Bytes events = create;
    for (std::uint32_t i = 1; i < count; ++i)
    {
        const Bytes& event = areCreations ? create : same;
        events.insert(events.end(), event.begin(), event.end());
    }
    return events;
}

TEST(BoxStream, RefusesAFrameOfMoreEventsThanTheLimit)
{
    BoxStreamLimits limits;
    limits.frameEvents = 5000;
    // Blocks without the end of a frame, with less than a tenth of a byte per event in the file.
    for (const std::uint32_t count : {4999u, 5000u, 5001u, 20000u})
    {
        SCOPED_TRACE(count);
        const Bytes file =
            hostile({manyEvents(count, false), {6}}, {StreamPrecision::Float, 1, count + 1, 1});
        EXPECT_LT(file.size(), 100u + count / 10);
        std::string why;
        const auto reader = openMemory(file, why, limits);
        ASSERT_TRUE(reader) << why;
        std::vector<BoxEvent> events;
        const bool isTooMany = count > limits.frameEvents;
        EXPECT_EQ(reader->nextFrame(events),
                  isTooMany ? BoxStreamReader::Next::Error : BoxStreamReader::Next::Event);
        EXPECT_EQ(events.size(), std::min(count, limits.frameEvents));
        EXPECT_EQ(reader->error(),
                  isTooMany ? "recording 'memory', frame 0: more than 5000 events before its end, the limit "
                              "of this reader"
                            : "");
        // Reading event by event stores nothing.
        EXPECT_EQ(readAll(file, limits), "");
    }
}

TEST(BoxStream, RefusesMoreIdsThanTheLimit)
{
    BoxStreamLimits limits;
    limits.ids = 1000;
    for (const std::uint32_t count : {1000u, 1001u})
    {
        const Bytes file = hostile({manyEvents(count, true)}, {StreamPrecision::Float, 0, count, count});
        EXPECT_LT(file.size(), 100u + count);
        EXPECT_EQ(
            readAll(file, limits),
            count == 1000 ? "" : "recording 'memory', frame 0: more than 1000 ids, the limit of this reader");
        EXPECT_EQ(readAll(file), "") << "the limit without one that is given is far larger";
    }
}

TEST(BoxStream, SurvivesRandomEventsBehindGoodChecksums)
{
    std::mt19937 random(5);
    int errors = 0;
    for (int round = 0; round < 500; ++round)
    {
        Bytes events(1 + random() % 200);
        // Small numbers, so that some of the events are valid.
        for (std::uint8_t& byte : events)
            byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() % 8 : 0);
        events[0] = static_cast<std::uint8_t>(random() % 7);
        errors += readAll(hostile({events}, {})).empty() ? 0 : 1;
    }
    EXPECT_EQ(errors, 500) << "none has the counts of its head";
}

TEST(BoxStream, NamesTheFileAndTheReason)
{
    EXPECT_EQ(readAll("/nowhere/a.cbx"), "recording '/nowhere/a.cbx': No such file or directory");
    BoxStreamWriter nowhere("/nowhere/a.cbx", StreamPrecision::Float);
    EXPECT_NE(nowhere.error().find("/nowhere/a.cbx"), std::string::npos);
    nowhere.frame();
    EXPECT_FALSE(nowhere.finish());
    const std::string path = temporaryFile("reasons");
    writeBytes(path, {'x'});
    EXPECT_NE(readAll(path).find("too short"), std::string::npos);
    writeBytes(path, Bytes(100, 'x'));
    EXPECT_NE(readAll(path).find("not a recording"), std::string::npos);
    {
        const BoxStreamWriter open(path, StreamPrecision::Float);
        EXPECT_EQ(open.error(), "");
        EXPECT_EQ(readAll(path), "recording '" + path + "': too short for a recording");
    }
    EXPECT_EQ(readAll(path), "") << "the destructor finishes";
    BoxStreamInfo unfinished;
    unfinished.frames = box_stream::kUnknownCount;
    EXPECT_NE(readAll(hostile({}, unfinished)).find("not finished"), std::string::npos);
    Bytes newer = box_stream::encodeHead({});
    newer[8] = 2;
    writeBytes(path, newer);
    EXPECT_NE(readAll(path).find("version 2"), std::string::npos);
    std::remove(path.c_str());
}
}  // namespace
}  // namespace cullet
