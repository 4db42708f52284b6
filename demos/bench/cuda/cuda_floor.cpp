// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_floor.h"

#include "cullet/broad/aabb.h"
#include "cullet/broad/pair.h"
#include "cullet/broad/row_pair.h"

namespace cullet
{
namespace
{
constexpr std::uint64_t kBox = sizeof(Aabb), kPair = sizeof(RowPair), kRow = sizeof(std::uint32_t);
constexpr std::uint64_t kRecord = 32;
constexpr std::uint64_t kFlag = 1, kCloseness = 4;

/// Expected number of held pairs with a moved box, where moving boxes are drawn at random.
std::uint64_t pairsToTest(const UpdateWork& work)
{
    const double resting =
        1.0 - static_cast<double>(work.moved) / static_cast<double>(work.bodies == 0 ? 1 : work.bodies);
    return static_cast<std::uint64_t>(static_cast<double>(work.held) * (1.0 - resting * resting));
}
}  // namespace

double CopySpeed::floorOf(const LeastBytes& bytes) const
{
    if (device <= 0 || bus <= 0)
        return 0;
    return static_cast<double>(bytes.device) / device + static_cast<double>(bytes.bus) / bus;
}

LeastBytes leastForPairs(std::uint64_t bodies, std::uint64_t pairs)
{
    return {bodies * kBox + pairs * kPair, 0};
}

LeastBytes leastForDeltas(std::uint64_t bodies, std::uint64_t pairs)
{
    return {bodies * kBox + 2 * pairs * kPair, 0};
}

LeastBytes leastForStage(const std::string& stage, const UpdateWork& work)
{
    const bool isScattered = work.moved < work.bodies;
    if (stage == "upload")
        return {work.moved * (3 * kBox + 2 * kFlag), work.moved * (kBox + (isScattered ? kRow : 0))};
    if (stage == "sort")
        return {work.bodies * (kBox + kRecord), 0};
    if (stage == "settle")
        return {work.held * (2 * kPair + (isScattered ? 2 * kFlag : 0)) + pairsToTest(work) * 2 * kBox, 0};
    if (stage == "follow")
        return {work.held * (kPair + 2 * kFlag + kCloseness), 0};
    if (stage == "search")
        return {work.bodies * kRecord, 0};
    if (stage == "deltas")
        return {0, work.changes * sizeof(Pair)};
    return {};
}
}  // namespace cullet
