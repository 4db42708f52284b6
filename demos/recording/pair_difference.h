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

/// Sorted pairs and who found them.
struct NamedPairs
{
    std::string name;
    const Pairs* pairs;
};

/// The first pair that one has and the other has not, with frame and boxes, in words; empty when they are equal.
std::string describeDifference(std::uint64_t frame, const NamedPairs& one, const NamedPairs& other,
                               const RecordedBoxes& boxes);

/// How many frames of the recording the options ask for.
std::uint64_t framesToPlay(const ReplayOptions& options, const RecordingSummary& summary);
}  // namespace CULLET_PRECISION
}  // namespace cullet
