// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/staged_loop.h"
#include "cullet/plugin/solver/block_plan.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Blocks of a plan that a thread solves one after the other, none of which depends on the others unless their colour is
/// serial.
struct BlockRange
{
    std::uint32_t begin, end;
    unsigned thread;
    int round;
};

/// A loop over blocks, colour by colour.
struct ColourLoop
{
    const std::vector<BlockPlan::Colour>* colours;
    std::function<void(const BlockRange& range)> body;
};

/// Runs loops over blocks on several threads. A thread gets the same part of a colour in all loops over the same blocks.
class ColourLoops
{
public:
    /// Runs loops one after the other, and all of them again in each round.
    void run(const std::vector<ColourLoop>& what, int firstRound, int rounds, ParallelLoops& loops);
    /// One loop, once.
    void run(const ColourLoop& what, ParallelLoops& loops) { run({what}, 0, 1, loops); }

private:
    /// A colour of a loop.
    struct Step
    {
        std::uint32_t loop, begin, end;
    };
    /// Steps that all threads do together, or the first part alone because they are short.
    struct Stage
    {
        std::uint32_t begin, end;  ///< of m_steps
        bool isAlone;
    };

    void plan(const std::vector<ColourLoop>& what);

    std::vector<Step> m_steps;
    std::vector<Stage> m_stages;
    std::size_t m_mostBlocks = 0;  ///< of a step
    StagedLoop m_loop;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
