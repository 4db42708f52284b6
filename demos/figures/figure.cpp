// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/figures/figure.h"

#include "cullet/broad/backend.h"
#include "cullet/demos/program/interrupt.h"

#include <algorithm>
#include <cstdio>

namespace cullet
{
inline namespace CULLET_PRECISION
{
const std::vector<FigureInfo>& figures()
{
    static const std::vector<FigureInfo> all = {
        {"10", "time against bodies: the thesis's cells, cells of size 3, and ours", measureFigure10},
        {"11", "ISA-GJK against triangles, with and without hill climbing", measureFigure11},
        {"12", "pairs against bodies, beside what probability expects", measureFigure12},
        {"13", "broad and narrow phase of the whole system against bodies", measureFigure13},
        {"cell-size", "time against the size of a cell", measureCellSize},
        {"scaling", "time against bodies, with fitted exponents, beside DBVT", measureScaling},
        {"phases", "share of each phase of Bullet's step, before and after", measurePhases},
        {"crossover", "where a GPU begins to pay", measureCrossover},
        {"threads", "speed-up by threads", measureThreads},
        {"midphase",
         "GJK against triangle tests at the leaves of a mesh's tree, and trees of meshes that deform",
         measureMidphase},
    };
    return all;
}

const FigureInfo* findFigure(const std::string& name)
{
    for (const FigureInfo& figure : figures())
    {
        if (name == figure.name)
            return &figure;
    }
    return nullptr;
}

std::string figureFileName(const std::string& name)
{
    const bool isOfTheThesis = name.find_first_not_of("0123456789") == std::string::npos;
    return isOfTheThesis ? "figure" + name : name;
}

bool hasCudaDevice()
{
    static const bool answer = []
    {
        std::string why;
        return makeCudaPsapBackend({}, &why) != nullptr;
    }();
    return answer;
}

FigureClock::FigureClock(const FigureOptions& options, const char* name, double share)
    : m_name(name), m_budget(options.budget * share), m_start(Clock::now()), m_lastStart(m_start)
{
}

bool FigureClock::hasTimeFor(std::uint32_t bodies)
{
    if (isInterrupted())
        return false;
    const Clock::time_point now = Clock::now();
    const auto seconds = [now](Clock::time_point since)
    { return std::chrono::duration<double>(now - since).count(); };
    const double growth = m_lastBodies == 0 ? 0.0 : double(bodies) / m_lastBodies;
    if (m_budget > 0.0 && seconds(m_start) + growth * seconds(m_lastStart) > m_budget && m_lastBodies != 0)
    {
        std::fprintf(
            stderr,
            "figure %s: without worlds of %u bodies and more, for which %.0f s are too few (--budget)\n",
            m_name, bodies, m_budget);
        return false;
    }
    m_lastStart = now;
    m_lastBodies = bodies;
    return true;
}

std::vector<std::uint32_t> sizesOf(const FigureOptions& options, const std::vector<std::uint32_t>& own,
                                   std::uint32_t quick, std::uint32_t most)
{
    if (!options.bodies.empty())
        return options.bodies;
    std::uint32_t limit = hasCudaDevice() ? own.back() : most;
    if (options.quick)
        limit = quick;
    if (options.most != 0)
        limit = options.most;
    std::vector<std::uint32_t> sizes;
    std::copy_if(own.begin(), own.end(), std::back_inserter(sizes),
                 [limit](std::uint32_t bodies) { return bodies <= limit; });
    return sizes;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
