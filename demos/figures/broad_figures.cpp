// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/broad_options.h"
#include "cullet/demos/bench/frames_bench.h"
#include "cullet/demos/figures/figure.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/scenes/box_scene.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <thread>

// The figures from `bench broad`: runFramesBench() measures each case and checks the pairs.
namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Names = std::vector<std::string>;

/// Cubic numbers, which are evenly spaced on the thesis's cubic axis.
const std::vector<std::uint32_t> kCubes = {1000,   8000,   27000,   64000,   125000,
                                           216000, 512000, 1000000, 4096000, 16777216};

BroadOptions broadOptions(const FigureOptions& options, const Names& backends)
{
    BroadOptions broad;
    broad.backends = backends;
    broad.threads = 1;
    broad.frames = options.quick ? 5 : 9;
    broad.warmup = options.quick ? 1 : 3;
    broad.budget = options.quick ? 1.0 : 6.0;
    broad.seed = options.seed;
    broad.trace = options.trace;
    broad.quiet = options.quiet;
    return broad;
}

void measure(const BroadOptions& broad, const std::string& scene, std::uint32_t bodies, ResultFile& file)
{
    if (!isInterrupted())
        runFramesBench({broad, scene, bodies, false}, file);
}

/// Side of the cube that a scene fills.
double sideOf(const std::string& scene, std::uint32_t bodies, std::uint64_t seed)
{
    const auto boxes = findBoxScene(scene)->make({bodies, false, seed});
    double side = 0.0;
    for (const Aabb& box : boxes->boxes())
        side = std::max({side, double(box.max[0]), double(box.max[1]), double(box.max[2])});
    return side;
}

/// "psap-cells:N" for square cells of this edge.
std::string cellsOfEdge(const std::string& prefix, double side, double edge)
{
    const double across = std::max(1.0, std::ceil(side / edge));
    return prefix + std::to_string(static_cast<std::uint64_t>(across * across));
}

/// The thesis's fixed cells: one and a half times as wide as a sphere of radius 1.
constexpr double kFixedEdge = 3.0;

Names backendsOfFigure10(std::uint32_t bodies, std::uint64_t seed)
{
    constexpr std::uint32_t kMaxOnCpu = 1000000;
    constexpr std::uint32_t kMaxByThesisOnCpu = 216000;
    constexpr std::uint32_t kMaxByThesisOnGpu = 1000000;
    const double side = sideOf("W1", bodies, seed);
    Names names;
    if (bodies <= kMaxByThesisOnCpu)
        names.emplace_back("psap-thesis");
    if (bodies <= kMaxOnCpu)
        names.insert(names.end(), {cellsOfEdge("psap-cells:", side, kFixedEdge), "psap-literal", "psap"});
    names.emplace_back("grid");
    if (!hasCudaDevice())
        return names;
    if (bodies <= kMaxByThesisOnGpu)
        names.emplace_back("cuda-thesis");
    names.insert(names.end(), {cellsOfEdge("cuda-cells:", side, kFixedEdge), "cuda-literal", "cuda"});
    return names;
}

struct Line
{
    double sumX = 0, sumY = 0, sumXX = 0, sumXY = 0;
    int count = 0;

    void add(double x, double y)
    {
        sumX += x;
        sumY += y;
        sumXX += x * x;
        sumXY += x * y;
        ++count;
    }

    double slope() const { return (count * sumXY - sumX * sumY) / (count * sumXX - sumX * sumX); }
};

/// CPU time, which varies less for one thread; wall time for a GPU.
double timeOf(const Json& row)
{
    return row[row["backend"] == "cuda" ? "median_ms" : "cpu_median_ms"].get<double>();
}

/// Exponent of time against bodies by least squares of the logarithms, for each backend with two sizes or more.
std::map<std::string, Line> fitExponents(const std::vector<Json>& rows)
{
    std::map<std::string, Line> lines;
    for (const Json& row : rows)
        lines[row["backend"].get<std::string>() + " through " + row["through"].get<std::string>()].add(
            std::log(row["bodies"].get<double>()), std::log(timeOf(row)));
    return lines;
}

std::string numbered(const std::string& prefix, double number)
{
    return prefix + Json(number).dump();
}

/// @param edges width of a cell in sides of a box by name of a backend; 0: the backend's own choice
void measureWidths(const FigureOptions& options, const std::string& scene, std::uint32_t bodies,
                   const std::map<std::string, double>& edges, ResultFile& file)
{
    Names names;
    std::transform(edges.begin(), edges.end(), std::back_inserter(names),
                   [](const auto& entry) { return entry.first; });
    ResultFile measured({}, "", "");
    measure(broadOptions(options, names), scene, bodies, measured);
    for (Json row : measured.rows())
    {
        const double edge = edges.at(row["backend"]);
        row["cell_edge"] = edge == 0.0 ? Json() : Json(edge);
        file.addRow(std::move(row));
    }
}

void addWithExponents(const ResultFile& measured, ResultFile& file)
{
    const std::map<std::string, Line> lines = fitExponents(measured.rows());
    for (Json row : measured.rows())
    {
        const Line& line =
            lines.at(row["backend"].get<std::string>() + " through " + row["through"].get<std::string>());
        row["exponent"] = line.count < 2 ? Json() : Json(line.slope());
        file.addRow(std::move(row));
    }
    for (const auto& [name, line] : lines)
    {
        if (line.count >= 2)
            std::printf("%-28s time grows as bodies^%.2f\n", name.c_str(), line.slope());
    }
}
}  // namespace

void measureFigure10(const FigureOptions& options, ResultFile& file)
{
    FigureClock clock(options, "10");
    for (const std::uint32_t bodies : sizesOf(options, kCubes, 64000, 1000000))
    {
        if (!clock.hasTimeFor(bodies))
            return;
        const BroadOptions broad = broadOptions(options, backendsOfFigure10(bodies, options.seed));
        measure(broad, "W1", bodies, file);
    }
}

void measureCellSize(const FigureOptions& options, ResultFile& file)
{
    constexpr double kBoxSide = 2.0;
    FigureClock clock(options, "cell-size");
    for (const std::uint32_t bodies : sizesOf(options, {16000, 64000}, 16000, 64000))
    {
        if (!clock.hasTimeFor(bodies))
            return;
        const double side = sideOf("W1", bodies, options.seed);
        std::map<std::string, double> edges = {
            {"psap-thesis", 0.0}, {"psap-literal", 0.0}, {"grid", 0.0}, {"legrand", 0.0}};
        for (const double edge : {1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0})
        {
            edges[cellsOfEdge("psap-cells:", side, edge * kBoxSide)] = edge;
            edges[numbered("grid-rows:", edge)] = edge;
        }
        // Cell widths of the backend are powers of two.
        for (const double edge : {1.0, 2.0, 4.0, 8.0})
            edges[numbered("uniform:", edge)] = edge;
        measureWidths(options, "W1", bodies, edges, file);
    }
    // Hard cases for one cell size: box sizes over three decades, and locally dense boxes.
    const std::vector<std::uint32_t> sizes = sizesOf(options, {4000, 16000}, 16000, 16000);
    if (sizes.empty())
        return;
    std::map<std::string, double> edges = {{"grid", 0.0}, {"grid-cells", 0.0}, {"legrand", 0.0}};
    for (const double edge : {0.5, 1.0, 2.0, 4.0, 8.0})
        edges[numbered("uniform:", edge)] = edge;
    for (const char* scene : {"W2", "pile"})
        measureWidths(options, scene, sizes.back(), edges, file);
}

void measureScaling(const FigureOptions& options, ResultFile& file)
{
    constexpr std::uint32_t kMaxThroughBullet = 1000000;
    const std::uint32_t mostForTree = options.quick ? 16000 : 256000;
    ResultFile measured({}, "", "");
    FigureClock clock(options, "scaling");
    for (const std::uint32_t bodies :
         sizesOf(options, {1000, 4000, 16000, 64000, 256000, 1000000, 4000000, 16000000}, 64000, 4000000))
    {
        if (!clock.hasTimeFor(bodies))
            break;
        BroadOptions broad = broadOptions(options, {"grid"});
        if (hasCudaDevice())
            broad.backends.emplace_back("cuda");
        measure(broad, "W1", bodies, measured);
        broad.through = "bullet";
        broad.backends = {"grid"};
        if (bodies <= mostForTree)
            broad.backends.insert(broad.backends.end(), {"dbvt", "dbvt-deferred"});
        if (bodies <= kMaxThroughBullet)
            measure(broad, "W1", bodies, measured);
    }
    addWithExponents(measured, file);
}

void measureCrossover(const FigureOptions& options, ResultFile& file)
{
    Names names = {"grid"};
    if (hasCudaDevice())
        names.emplace_back("cuda");
    for (const char* scene : {"W1", "W3fresh"})
    {
        FigureClock clock(options, "crossover", 1.0 / 2.0);
        for (const std::uint32_t bodies :
             sizesOf(options, {512, 1024, 2048, 4096, 8192, 16384, 32768, 65536}, 16384, 65536))
        {
            if (!clock.hasTimeFor(bodies))
                break;
            measure(broadOptions(options, names), scene, bodies, file);
        }
    }
}

void measureThreads(const FigureOptions& options, ResultFile& file)
{
    const int cores = static_cast<int>(std::thread::hardware_concurrency());
    for (const char* scene : {"W1", "W2", "W5"})
    {
        FigureClock clock(options, "threads", 1.0 / 3.0);
        for (const std::uint32_t bodies : sizesOf(options, {64000, 1000000}, 64000, 1000000))
        {
            if (!clock.hasTimeFor(bodies))
                break;
            for (int threads = 1; threads <= cores; threads *= 2)
            {
                BroadOptions broad = broadOptions(options, {"grid"});
                broad.threads = threads;
                measure(broad, scene, bodies, file);
            }
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
