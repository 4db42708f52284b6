// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Recordings in a build without zlib: nothing is written or read, and every error says why.
#include "cullet/recording/box_stream.h"

#include <istream>
#include <utility>

namespace cullet
{
namespace
{
std::string missing(const std::string& name)
{
    return "recording '" + name + "': cullet was built without zlib (zlib1g-dev), which recordings need";
}
}  // namespace

struct BoxStreamWriter::Parts
{
    std::string error;
    BoxStreamInfo info;
};

BoxStreamWriter::BoxStreamWriter(const std::string& path, StreamPrecision precision)
    : m(std::make_unique<Parts>())
{
    m->error = missing(path);
    m->info.precision = precision;
}

BoxStreamWriter::~BoxStreamWriter() = default;

void BoxStreamWriter::create(std::uint32_t, const StreamBox&, std::int32_t, std::int32_t) noexcept {}
void BoxStreamWriter::destroy(std::uint32_t) noexcept {}
void BoxStreamWriter::set(std::uint32_t, const StreamBox&) noexcept {}
void BoxStreamWriter::filter(std::uint32_t, std::int32_t, std::int32_t) noexcept {}
void BoxStreamWriter::frame() noexcept {}
void BoxStreamWriter::abandon() noexcept {}

bool BoxStreamWriter::finish() noexcept
{
    return false;
}

const std::string& BoxStreamWriter::error() const noexcept
{
    return m->error;
}

const BoxStreamInfo& BoxStreamWriter::info() const noexcept
{
    return m->info;
}

/// No reader is ever made: open() returns null.
struct BoxStreamReader::Parts
{
    std::string error;
    BoxStreamInfo info;
};

std::unique_ptr<BoxStreamReader> BoxStreamReader::open(const std::string& path, std::string& why,
                                                       const BoxStreamLimits&)
{
    why = missing(path);
    return nullptr;
}

std::unique_ptr<BoxStreamReader> BoxStreamReader::open(std::unique_ptr<std::istream>, const std::string& name,
                                                       std::string& why, const BoxStreamLimits&)
{
    why = missing(name);
    return nullptr;
}

BoxStreamReader::BoxStreamReader(std::unique_ptr<Parts> parts) : m(std::move(parts)) {}
BoxStreamReader::~BoxStreamReader() = default;

const BoxStreamInfo& BoxStreamReader::info() const noexcept
{
    return m->info;
}

BoxStreamReader::Next BoxStreamReader::next(BoxEvent&) noexcept
{
    return Next::Error;
}

BoxStreamReader::Next BoxStreamReader::nextFrame(std::vector<BoxEvent>&) noexcept
{
    return Next::Error;
}

const std::string& BoxStreamReader::error() const noexcept
{
    return m->error;
}
}  // namespace cullet
