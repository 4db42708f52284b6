// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/grid_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cullet
{
namespace
{
// Nanoseconds on a 2023 server core, 8-lane kernels; only their ratios matter.
constexpr double kCostOfEntry = 16.0;      // gather, sort and transpose one box into a column
constexpr double kCostOfProbe = 3.0;       // look up one cell of a coarser level
constexpr double kCostOfCandidate = 0.25;  // one lane of the forward scan

constexpr double kWidthSteps[] = {1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128, 256, 1024, 4096};

/// A range of octaves that share one level, with mean extents: tiled t, along the sweep s. Means of products are not
/// products of means: where a level holds sizes over decades, few large boxes make most of the entries and tests.
struct Band
{
    double count = 0;
    double tile = 0;        // t
    double sweep = 0;       // s
    double tile2 = 0;       // t^2
    double tileSweep = 0;   // t s
    double tile2Sweep = 0;  // t^2 s
    std::int32_t top = 0;

    /// Mean entries of a box in columns of a width.
    double copies(double width) const { return 1 + 2 * tile / width + tile2 / (width * width); }

    /// Mean extent of an entry, not of a box, along the sweep axis.
    double entrySweep(double width) const
    {
        return (sweep + 2 * tileSweep / width + tile2Sweep / (width * width)) / copies(width);
    }
};

struct World
{
    double sweepSpan;
    double tileSpanY;
    double tileSpanZ;
    double density;
};

struct LevelCost
{
    double nanoseconds = std::numeric_limits<double>::infinity();
    double candidates = 0;
    double width = 1;
};

Band merge(const Band& a, const Band& b)
{
    Band merged;
    merged.count = a.count + b.count;
    for (double Band::*const mean :
         {&Band::tile, &Band::sweep, &Band::tile2, &Band::tileSweep, &Band::tile2Sweep})
        merged.*mean = (a.*mean * a.count + b.*mean * b.count) / merged.count;
    merged.top = std::max(a.top, b.top);
    return merged;
}

/// Share of the cross-section that a column and the boxes that stick out of it cover, at most all.
double sectionShare(double width, const Band& band, const World& world)
{
    const double side = width * std::sqrt(band.copies(width));
    return std::min(1.0, side / world.tileSpanY) * std::min(1.0, side / world.tileSpanZ);
}

/// Cost of one level of width `width`: its own boxes, and the finer ones that are regular in it.
LevelCost costOfLevel(const std::vector<Band>& bands, std::size_t level, double width, const World& world)
{
    const Band& own = bands[level];
    const double entries = own.count * own.copies(width);
    const double sweep = own.entrySweep(width);
    const double perSpan = world.density / world.sweepSpan;
    LevelCost cost;
    cost.width = width;
    cost.candidates = entries * own.count * sectionShare(width, own, world) * std::min(1.0, sweep * perSpan);
    cost.nanoseconds = entries * kCostOfEntry;
    for (std::size_t finer = 0; finer < level; ++finer)
    {
        const Band& other = bands[finer];
        const double occupied = std::min(1.0, own.count * sectionShare(width, own, world));
        cost.nanoseconds += other.count * (kCostOfProbe + other.copies(width) * occupied * kCostOfEntry);
        cost.candidates += entries * other.count * sectionShare(width, other, world) *
                           std::min(1.0, (sweep + other.entrySweep(width)) * perSpan);
    }
    cost.nanoseconds += cost.candidates * kCostOfCandidate;
    return cost;
}

LevelCost bestLevel(const std::vector<Band>& bands, std::size_t level, const World& world, float cellScale)
{
    const double top = std::ldexp(1.0, bands[level].top);
    if (cellScale > 0)
        return costOfLevel(bands, level, top * cellScale, world);
    LevelCost best;
    for (const double step : kWidthSteps)
    {
        const LevelCost cost = costOfLevel(bands, level, top * step, world);
        if (cost.nanoseconds < best.nanoseconds)
            best = cost;
    }
    return best;
}

double totalCost(const std::vector<Band>& bands, const World& world, float cellScale)
{
    double sum = 0;
    for (std::size_t level = 0; level < bands.size(); ++level)
        sum += bestLevel(bands, level, world, cellScale).nanoseconds;
    return sum;
}

std::vector<Band> occupiedOctaves(const SizeHistogram& sizes)
{
    std::vector<Band> bands;
    for (std::int32_t o = 0; o < kOctaveCount; ++o)
    {
        const SizeHistogram::Bin& bin = sizes.bins[static_cast<std::size_t>(o)];
        if (bin.count == 0)
            continue;
        // Within an octave extents differ by a factor of two at most.
        const double tile = bin.tileSum / bin.count;
        const double sweep = bin.sweepSum / bin.count;
        bands.push_back({static_cast<double>(bin.count), tile, sweep, tile * tile, tile * sweep,
                         tile * tile * sweep, o + kLowestOctave});
    }
    return bands;
}

/// Removes the largest octaves while they hold one box by the sample. A giant box is tested against all others or
/// fills many columns, which costs less than a level of its own or columns as wide as the box.
void leaveOutGiant(std::vector<Band>& bands, std::uint32_t weight)
{
    while (bands.size() > 1 && bands.back().count <= weight)
    {
        weight -= static_cast<std::uint32_t>(bands.back().count);
        bands.pop_back();
    }
}

/// Merges equal numbers of neighbouring bands until kMaxLevels are left: mergeGreedily() costs their fourth power.
void mergeEvenly(std::vector<Band>& bands)
{
    const std::size_t group = (bands.size() + kMaxLevels - 1) / kMaxLevels;
    std::vector<Band> merged;
    for (std::size_t i = 0; i < bands.size(); ++i)
    {
        if (i % group == 0)
            merged.push_back(bands[i]);
        else
            merged.back() = merge(merged.back(), bands[i]);
    }
    bands = std::move(merged);
}

/// Merges neighbouring bands while that is cheaper, or until there are `limits.levels` of them.
///
/// @return cost of the remaining bands
double mergeGreedily(std::vector<Band>& bands, const World& world, const GridPlanLimits& limits)
{
    double cost = totalCost(bands, world, limits.cellScale);
    while (bands.size() > std::max(limits.levels, 1u))
    {
        double bestCost = std::numeric_limits<double>::infinity();
        std::vector<Band> best;
        for (std::size_t i = 0; i + 1 < bands.size(); ++i)
        {
            std::vector<Band> trial = bands;
            trial[i] = merge(bands[i], bands[i + 1]);
            trial.erase(trial.begin() + static_cast<std::ptrdiff_t>(i) + 1);
            const double trialCost = totalCost(trial, world, limits.cellScale);
            if (trialCost < bestCost)
            {
                bestCost = trialCost;
                best = std::move(trial);
            }
        }
        if (bestCost >= cost && limits.levels == 0)
            return cost;
        bands = std::move(best);
        cost = bestCost;
    }
    return cost;
}

/// Cost of all bands as one level.
double costOfOneLevel(const std::vector<Band>& bands, const World& world, float cellScale)
{
    Band all = bands.front();
    for (std::size_t i = 1; i < bands.size(); ++i)
        all = merge(all, bands[i]);
    return totalCost({all}, world, cellScale);
}
}  // namespace

void SizeHistogram::add(const SizeHistogram& other)
{
    weight = std::max(weight, other.weight);
    for (std::size_t i = 0; i < bins.size(); ++i)
    {
        bins[i].count += other.bins[i].count;
        bins[i].tileSum += other.bins[i].tileSum;
        bins[i].sweepSum += other.bins[i].sweepSum;
    }
}

std::uint32_t SizeHistogram::count() const
{
    std::uint32_t sum = 0;
    for (const Bin& bin : bins)
        sum += bin.count;
    return sum;
}

void measureSpans(const Aabb* boxes, const std::uint32_t* proxyRows, std::uint32_t count, float span[3])
{
    constexpr std::uint32_t kSample = 256;
    // The sample gives extents to within a few per cent. The stride is odd so that regular scenes are not aliased.
    const std::uint32_t stride = std::max(1u, count / kSample) | 1u;
    std::vector<float> centres;
    centres.reserve(kSample * 2);
    for (int axis = 0; axis < 3; ++axis)
    {
        centres.clear();
        for (std::uint32_t i = 0; i < count; i += stride)
        {
            const Aabb& box = boxes[proxyRows != nullptr ? proxyRows[i] : i];
            const float centre = 0.5f * box.min[axis] + 0.5f * box.max[axis];
            if (isValid(box) && std::abs(centre) < 1e15f)
                centres.push_back(centre);
        }
        span[axis] = 0;
        if (centres.size() < 2)
            continue;
        std::sort(centres.begin(), centres.end());
        const std::size_t low = centres.size() / 20;
        span[axis] = (centres[centres.size() - 1 - low] - centres[low]) * 1.1f;
    }
}

int chooseSweepAxis(const float span[3], int previous)
{
    int best = previous;
    for (int axis = 0; axis < 3; ++axis)
    {
        if (span[axis] > 1.25f * span[best])
            best = axis;
    }
    return best;
}

GridPlan makeGridPlan(const SizeHistogram& sizes, const float span[3], int sweepAxis, double density,
                      const GridPlanLimits& limits)
{
    GridPlan plan;
    plan.sweepAxis = sweepAxis;
    plan.tileAxisY = (sweepAxis + 1) % 3;
    plan.tileAxisZ = (sweepAxis + 2) % 3;

    std::vector<Band> bands = occupiedOctaves(sizes);
    if (bands.empty())
        return plan;
    leaveOutGiant(bands, sizes.weight);
    const double largest = std::ldexp(1.0, bands.back().top);
    const World world = {std::max<double>(span[plan.sweepAxis], bands.back().sweep + 1e-30),
                         std::max<double>(span[plan.tileAxisY], largest),
                         std::max<double>(span[plan.tileAxisZ], largest), density};
    mergeEvenly(bands);
    plan.allLevelsCost = totalCost(bands, world, limits.cellScale);
    plan.oneLevelCost = costOfOneLevel(bands, world, limits.cellScale);
    plan.cost = mergeGreedily(bands, world, limits);

    plan.levelCount = static_cast<std::uint32_t>(bands.size());
    for (std::size_t level = 0; level < bands.size(); ++level)
    {
        const LevelCost cost = bestLevel(bands, level, world, limits.cellScale);
        const double width = std::max<double>(cost.width, limits.leastWidth);
        plan.width[level] = static_cast<float>(width);
        plan.inverseWidth[level] = static_cast<float>(1.0 / width);
        plan.narrowest = level == 0 ? plan.width[0] : std::min(plan.narrowest, plan.width[level]);
        plan.predictedCandidates += cost.candidates;
    }
    std::uint8_t level = 0;
    for (std::int32_t o = 0; o < kOctaveCount; ++o)
    {
        while (level + 1u < plan.levelCount && o + kLowestOctave > bands[level].top)
            ++level;
        plan.levelOfOctave[static_cast<std::size_t>(o)] = level;
    }
    return plan;
}
}  // namespace cullet
