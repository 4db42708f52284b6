// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/recording/box_stream.h"
#include "cullet/recording/box_stream_format.h"

#include <cerrno>
#include <cstring>
#include <exception>
#include <fstream>
#include <utility>

namespace cullet
{
using namespace box_stream;

struct BoxStreamReader::Parts
{
    std::string path;
    std::unique_ptr<std::istream> file;
    std::string error;
    std::string memoryError;  ///< the error when there is no memory for one
    BoxStreamInfo info;
    BoxStreamLimits limits;
    Bytes block;
    Bytes events;
    std::size_t position = 0;   ///< in events
    std::vector<BoxBits> last;  ///< by id: the last box
    std::vector<bool> isLive;   ///< by id
    std::uint32_t lastId = ~std::uint32_t(0);
    std::uint64_t eventCount = 0;
    std::uint64_t frameCount = 0;

    Next fail(const std::string& reason)
    {
        error = "recording '" + path + "', frame " + std::to_string(frameCount) + ": " + reason;
        return Next::Error;
    }

    /// Calls read(). An event that found no memory may be half read, so it is the last one.
    template <class Read>
    Next readSafely(const Read& read) noexcept
    {
        try
        {
            return read();
        }
        catch (const std::exception&)
        {
            if (error.empty())
                error = std::exchange(memoryError, std::string());
            return Next::Error;
        }
    }

    bool read(std::uint8_t* bytes, std::size_t count)
    {
        file->read(reinterpret_cast<char*>(bytes), static_cast<std::streamsize>(count));
        return static_cast<std::size_t>(file->gcount()) == count;
    }

    Next next(BoxEvent& event);
    Next nextFrame(std::vector<BoxEvent>& frame);
    Next readBlock();
    Next finish();
    Next decode(BoxEvent& event);
    Next decodeId(Code code, BoxEvent& event);
    void decodeFilter(BoxEvent& event);
    void decodeBox(BoxEvent& event, bool isSame);

    std::uint64_t readValue(std::size_t size)
    {
        const std::uint64_t value = get(events.data() + position, size);
        position += size;
        return value;
    }

    /// Bytes of an event after its code; 0 for Frame. The caller has rejected unknown codes.
    std::size_t sizeOf(Code code) const
    {
        const std::size_t box = 6 * static_cast<std::size_t>(info.precision);
        switch (code)
        {
            case Code::Create:
                return 12 + box;
            case Code::Destroy:
            case Code::SetSame:
                return 4;
            case Code::Set:
                return 4 + box;
            case Code::Filter:
                return 12;
            case Code::Frame:
                break;
        }
        return 0;
    }
};

BoxStreamReader::Next BoxStreamReader::Parts::finish()
{
    if (eventCount != info.events || frameCount != info.frames || isLive.size() != info.ids)
        return fail("ends after " + std::to_string(eventCount) + " events, " + std::to_string(frameCount) +
                    " frames and " + std::to_string(isLive.size()) + " ids; its head promises " +
                    std::to_string(info.events) + ", " + std::to_string(info.frames) + " and " +
                    std::to_string(info.ids));
    return Next::End;
}

BoxStreamReader::Next BoxStreamReader::Parts::readBlock()
{
    if (file->peek() == std::ifstream::traits_type::eof())
        return finish();
    block.resize(kBlockHeadSize);
    if (!read(block.data(), kBlockHeadSize))
        return fail("truncated in the head of a block");
    BlockHead head;
    std::string reason = decodeBlockHead(block.data(), head);
    if (!reason.empty())
        return fail(reason);
    block.resize(kBlockHeadSize + head.packedSize);
    if (!read(block.data() + kBlockHeadSize, head.packedSize))
        return fail("truncated in a block");
    reason = unpackBlock(block, head, events);
    if (!reason.empty())
        return fail(reason);
    position = 0;
    return Next::Event;
}

BoxStreamReader::Next BoxStreamReader::Parts::decodeId(Code code, BoxEvent& event)
{
    event.id = static_cast<std::uint32_t>(lastId + 1 + readValue(4));
    lastId = event.id;
    if (code == Code::Create)
    {
        if (event.id > isLive.size())
            return fail("id " + std::to_string(event.id) + " is created before " +
                        std::to_string(isLive.size()));
        if (event.id >= limits.ids)
            return fail("more than " + std::to_string(limits.ids) + " ids, the limit of this reader");
        if (event.id == isLive.size())
        {
            isLive.push_back(false);
            last.emplace_back();
        }
        if (isLive[event.id])
            return fail("id " + std::to_string(event.id) + " is created twice");
    }
    else if (event.id >= isLive.size() || !isLive[event.id])
        return fail("id " + std::to_string(event.id) + " is used without a box");
    isLive[event.id] = code != Code::Destroy;
    return Next::Event;
}

void BoxStreamReader::Parts::decodeFilter(BoxEvent& event)
{
    event.group = static_cast<std::int32_t>(static_cast<std::uint32_t>(readValue(4)));
    event.mask = static_cast<std::int32_t>(static_cast<std::uint32_t>(readValue(4)));
}

void BoxStreamReader::Parts::decodeBox(BoxEvent& event, bool isSame)
{
    BoxBits& bits = last[event.id];
    if (!isSame)
    {
        for (std::uint64_t& word : bits)
            word ^= readValue(static_cast<std::size_t>(info.precision));
    }
    event.box = fromBits(bits, info.precision);
}

BoxStreamReader::Next BoxStreamReader::Parts::decode(BoxEvent& event)
{
    const std::uint64_t first = readValue(1);
    if (first < static_cast<std::uint8_t>(Code::Create) || first > static_cast<std::uint8_t>(Code::Frame))
        return fail("an event of unknown kind " + std::to_string(first));
    const Code code = static_cast<Code>(first);
    if (events.size() - position < sizeOf(code))
        return fail("an event that is cut off");
    ++eventCount;
    event = BoxEvent();
    if (code == Code::Frame)
    {
        lastId = ~std::uint32_t(0);
        ++frameCount;
        return Next::Event;
    }
    if (decodeId(code, event) == Next::Error)
        return Next::Error;
    switch (code)
    {
        case Code::Create:
            event.kind = BoxEvent::Kind::Create;
            decodeFilter(event);
            last[event.id] = {};
            decodeBox(event, false);
            break;
        case Code::Destroy:
            event.kind = BoxEvent::Kind::Destroy;
            break;
        case Code::Filter:
            event.kind = BoxEvent::Kind::Filter;
            decodeFilter(event);
            break;
        default:
            event.kind = BoxEvent::Kind::Set;
            decodeBox(event, code == Code::SetSame);
    }
    return Next::Event;
}

std::unique_ptr<BoxStreamReader> BoxStreamReader::open(const std::string& path, std::string& why,
                                                       const BoxStreamLimits& limits)
{
    auto file = std::make_unique<std::ifstream>(path, std::ios::binary);
    if (*file)
        return open(std::move(file), path, why, limits);
    why = "recording '" + path + "': " + std::strerror(errno);
    return nullptr;
}

std::unique_ptr<BoxStreamReader> BoxStreamReader::open(std::unique_ptr<std::istream> stream,
                                                       const std::string& name, std::string& why,
                                                       const BoxStreamLimits& limits)
{
    auto parts = std::make_unique<Parts>();
    parts->path = name;
    parts->memoryError = "recording '" + name + "': out of memory";
    parts->file = std::move(stream);
    parts->limits = limits;
    Bytes head(kHeadSize);
    why = parts->read(head.data(), head.size()) ? decodeHead(head.data(), parts->info)
                                                : "too short for a recording";
    if (why.empty())
        return std::unique_ptr<BoxStreamReader>(new BoxStreamReader(std::move(parts)));
    why = "recording '" + name + "': " + why;
    return nullptr;
}

BoxStreamReader::BoxStreamReader(std::unique_ptr<Parts> parts) : m(std::move(parts)) {}
BoxStreamReader::~BoxStreamReader() = default;

const BoxStreamInfo& BoxStreamReader::info() const noexcept
{
    return m->info;
}

BoxStreamReader::Next BoxStreamReader::Parts::next(BoxEvent& event)
{
    if (!error.empty())
        return Next::Error;
    if (position == events.size())
    {
        const Next readResult = readBlock();
        if (readResult != Next::Event)
            return readResult;
    }
    return decode(event);
}

BoxStreamReader::Next BoxStreamReader::Parts::nextFrame(std::vector<BoxEvent>& frame)
{
    frame.clear();
    BoxEvent event;
    while (true)
    {
        const Next result = next(event);
        if (result != Next::Event || event.kind == BoxEvent::Kind::Frame)
            return result;
        if (frame.size() == limits.frameEvents)
            return fail("more than " + std::to_string(limits.frameEvents) +
                        " events before its end, the limit of this reader");
        frame.push_back(event);
    }
}

BoxStreamReader::Next BoxStreamReader::next(BoxEvent& event) noexcept
{
    return m->readSafely([&] { return m->next(event); });
}

BoxStreamReader::Next BoxStreamReader::nextFrame(std::vector<BoxEvent>& events) noexcept
{
    return m->readSafely([&] { return m->nextFrame(events); });
}

const std::string& BoxStreamReader::error() const noexcept
{
    return m->error;
}
}  // namespace cullet
