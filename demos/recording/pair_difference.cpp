// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/recording/pair_difference.h"

#include <algorithm>
#include <cstdio>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::string describeBox(std::uint32_t id, const RecordedBoxes::Box& box)
{
    char text[400];
    // Enough digits to distinguish any two coordinates.
    std::snprintf(text, sizeof(text),
                  "\n  box %u: (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g), group %d, mask %d", id,
                  box.box.min[0], box.box.min[1], box.box.min[2], box.box.max[0], box.box.max[1],
                  box.box.max[2], box.group, box.mask);
    return text;
}
}  // namespace

void FrameHash::add(const Pairs& pairs)
{
    PairDigest digest;
    for (const Pair pair : pairs)
        digest.add(pair);
    m_value = splitMix(m_value ^ digest.hash ^ digest.count);
}

std::string describeDifference(std::uint64_t frame, const NamedPairs& one, const NamedPairs& other,
                               const RecordedBoxes& boxes)
{
    const auto [a, b] =
        std::mismatch(one.pairs->begin(), one.pairs->end(), other.pairs->begin(), other.pairs->end());
    const bool isOneOver = a == one.pairs->end();
    if (isOneOver && b == other.pairs->end())
        return "";
    const bool inOne = !isOneOver && (b == other.pairs->end() || *a < *b);
    const Pair pair = inOne ? *a : *b;
    return "frame " + std::to_string(frame) + ": pair (" + std::to_string(pair.first) + ", " +
           std::to_string(pair.second) + ") is found by '" + (inOne ? one : other).name + "' and not by '" +
           (inOne ? other : one).name + "'" + describeBox(pair.first, boxes.at(pair.first)) +
           describeBox(pair.second, boxes.at(pair.second));
}

std::uint64_t framesToPlay(const ReplayOptions& options, const RecordingSummary& summary)
{
    return options.frames == 0 ? summary.info.frames : std::min(options.frames, summary.info.frames);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
