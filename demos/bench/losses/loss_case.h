// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/exact_pairs.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// One contestant of a case: cullet, or what cullet replaces, with the case's script.
class LossSide
{
public:
    virtual ~LossSide() = default;

    /// Runs the next part of the script, the same on all sides.
    ///
    /// @return milliseconds of what the case measures; the rest of the script is outside of the timing
    virtual double run() = 0;

    /// The answer after run(): pairs in the pair cache whose boxes overlap now, or hits of queries.
    virtual PairDigest answer() = 0;

    /// The answer of brute force to the same question.
    virtual PairDigest exactAnswer() = 0;

    /// Frees the broad phase.
    ///
    /// @return the bytes that malloc received back; 0 where the case has a world, which holds more than boxes and pairs
    virtual std::uint64_t releaseAndMeasure() { return 0; }
};

struct LossSetup
{
    std::string side;          ///< one of LossCase::sides
    std::uint32_t bodies = 0;  ///< of the script
    int threads = 1;
    std::uint64_t seed = 1;
};

enum class LossMeasure
{
    Time,
    Memory  ///< the target is one of bytes; the time is measured too
};

/// A case in which cullet was slower, or larger, than what it replaces.
struct LossCase
{
    const char* name;
    const char* summary;  ///< what is measured, one line
    std::uint32_t bodies;
    LossMeasure measure;
    double target;  ///< largest allowed ratio of cullet to the second side
    /// The first is cullet, the second is what it replaces.
    std::vector<std::string> sides;
    std::unique_ptr<LossSide> (*make)(const LossSetup&);
    bool needsDouble = false;       ///< the case does not exist in single precision
    std::uint32_t leastBodies = 2;  ///< however few are asked for, unless the case has fewer
};

/// Every case, in reading order.
const std::vector<LossCase>& lossCases();
}  // namespace CULLET_PRECISION
}  // namespace cullet
