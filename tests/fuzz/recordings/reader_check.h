// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/recording/box_stream.h"
#include "cullet/recording/box_stream_format.h"
#include "cullet/tests/fuzz/largest_new.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

/// What a reader may do with bytes that it cannot trust.
namespace cullet::test
{
using box_stream::Bytes;

// Small, so that inputs reach them.
inline constexpr BoxStreamLimits kLimits = {24, 40};

// A block of 1 MiB, and what zlib may need for one that cannot be compressed.
inline constexpr std::size_t kMostMemory = 9 * (box_stream::kMaxBlock / 8);

inline std::string describe(const BoxEvent& event)
{
    std::ostringstream text;
    text << "kind " << static_cast<int>(event.kind) << " id " << event.id << " group " << event.group
         << " mask " << event.mask << " x " << event.box.min[0];
    return text.str();
}

/// NaNs are equal here; a float NaN may change its payload on the way through double.
inline bool isSameNumber(double a, double b)
{
    return std::memcmp(&a, &b, sizeof a) == 0 || (a != a && b != b);
}

inline bool isSame(const BoxEvent& a, const BoxEvent& b)
{
    return a.kind == b.kind && a.id == b.id && a.group == b.group && a.mask == b.mask &&
           std::equal(a.box.min, a.box.min + 3, b.box.min, isSameNumber) &&
           std::equal(a.box.max, a.box.max + 3, b.box.max, isSameNumber);
}

inline std::unique_ptr<BoxStreamReader> openBytes(const Bytes& bytes, std::string& why,
                                                  const BoxStreamLimits& limits)
{
    return BoxStreamReader::open(
        std::make_unique<std::istringstream>(std::string(bytes.begin(), bytes.end())), "memory", why, limits);
}

/// Follows a reader of untrusted bytes: what it may return, and what it has to hold at the end.
class ReaderCheck
{
public:
    explicit ReaderCheck(BoxStreamReader& reader) : m_reader(reader) {}

    /// Reads event by event, or by frames, to the end or an error.
    ///
    /// @return what is wrong; the reader's own error is none
    std::string run(bool readsFrames)
    {
        BoxStreamReader::Next next = BoxStreamReader::Next::Event;
        while (m_fault.empty() && next == BoxStreamReader::Next::Event)
            next = readsFrames ? readFrame() : readEvent();
        if (!m_fault.empty())
            return m_fault;
        BoxEvent event;
        const bool isError = next == BoxStreamReader::Next::Error;
        if (isError == m_reader.error().empty())
            return "the state and the message differ: " + m_reader.error();
        if (isError && m_reader.error().find("recording 'memory', frame ") != 0)
            return "a message without name and frame: " + m_reader.error();
        if (isError && m_reader.error().find('\n') != std::string::npos)
            return "a message of two lines";
        if (m_reader.next(event) != next)
            return "the state after the end changes";
        const BoxStreamInfo& info = m_reader.info();
        if (!isError &&
            (info.events != m_events.size() || info.frames != m_frames || info.ids != m_isLive.size()))
            return "End, with other counts than the head promises";
        return "";
    }

    const std::vector<BoxEvent>& events() const { return m_events; }

private:
    BoxStreamReader::Next readEvent()
    {
        BoxEvent event;
        const BoxStreamReader::Next next = m_reader.next(event);
        if (next == BoxStreamReader::Next::Event)
            see(event);
        return next;
    }

    BoxStreamReader::Next readFrame()
    {
        std::vector<BoxEvent> events(3);
        const BoxStreamReader::Next next = m_reader.nextFrame(events);
        if (events.size() > kLimits.frameEvents)
            m_fault = "more events of a frame than the limit";
        for (const BoxEvent& event : events)
        {
            if (event.kind == BoxEvent::Kind::Frame)
                m_fault = "nextFrame() returns a Frame";
            see(event);
        }
        if (next == BoxStreamReader::Next::Event)
            see(BoxEvent());
        return next;
    }

    void see(const BoxEvent& event)
    {
        m_events.push_back(event);
        if (event.kind == BoxEvent::Kind::Frame)
        {
            ++m_frames;
            return;
        }
        const bool isCreate = event.kind == BoxEvent::Kind::Create;
        if (isCreate && event.id == m_isLive.size())
            m_isLive.push_back(false);
        if (event.id >= m_isLive.size() || m_isLive[event.id] == isCreate)
            m_fault = "an event of an id that is not right: " + describe(event);
        else if (event.id >= kLimits.ids)
            m_fault = "an id beyond the limit: " + describe(event);
        else
            m_isLive[event.id] = event.kind != BoxEvent::Kind::Destroy;
    }

    BoxStreamReader& m_reader;
    std::vector<BoxEvent> m_events;
    std::vector<bool> m_isLive;
    std::uint64_t m_frames = 0;
    std::string m_fault;
};

/// Reads bytes in both ways, which have to agree but for the limit of a frame. @return what is wrong
inline std::string checkBytes(const Bytes& bytes)
{
    std::vector<BoxEvent> first;
    resetLargestNew();
    for (const bool readsFrames : {false, true})
    {
        std::string why;
        const auto reader = openBytes(bytes, why, kLimits);
        if (!reader)
        {
            if (why.find("recording 'memory': ") != 0)
                return "no reader, and no reason: " + why;
            continue;
        }
        ReaderCheck check(*reader);
        const std::string fault = check.run(readsFrames);
        if (!fault.empty())
            return (readsFrames ? "frames: " : "events: ") + fault;
        if (!readsFrames)
            first = check.events();
        else if (check.events().size() > first.size() ||
                 !std::equal(check.events().begin(), check.events().end(), first.begin(), isSame))
            return "nextFrame() and next() return different events";
    }
    const std::size_t most = std::max(kMostMemory, 64 * bytes.size());
    return largestNew() <= most ? "" : "an allocation of " + std::to_string(largestNew()) + " bytes";
}
}  // namespace cullet::test
