// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Recordings of boxes: what the writer writes comes back, and no bytes harm the reader.

#include "cullet/recording/box_stream.h"
#include "cullet/recording/box_stream_format.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/fuzz_target.h"
#include "cullet/tests/fuzz/recordings/reader_check.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>
#include <vector>

namespace cullet::test
{
const char* const kFuzzTargetName = "recordings";

namespace
{
/// A temporary file, since the writer takes a path.
class WrittenFile
{
public:
    WrittenFile()
        : m_path(
              (std::filesystem::temp_directory_path() / ("cullet_fuzz_" + std::to_string(getpid()) + ".cbx"))
                  .string())
    {
    }
    WrittenFile(const WrittenFile&) = delete;
    WrittenFile& operator=(const WrittenFile&) = delete;
    ~WrittenFile() { std::remove(m_path.c_str()); }

    const std::string& path() const { return m_path; }

    Bytes bytes() const
    {
        std::ifstream file(m_path, std::ios::binary);
        return Bytes(std::istreambuf_iterator<char>(file), {});
    }

private:
    std::string m_path;
};

/// Bytes around events with right checksums.
Bytes enclose(const std::vector<Bytes>& blocks, const BoxStreamInfo& info)
{
    Bytes file = box_stream::encodeHead(info);
    for (const Bytes& events : blocks)
    {
        const Bytes block = box_stream::packBlock(events);
        file.insert(file.end(), block.begin(), block.end());
    }
    return file;
}

/// Writes what an input says, with right calls only, and keeps what a reader has to return.
class Session
{
public:
    explicit Session(Choices& choices)
        : m_precision(choices.chance(128) ? StreamPrecision::Double : StreamPrecision::Float),
          m_writer(m_file.path(), m_precision)
    {
        m_usesHostile = choices.chance(96);
        m_promise.precision = m_precision;
        choices.nextOperation();
    }

    std::string run(Choices& choices)
    {
        for (; !choices.isEmpty(); choices.nextOperation())
        {
            if (m_usesHostile)
                addHostile(choices);
            else
                addEvent(choices);
        }
        return m_usesHostile ? checkHostile() : checkWritten();
    }

private:
    static constexpr std::uint32_t kIds = 30;

    StreamBox anyBox(Choices& choices) const
    {
        StreamBox box;
        const float scale = choices.chance(32) ? 1e30f : 1.0f;
        for (int axis = 0; axis < 3; ++axis)
        {
            box.min[axis] = choices.coordinate(true) * scale;
            box.max[axis] = choices.coordinate(true) * scale;
            // Numbers that no float has.
            if (m_precision == StreamPrecision::Double)
                box.max[axis] /= 3;
        }
        return box;
    }

    void addEvent(Choices& choices)
    {
        const std::uint32_t kind = choices.below(8), id = choices.below(kIds);
        BoxEvent event;
        event.id = id;
        if (kind < 2)
            create(choices, event);
        else if (kind == 7)
        {
            m_writer.frame();
            m_events.emplace_back();
        }
        else if (id < m_isLive.size() && m_isLive[id])
            change(choices, kind, event);
        else if (kind == 6)
            damage(choices);
    }

    void create(Choices& choices, BoxEvent& event)
    {
        event.id = 0;
        while (event.id < m_isLive.size() && m_isLive[event.id])
            ++event.id;
        if (event.id == m_isLive.size())
        {
            m_isLive.push_back(false);
            m_boxes.emplace_back();
        }
        event.kind = BoxEvent::Kind::Create;
        event.group = static_cast<std::int32_t>(choices.below(256)) - 128;
        event.mask = -1;
        event.box = m_boxes[event.id] = anyBox(choices);
        m_isLive[event.id] = true;
        m_writer.create(event.id, event.box, event.group, event.mask);
        m_events.push_back(event);
    }

    void change(Choices& choices, std::uint32_t kind, BoxEvent& event)
    {
        if (kind == 2)
        {
            event.kind = BoxEvent::Kind::Destroy;
            m_isLive[event.id] = false;
            m_writer.destroy(event.id);
        }
        else if (kind == 3)
        {
            event.kind = BoxEvent::Kind::Filter;
            event.group = static_cast<std::int32_t>(choices.below(65536));
            event.mask = -static_cast<std::int32_t>(choices.below(65536));
            m_writer.filter(event.id, event.group, event.mask);
        }
        else
        {
            event.kind = BoxEvent::Kind::Set;
            if (kind != 4)
                m_boxes[event.id] = anyBox(choices);
            event.box = m_boxes[event.id];
            m_writer.set(event.id, event.box);
        }
        m_events.push_back(event);
    }

    /// Notes a change of the finished file.
    void damage(Choices& choices)
    {
        m_damages.push_back({choices.below(65536), choices.byte(), choices.below(3)});
    }

    void addHostile(Choices& choices)
    {
        const std::uint32_t kind = choices.below(8);
        if (kind == 0)
            m_blocks.emplace_back();
        else if (kind == 1)
            damage(choices);
        else if (kind == 2)
        {
            m_promise.events = choices.below(65536);
            m_promise.frames = choices.below(256);
            m_promise.ids = choices.below(64);
        }
        else if (kind == 3 && choices.chance(128))
            claimBlock(choices);
        else if (kind == 3)
        {
            for (int i = 0; i < 14; ++i)
                lastBlock().push_back(choices.byte());
        }
        else
            addPlausible(choices, static_cast<std::uint8_t>(1 + choices.below(6)));
    }

    Bytes& lastBlock()
    {
        if (m_blocks.empty())
            m_blocks.emplace_back();
        return m_blocks.back();
    }

    /// The head of a block of any size, behind all others.
    void claimBlock(Choices& choices)
    {
        m_tail = {'C', 'B', 'L', 'K'};
        for (const std::uint32_t shift : {choices.below(32), choices.below(32)})
            box_stream::put(m_tail, (std::uint64_t(1) << shift) + choices.below(256), 4);
        m_tail.resize(16 + choices.below(32), choices.byte());
    }

    /// An event of the right size, mostly, with any id.
    void addPlausible(Choices& choices, std::uint8_t code)
    {
        const std::size_t box = 6 * static_cast<std::size_t>(m_precision);
        const std::size_t sizes[] = {12 + box, 4, 4 + box, 4, 12, 0};
        const std::uint32_t step = choices.below(6);
        const std::uint32_t count = choices.chance(48) ? 1 + choices.below(64) : 1;
        for (std::uint32_t i = 0; i < count; ++i)
        {
            Bytes& block = lastBlock();
            block.push_back(code);
            Bytes body;
            box_stream::put(body, step == 5 ? choices.below(65536) * 77777u : step - 3u * (step > 2), 4);
            body.resize(sizes[code - 1], choices.byte());
            block.insert(block.end(), body.begin(), body.end());
            m_promise.events += 1;
            m_promise.frames += code == 6;
            m_promise.ids += code == 1;
        }
    }

    struct Damage
    {
        std::uint32_t place;
        std::uint8_t bits;
        std::uint32_t kind;
    };

    /// Applies the damages that an input names. @return whether the file has changed
    bool damaged(Bytes& bytes) const
    {
        const Bytes before = bytes;
        for (const Damage& damage : m_damages)
        {
            const std::size_t place = bytes.empty() ? 0 : damage.place % bytes.size();
            if (damage.kind == 0 && !bytes.empty())
                bytes[place] ^= damage.bits;
            else if (damage.kind == 1)
                bytes.resize(place);
            else
                bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(place), damage.bits);
        }
        return bytes != before;
    }

    std::string checkHostile()
    {
        m_blocks.erase(
            std::remove_if(m_blocks.begin(), m_blocks.end(), [](const Bytes& b) { return b.empty(); }),
            m_blocks.end());
        Bytes file = enclose(m_blocks, m_promise);
        file.insert(file.end(), m_tail.begin(), m_tail.end());
        std::string fault = checkBytes(file);
        if (fault.empty() && damaged(file))
            fault = checkBytes(file);
        return fault;
    }

    std::string checkWritten()
    {
        if (!m_writer.finish() || !m_writer.error().empty())
            return "the writer fails: " + m_writer.error();
        const BoxStreamInfo& info = m_writer.info();
        if (info.events != m_events.size() || info.ids != m_isLive.size())
            return "the writer counts " + std::to_string(info.events) + " events and " +
                   std::to_string(info.ids) + " ids";
        Bytes bytes = m_file.bytes();
        std::string why;
        const auto reader = openBytes(bytes, why, {});
        if (!reader)
            return "no reader: " + why;
        const std::string fault = compare(*reader);
        if (!fault.empty())
            return fault;
        const std::string limited = checkBytes(bytes);
        if (!limited.empty() || !damaged(bytes))
            return limited;
        const std::string harm = checkBytes(bytes);
        return harm.empty() ? noticed(bytes) : harm;
    }

    std::string compare(BoxStreamReader& reader) const
    {
        BoxEvent event;
        for (std::size_t i = 0; i < m_events.size(); ++i)
        {
            const BoxEvent& expected = m_events[i];
            if (reader.next(event) != BoxStreamReader::Next::Event)
                return "event " + std::to_string(i) + " is lost: " + reader.error();
            if (!isSame(event, expected))
                return "event " + std::to_string(i) + " is " + describe(event) + " instead of " +
                       describe(expected);
        }
        return reader.next(event) == BoxStreamReader::Next::End ? "" : "no End: " + reader.error();
    }

    /// A changed file never passes as whole: its checksums and counts notice.
    static std::string noticed(const Bytes& bytes)
    {
        std::string why;
        const auto reader = openBytes(bytes, why, {});
        BoxEvent event;
        BoxStreamReader::Next next = BoxStreamReader::Next::Event;
        while (reader && next == BoxStreamReader::Next::Event)
            next = reader->next(event);
        return reader && next == BoxStreamReader::Next::End ? "a damaged file is read to its end" : "";
    }

    const StreamPrecision m_precision;
    WrittenFile m_file;
    BoxStreamWriter m_writer;
    bool m_usesHostile = false;
    std::vector<BoxEvent> m_events;
    std::vector<bool> m_isLive;
    std::vector<StreamBox> m_boxes;
    std::vector<Bytes> m_blocks;
    Bytes m_tail;
    BoxStreamInfo m_promise;
    std::vector<Damage> m_damages;
};
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    // The bytes as a file, too.
    const std::string fault = checkBytes(Bytes(data, data + size));
    if (!fault.empty())
        return fault;
    Choices choices(data, size);
    Session session(choices);
    return session.run(choices);
}
}  // namespace cullet::test
