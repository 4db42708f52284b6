// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/recording/recording_file.h"

#include "cullet/broad/aabb.h"
#include "cullet/demos/program/exit_code.h"

#include <LinearMath/btScalar.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
bool isRounded(const BoxStreamInfo& info)
{
    return info.precision == StreamPrecision::Double && sizeof(btScalar) == sizeof(float);
}

void roundOutward(StreamBox& box)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = roundDownToFloat(box.min[axis]);
        box.max[axis] = roundUpToFloat(box.max[axis]);
    }
}

ExactBox toExactBox(const StreamBox& box)
{
    return {{box.min[0], box.min[1], box.min[2]}, {box.max[0], box.max[1], box.max[2]}};
}

/// Grows `bounds` by a box; unbounded coordinates are ignored.
void include(ExactBox& bounds, const StreamBox& box)
{
    if (!isValid(box))
        return;
    for (int axis = 0; axis < 3; ++axis)
    {
        // The box that Bullet gives a plane is finite, but larger than any world.
        constexpr double kUnbounded = 1e17;
        if (std::fabs(box.min[axis]) < kUnbounded)
            bounds.min[axis] = std::min(bounds.min[axis], box.min[axis]);
        if (std::fabs(box.max[axis]) < kUnbounded)
            bounds.max[axis] = std::max(bounds.max[axis], box.max[axis]);
    }
}
}  // namespace

bool isValid(const StreamBox& box) noexcept
{
    return box.min[0] <= box.max[0] && box.min[1] <= box.max[1] && box.min[2] <= box.max[2];
}

RecordingFile::RecordingFile(std::string path) : m_path(std::move(path))
{
    open();
}

void RecordingFile::open()
{
    std::string why;
    std::error_code ignored;
    if (std::filesystem::is_directory(m_path, ignored))
        throw ProgramError(kExitInput, "recording '" + m_path + "': is a folder");
    m_reader = BoxStreamReader::open(m_path, why);
    if (!m_reader)
        throw ProgramError(kExitInput, why);
}

RecordingSummary RecordingFile::summarise()
{
    RecordingSummary summary;
    summary.info = m_reader->info();
    summary.isRounded = isRounded(summary.info);
    std::uint32_t alive = 0;
    BoxEvent event;
    BoxStreamReader::Next result;
    while ((result = m_reader->next(event)) == BoxStreamReader::Next::Event)
    {
        if (event.kind == BoxEvent::Kind::Create)
            summary.mostBoxes = std::max(summary.mostBoxes, ++alive);
        else if (event.kind == BoxEvent::Kind::Destroy)
            --alive;
        if (event.kind == BoxEvent::Kind::Create || event.kind == BoxEvent::Kind::Set)
            include(summary.bounds, event.box);
    }
    if (result == BoxStreamReader::Next::Error)
        throw ProgramError(kExitInput, m_reader->error());
    open();
    return summary;
}

bool RecordingFile::nextFrame(std::vector<BoxEvent>& events)
{
    const BoxStreamReader::Next result = m_reader->nextFrame(events);
    if (result == BoxStreamReader::Next::Error)
        throw ProgramError(kExitInput, m_reader->error());
    if (isRounded(m_reader->info()))
    {
        for (BoxEvent& event : events)
            roundOutward(event.box);
    }
    return result == BoxStreamReader::Next::Event;
}

void RecordedBoxes::apply(const std::vector<BoxEvent>& events)
{
    for (const BoxEvent& event : events)
    {
        if (event.id >= m_boxes.size())
            m_boxes.resize(event.id + 1);
        Box& box = m_boxes[event.id];
        switch (event.kind)
        {
            case BoxEvent::Kind::Create:
                box = {toExactBox(event.box), event.group, event.mask};
                ++m_alive;
                break;
            case BoxEvent::Kind::Destroy:
                box = {};
                --m_alive;
                break;
            case BoxEvent::Kind::Set:
                box.box = toExactBox(event.box);
                break;
            case BoxEvent::Kind::Filter:
                box.group = event.group;
                box.mask = event.mask;
                break;
            case BoxEvent::Kind::Frame:
                break;
        }
    }
}

bool RecordedBoxes::arePair(std::uint32_t a, std::uint32_t b) const
{
    const Box& one = m_boxes[a];
    const Box& other = m_boxes[b];
    return (one.group & other.mask) != 0 && (other.group & one.mask) != 0 && overlaps(one.box, other.box);
}

Pairs RecordedBoxes::exactPairs() const
{
    std::vector<ExactBox> boxes;
    boxes.reserve(m_boxes.size());
    for (const Box& box : m_boxes)
        boxes.push_back(box.box);
    Pairs pairs = findExactPairs(boxes);
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                               [this](Pair pair) { return !arePair(pair.first, pair.second); }),
                pairs.end());
    return pairs;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
