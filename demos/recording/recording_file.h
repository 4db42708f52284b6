// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/exact_pairs.h"
#include "cullet/recording/box_stream.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Contents of a recording that was completely read and checked.
struct RecordingSummary
{
    BoxStreamInfo info;
    std::uint32_t mostBoxes = 0;  ///< alive at once
    ExactBox bounds = {};         ///< of all finite boxes; zero if there is none
    bool isRounded = false;       ///< boxes of a double recording are rounded outward to this program's float
};

/// Reads a recording frame by frame, in the precision of this program.
///
/// @throws ProgramError (kExitInput) from every member for a file that is missing, truncated or corrupt
class RecordingFile
{
public:
    explicit RecordingFile(std::string path);

    /// Reads the whole file once, so that every byte is checked before any measurement, and rewinds.
    RecordingSummary summarise();

    /// Replaces `events` by those of the next frame; false at the end.
    bool nextFrame(std::vector<BoxEvent>& events);

private:
    void open();

    std::string m_path;
    std::unique_ptr<BoxStreamReader> m_reader;
};

/// The boxes of a recording at one moment, by id.
class RecordedBoxes
{
public:
    struct Box
    {
        ExactBox box = {{1, 1, 1}, {-1, -1, -1}};  ///< empty if no box is alive
        std::int32_t group = 0;
        std::int32_t mask = 0;
    };

    void apply(const std::vector<BoxEvent>& events);

    const Box& at(std::uint32_t id) const { return m_boxes[id]; }

    /// Whether the boxes overlap as closed intervals and the filter words agree now.
    bool arePair(std::uint32_t a, std::uint32_t b) const;

    /// All pairs of arePair(), sorted, by the reference sweep of the demos.
    Pairs exactPairs() const;

    std::uint32_t aliveCount() const noexcept { return m_alive; }

private:
    std::vector<Box> m_boxes;
    std::uint32_t m_alive = 0;
};

/// False for a box that overlaps nothing: min > max, or a NaN.
bool isValid(const StreamBox& box) noexcept;
}  // namespace CULLET_PRECISION
}  // namespace cullet
