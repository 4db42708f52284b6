// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/recording/box_stream.h"
#include "cullet/recording/box_stream_format.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <fstream>
#include <utility>

namespace cullet
{
using namespace box_stream;

struct BoxStreamWriter::Parts
{
    std::string path;
    std::ofstream file;
    std::string error;
    std::string memoryError;  ///< the error when there is no memory for one
    BoxStreamInfo info;
    Bytes events;               ///< of the block that is being filled
    std::vector<BoxBits> last;  ///< by id: the box as written last
    std::uint32_t lastId = ~std::uint32_t(0);
    bool isFinished = false;

    bool isDone() const { return isFinished || !error.empty(); }

    /// Calls write(), unless the file is done. An event that found no memory may be incomplete, so it is the last one.
    template <class Write>
    void record(const Write& write) noexcept
    {
        if (isDone())
            return;
        try
        {
            write();
        }
        catch (const std::exception&)
        {
            abandon();
        }
    }

    void abandon() noexcept
    {
        if (error.empty())
            error = std::exchange(memoryError, std::string());
    }

    void write(const Bytes& bytes)
    {
        file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        if (!file && error.empty())
            error = "recording '" + path + "': cannot be written: " + std::strerror(errno);
    }

    void writeBlock()
    {
        if (events.empty())
            return;
        write(packBlock(events));
        events.clear();
    }

    void begin(Code code)
    {
        // An event is never split between blocks: the largest has 61 bytes.
        if (events.size() + 64 > kMaxBlock)
            writeBlock();
        events.push_back(static_cast<std::uint8_t>(code));
        ++info.events;
    }

    void begin(Code code, std::uint32_t id)
    {
        begin(code);
        // The id after the last one is stored as zeros, which compress best.
        put(events, std::uint32_t(id - lastId - 1), 4);
        lastId = id;
        info.ids = std::max(info.ids, id + 1);
    }

    /// Appends the bits that differ from the last box of the id.
    void putBox(std::uint32_t id, const BoxBits& bits)
    {
        for (std::size_t i = 0; i < bits.size(); ++i)
            put(events, bits[i] ^ last[id][i], static_cast<std::size_t>(info.precision));
        last[id] = bits;
    }

    void putFilter(std::int32_t group, std::int32_t mask)
    {
        put(events, static_cast<std::uint32_t>(group), 4);
        put(events, static_cast<std::uint32_t>(mask), 4);
    }

    void finish()
    {
        writeBlock();
        file.seekp(0);
        write(encodeHead(info));
        file.close();
        if (!file && error.empty())
            error = "recording '" + path + "': cannot be written";
        isFinished = true;
    }
};

BoxStreamWriter::BoxStreamWriter(const std::string& path, StreamPrecision precision)
    : m(std::make_unique<Parts>())
{
    m->path = path;
    m->memoryError = "recording '" + path + "': out of memory";
    m->info.precision = precision;
    m->file.open(path, std::ios::binary | std::ios::trunc);
    BoxStreamInfo unfinished = m->info;
    unfinished.frames = kUnknownCount;
    unfinished.events = kUnknownCount;
    m->write(encodeHead(unfinished));
}

BoxStreamWriter::~BoxStreamWriter()
{
    finish();
}

void BoxStreamWriter::create(std::uint32_t id, const StreamBox& box, std::int32_t group,
                             std::int32_t mask) noexcept
{
    m->record(
        [&]
        {
            if (id >= m->last.size())
                m->last.resize(std::size_t(id) + 1);
            m->last[id] = {};
            m->begin(Code::Create, id);
            m->putFilter(group, mask);
            m->putBox(id, toBits(box, m->info.precision));
        });
}

void BoxStreamWriter::destroy(std::uint32_t id) noexcept
{
    m->record([&] { m->begin(Code::Destroy, id); });
}

void BoxStreamWriter::set(std::uint32_t id, const StreamBox& box) noexcept
{
    m->record(
        [&]
        {
            const BoxBits bits = toBits(box, m->info.precision);
            const bool isSame = bits == m->last[id];
            m->begin(isSame ? Code::SetSame : Code::Set, id);
            if (!isSame)
                m->putBox(id, bits);
        });
}

void BoxStreamWriter::filter(std::uint32_t id, std::int32_t group, std::int32_t mask) noexcept
{
    m->record(
        [&]
        {
            m->begin(Code::Filter, id);
            m->putFilter(group, mask);
        });
}

void BoxStreamWriter::frame() noexcept
{
    m->record(
        [&]
        {
            m->begin(Code::Frame);
            m->lastId = ~std::uint32_t(0);
            ++m->info.frames;
        });
}

void BoxStreamWriter::abandon() noexcept
{
    m->abandon();
}

bool BoxStreamWriter::finish() noexcept
{
    m->record([&] { m->finish(); });
    return m->error.empty();
}

const std::string& BoxStreamWriter::error() const noexcept
{
    return m->error;
}

const BoxStreamInfo& BoxStreamWriter::info() const noexcept
{
    return m->info;
}
}  // namespace cullet
