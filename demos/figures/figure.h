// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/program/files/trace_file.h"

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Options of `cullet figure`.
struct FigureOptions
{
    bool quick = false;                 ///< smaller worlds and fewer frames
    std::vector<std::uint32_t> bodies;  ///< instead of the figure's own sizes; ascending
    std::uint32_t most = 0;             ///< skips larger worlds; 0: the figure's own limit
    double budget = 100;                ///< seconds for each figure, see FigureClock; 0: as long as it takes
    std::uint64_t seed = 12345;
    TraceFile* trace = nullptr;  ///< receives the phases of all frames and steps; figure 11 has none
    bool quiet = false;
};

/// A figure: its measurements form one result file, which demos/plots/plot.py draws.
struct FigureInfo
{
    const char* name;
    const char* summary;
    /// Stops early, with the results so far, when the user interrupts.
    void (*measure)(const FigureOptions& options, ResultFile& file);
};

/// Every figure, in the order of `figure all`.
const std::vector<FigureInfo>& figures();

/// The figure of that name ("10", "cell-size"), or null.
const FigureInfo* findFigure(const std::string& name);

/// Name of the files of a figure, without ending: "figure10", "cell-size".
std::string figureFileName(const std::string& name);

/// Whether a CUDA device answers.
bool hasCudaDevice();

/// The sizes of worlds that a figure measures.
///
/// @param own   the figure's own, ascending
/// @param quick largest size with --quick
/// @param most  the figure's own limit without a GPU
std::vector<std::uint32_t> sizesOf(const FigureOptions& options, const std::vector<std::uint32_t>& own,
                                   std::uint32_t quick, std::uint32_t most);

/// Determines when a figure with growing worlds has to stop: at the user's interrupt, and when the next world would
/// exceed the budget at the last world's time per body. The first world is always measured.
class FigureClock
{
public:
    /// @param share of the budget that this clock has
    FigureClock(const FigureOptions& options, const char* name, double share = 1.0);

    /// To be called before each world; reports skipped worlds on stderr.
    bool hasTimeFor(std::uint32_t bodies);

private:
    using Clock = std::chrono::steady_clock;

    const char* m_name;
    double m_budget;
    Clock::time_point m_start;
    Clock::time_point m_lastStart;
    std::uint32_t m_lastBodies = 0;
};

// docs/results.md explains the figures.

void measureFigure10(const FigureOptions& options, ResultFile& file);
void measureFigure11(const FigureOptions& options, ResultFile& file);
void measureFigure12(const FigureOptions& options, ResultFile& file);
void measureFigure13(const FigureOptions& options, ResultFile& file);
void measureCellSize(const FigureOptions& options, ResultFile& file);
void measureScaling(const FigureOptions& options, ResultFile& file);
void measurePhases(const FigureOptions& options, ResultFile& file);
void measureCrossover(const FigureOptions& options, ResultFile& file);
void measureThreads(const FigureOptions& options, ResultFile& file);
void measureMidphase(const FigureOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
