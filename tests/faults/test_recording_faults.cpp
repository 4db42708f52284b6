// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A recording for which memory or the disk fails once: the world runs on, error() says so, and a file that is called
// complete is.
#include "cullet/plugin/recording_broadphase.h"
#include "cullet/recording/box_stream.h"
#include "cullet/tests/faults/support/sweep.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

namespace cullet::test
{
namespace
{
/// One file for each process, since tests may run at once.
const std::string& pathOfRecording()
{
    static const std::string path =
        testing::TempDir() + "recording_faults_" + std::to_string(getpid()) + ".cbx";
    return path;
}

/// What a reader tells of a file: the live boxes by id at its end, and the frames.
struct Contents
{
    std::map<std::uint32_t, float> boxes;  ///< id -> lower x
    std::uint64_t frames = 0;
    BoxStreamReader::Next end = BoxStreamReader::Next::Event;
};

void apply(const BoxEvent& event, Contents& contents)
{
    if (event.kind == BoxEvent::Kind::Destroy)
        contents.boxes.erase(event.id);
    else if (event.kind != BoxEvent::Kind::Filter)
        contents.boxes[event.id] = static_cast<float>(event.box.min[0]);
}

/// Reads to the end, or to the first error.
Contents readAll(FaultRun& run, BoxStreamReader& reader)
{
    Contents contents;
    std::vector<BoxEvent> events;
    while (contents.end == BoxStreamReader::Next::Event)
    {
        run.certain([&] { contents.end = reader.nextFrame(events); });
        const FaultPause pause;
        for (const BoxEvent& event : events)
            apply(event, contents);
        contents.frames += contents.end == BoxStreamReader::Next::Event ? 1 : 0;
    }
    EXPECT_EQ(contents.end == BoxStreamReader::Next::Error, !reader.error().empty());
    return contents;
}

std::unique_ptr<BoxStreamReader> openRecording(FaultRun& run, std::string& why)
{
    std::unique_ptr<BoxStreamReader> reader;
    run.insist([&] { reader = BoxStreamReader::open(pathOfRecording(), why); });
    return reader;
}

struct Length
{
    std::size_t cubes;
    int frames;
};
constexpr Length kShort = {30, 12};
// More than one block.
constexpr Length kLong = {400, 130};

/// A world of a few cubes, recorded.
class RecordedWorld
{
public:
    RecordedWorld(FaultRun& run, Length length) : m_run(run), m_length(length), m_cubes(length.cubes)
    {
        m_run.insist([&]
                     { m_recording = std::make_unique<RecordingBroadphase>(m_inner, pathOfRecording()); });
    }
    ~RecordedWorld()
    {
        for (std::size_t i = 0; i < m_cubes.size(); ++i)
            destroy(i);
    }
    RecordedWorld(const RecordedWorld&) = delete;
    RecordedWorld& operator=(const RecordedWorld&) = delete;

    void live()
    {
        for (int frame = 0; frame < m_length.frames; ++frame)
        {
            for (std::size_t i = 0; i < m_cubes.size(); ++i)
                move(i, double(i) + 0.01 * frame);
            destroy(std::size_t(frame) % m_cubes.size());
            const auto update = [&]
            {
                ++m_frames;
                m_recording->calculateOverlappingPairs(nullptr);
            };
            if (m_run.update(update))
                expectWorld();
        }
    }

    /// Expects a file whose contents are those of the world, or an error.
    void finish()
    {
        bool isComplete = false;
        m_run.certain([&] { isComplete = m_recording->finish(); });
        EXPECT_EQ(isComplete, m_recording->error().empty());
        EXPECT_TRUE(isComplete || hasFaultHappened()) << m_recording->error();
        const FaultPause pause;
        std::string why;
        const auto reader = openRecording(m_run, why);
        ASSERT_EQ(reader != nullptr, isComplete) << why;
        if (isComplete)
            expectContents(readAll(m_run, *reader));
    }

    void destroyRecording()
    {
        m_run.certain([&] { m_recording.reset(); });
    }

private:
    void move(std::size_t i, double x)
    {
        if (m_cubes[i] == nullptr)
            m_run.attempt([&] { m_cubes[i] = addCube(*m_recording, vec(x, 0, 0), 0.6); });
        else
            m_run.attempt([&] { moveCube(*m_recording, m_cubes[i], vec(x, 0, 0), 0.6); });
    }

    void destroy(std::size_t i)
    {
        btBroadphaseInterface& broadphase =
            m_recording != nullptr ? static_cast<btBroadphaseInterface&>(*m_recording) : m_inner;
        if (m_cubes[i] != nullptr)
            m_run.certain([&] { broadphase.destroyProxy(m_cubes[i], nullptr); });
        m_cubes[i] = nullptr;
    }

    /// Cubes in a row, of which neighbours overlap.
    void expectWorld()
    {
        const FaultPause pause;
        std::uint32_t alive = 0;
        std::size_t pairs = 0;
        for (std::size_t i = 0; i < m_cubes.size(); ++i)
        {
            alive += m_cubes[i] != nullptr ? 1 : 0;
            pairs += i > 0 && m_cubes[i] != nullptr && m_cubes[i - 1] != nullptr ? 1 : 0;
        }
        EXPECT_EQ(m_inner.stats().bodies, alive);
        EXPECT_EQ(m_inner.stats().pairs, pairs);
    }

    void expectContents(const Contents& contents)
    {
        EXPECT_EQ(contents.end, BoxStreamReader::Next::End);
        EXPECT_EQ(contents.frames, m_frames);
        std::multimap<float, int> expected, found;
        for (const btBroadphaseProxy* proxy : m_cubes)
        {
            if (proxy != nullptr)
                expected.emplace(static_cast<float>(proxy->m_aabbMin.x()), 0);
        }
        for (const auto& box : contents.boxes)
            found.emplace(box.second, 0);
        EXPECT_EQ(found, expected);
    }

    FaultRun& m_run;
    const Length m_length;
    Broadphase m_inner{[]
                       {
                           BroadphaseOptions options;
                           options.threads = 1;
                           options.margin = 0;
                           options.backend = BackendChoice::Grid;
                           return options;
                       }()};
    std::unique_ptr<RecordingBroadphase> m_recording;
    std::vector<btBroadphaseProxy*> m_cubes;
    std::uint64_t m_frames = 0;
};

SweepCounts record(const char* name, FaultKind kind, Length length, bool isFinished = true)
{
    return sweepFaults(name, kind,
                       [&](FaultRun& run)
                       {
                           RecordedWorld world(run, length);
                           world.live();
                           if (isFinished)
                               world.finish();
                           world.destroyRecording();
                       });
}

class RecordingFaults : public testing::Test
{
protected:
    ~RecordingFaults() override { std::remove(pathOfRecording().c_str()); }
};

TEST_F(RecordingFaults, LeaveTheWorldAsItIsWhenAllocationFails)
{
    EXPECT_GE(record("recording", FaultKind::New, kShort).injected, 100u);
    EXPECT_GE(record("recording without finish()", FaultKind::New, kShort, false).injected, 100u);
}

TEST_F(RecordingFaults, AreReportedWhenAnyWriteFindsTheDiskFull)
{
    EXPECT_GE(record("recording", FaultKind::FileWrite, kShort).injected, 2u);
    EXPECT_GE(record("long recording", FaultKind::FileWrite, kLong).injected, 3u);
    EXPECT_GE(record("recording without finish()", FaultKind::FileWrite, kShort, false).injected, 2u);
}

TEST_F(RecordingFaults, EndTheReadingWithAnErrorWhenAllocationFails)
{
    FaultRun unharmed;
    RecordedWorld world(unharmed, kShort);
    world.live();
    world.finish();
    std::uint64_t errors = 0;
    const SweepCounts counts = sweepFaults("reading a recording", FaultKind::New,
                                           [&](FaultRun& run)
                                           {
                                               std::string why;
                                               const auto reader = openRecording(run, why);
                                               ASSERT_NE(reader, nullptr) << why;
                                               const Contents contents = readAll(run, *reader);
                                               errors += contents.end == BoxStreamReader::Next::Error ? 1 : 0;
                                               if (contents.end == BoxStreamReader::Next::End)
                                               {
                                                   EXPECT_EQ(contents.frames, std::uint64_t(kShort.frames));
                                               }
                                           });
    EXPECT_GE(counts.injected, 20u);
    EXPECT_GE(errors, 10u);
}
}  // namespace
}  // namespace cullet::test
