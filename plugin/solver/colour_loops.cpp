// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/colour_loops.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Blocks for which a part of a colour pays.
constexpr std::size_t kBlocksOfPart = 4;
/// Blocks that one thread solves in less time than threads take to wait for each other.
constexpr std::uint32_t kFewBlocks = 4;
}  // namespace

void ColourLoops::run(const std::vector<ColourLoop>& what, int firstRound, int rounds, ParallelLoops& loops)
{
    plan(what);
    const unsigned parts = loops.tasksFor(m_mostBlocks, kBlocksOfPart);
    if (parts == 1)
    {
        for (int round = firstRound; round < firstRound + rounds; ++round)
        {
            for (const Step& step : m_steps)
                what[step.loop].body({step.begin, step.end, 0, round});
        }
        return;
    }
    const auto stagesOfRound = static_cast<unsigned>(m_stages.size());
    const auto runStage = [&](unsigned number, unsigned part, unsigned thread)
    {
        const Stage& stage = m_stages[number % stagesOfRound];
        if (stage.isAlone && part != 0)
            return;
        for (std::uint32_t i = stage.begin; i < stage.end; ++i)
        {
            const Step& step = m_steps[i];
            const TaskRange range(step.end - step.begin, stage.isAlone ? 0 : part, stage.isAlone ? 1 : parts);
            if (range.begin < range.end)
                what[step.loop].body({step.begin + range.begin, step.begin + range.end, thread,
                                      firstRound + static_cast<int>(number / stagesOfRound)});
        }
    };
    m_loop.run(loops, parts, stagesOfRound * static_cast<unsigned>(std::max(rounds, 0)), runStage);
}

void ColourLoops::plan(const std::vector<ColourLoop>& what)
{
    m_steps.clear();
    m_stages.clear();
    m_mostBlocks = 0;
    for (std::uint32_t loop = 0; loop < what.size(); ++loop)
    {
        for (const BlockPlan::Colour& colour : *what[loop].colours)
        {
            const std::uint32_t blocks = colour.end - colour.begin;
            const bool isAlone = colour.isSerial || blocks <= kFewBlocks;
            if (!isAlone)
                m_mostBlocks = std::max<std::size_t>(m_mostBlocks, blocks);
            const auto step = static_cast<std::uint32_t>(m_steps.size());
            m_steps.push_back({loop, colour.begin, colour.end});
            if (isAlone && !m_stages.empty() && m_stages.back().isAlone)
                m_stages.back().end = step + 1;
            else
                m_stages.push_back({step, step + 1, isAlone});
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
