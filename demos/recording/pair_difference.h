// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/recording/replay.h"

#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Hash over the pair sets of all frames.
class FrameHash
{
public:
    void add(const Pairs& pairs);
    std::uint64_t value() const noexcept { return m_value; }

private:
    std::uint64_t m_value = 0;
};

/// Sorted pairs and the name of the backend that found them.
struct NamedPairs
{
    std::string name;
    const Pairs* pairs;
};

/// Describes the first pair that only one of two sets has, with frame and boxes; empty if they are equal.
std::string describeDifference(std::uint64_t frame, const NamedPairs& one, const NamedPairs& other,
                               const RecordedBoxes& boxes);

/// Number of frames of the recording to play by the options.
std::uint64_t framesToPlay(const ReplayOptions& options, const RecordingSummary& summary);
}  // namespace CULLET_PRECISION
}  // namespace cullet
