// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/named_backends.h"

#include "cullet/comparison/backends.h"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

namespace cullet
{
namespace
{
using Made = std::unique_ptr<Backend>;

template <class Change>
Made makeCells(Change change)
{
    CellsOptions options;
    change(options);
    return makeCellGridBackend(options);
}

/// @param width of a cell in mean boxes; 0: automatic
Made makeUniform(double width)
{
    return makeCells(
        [width](CellsOptions& options)
        {
            options.placement = GridPlacement::OneGrid;
            options.rebuildFraction = 1;
            options.cellScale = static_cast<float>(width);
        });
}

template <class Change>
Made makePsap(int threads, Change change)
{
    PsapOptions options;
    options.executor = PsapExecutor::Threads;
    options.threads = threads;
    change(options);
    return makeHostPsapBackend(options);
}

template <class Change>
Made makeLiteral(int threads, Change change)
{
    ThesisOptions options;
    options.executor = PsapExecutor::Threads;
    options.threads = threads;
    change(options);
    return makeHostThesisBackend(options);
}

template <class Change>
Made makeGrid(int threads, Change change)
{
    GridOptions options;
    options.threads = threads;
    change(options);
    return makeGridBackend(options);
}

/// A grid with a choice of its cost model fixed by the user.
NamedBackend fixedWidth(const char* name, const char* what, float scale)
{
    return {name, what, [scale](int threads) {
                return makeGrid(threads, [scale](GridOptions& options) { options.cellScale = scale; });
            }};
}

NamedBackend fixedLevels(const char* name, const char* what, std::uint32_t levels)
{
    return {name, what, [levels](int threads) {
                return makeGrid(threads, [levels](GridOptions& options) { options.levels = levels; });
            }};
}

template <class Options>
Made makeCuda(Made (*make)(const Options&, std::string*), const Options& options)
{
    std::string why;
    Made backend = make(options, &why);
    if (!backend)
        throw std::runtime_error("backend cuda: " + why);
    return backend;
}

/// Whether the backend is the grid with one of its choices fixed.
bool isChoice(const std::string& name)
{
    return name.rfind("grid-", 0) == 0 && name != "grid-cells";
}

template <class Change>
Made makeCudaLiteral(Change change)
{
    ThesisOptions options;
    change(options);
    return makeCuda(makeCudaThesisBackend, options);
}

void setCells(ThesisOptions& options, double count)
{
    options.cells = ThesisCells::FixedCount;
    options.cellCount = static_cast<std::uint32_t>(std::min(std::max(count, 1.0), 1e9));
}

/// The number after the colon.
double numberOf(const std::string& name)
{
    const std::string text = name.substr(name.find(':') + 1);
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(number > 0.0) || !(number < 1e9))
        throw std::invalid_argument("backend '" + name +
                                    "': a number > 0 and < 1e9 expected after the colon");
    return number;
}

// The number of cells of Liu et al. for scenes of this size; enough for the shift to show its rounding.
constexpr std::uint32_t kSomeCells = 1024;
}  // namespace

const std::vector<NamedBackend>& namedBackends()
{
    static const std::vector<NamedBackend> backends = {
        {"grid", "cullet: the hierarchical grid on the CPU, rows",
         [](int threads) { return makeGrid(threads, [](GridOptions&) {}); }},
        {"grid-cells", "cullet: the same with the lecture's cells",
         [](int) { return makeCells([](CellsOptions&) {}); }},
        {"brute", "cullet: every box against every other", [](int) { return makeBruteForceBackend(); }},
        {"cuda", "cullet on an NVIDIA GPU", [](int) { return makeCuda(makeCudaPsapBackend, {}); }},
        {"cuda-literal", "psap-literal on an NVIDIA GPU",
         [](int) { return makeCudaLiteral([](ThesisOptions&) {}); }},
        {"cuda-thesis", "psap-thesis on an NVIDIA GPU",
         [](int)
         { return makeCudaLiteral([](ThesisOptions& options) { options.cells = ThesisCells::Thesis; }); }},
        {"uniform", "the lecture's uniform grid: one size of cells for all boxes, only changed cells touched",
         [](int) { return makeUniform(0); }},
        {"cells-incremental", "cells, only changed ones are touched",
         [](int) { return makeCells([](CellsOptions& options) { options.rebuildFraction = 1; }); }},
        {"cells-rebuild", "cells, cleared and filled in every update",
         [](int) { return makeCells([](CellsOptions& options) { options.rebuildFraction = 0; }); }},
        {"cells-simple", "cells, a box that moved is removed and added",
         [](int)
         {
             return makeCells(
                 [](CellsOptions& options)
                 {
                     options.rebuildFraction = 1;
                     options.updatesByRemoveAndAdd = true;
                 });
         }},
        {"cells-open", "cells in a hash with open addressing",
         [](int)
         { return makeCells([](CellsOptions& options) { options.storage = GridStorage::OpenAddressing; }); }},
        {"cells-array", "cells in an array that repeats in space",
         [](int) { return makeCells([](CellsOptions& options) { options.storage = GridStorage::Array; }); }},
        {"cells-mirtich1", "Mirtich's first method: cells of a box's own level",
         [](int)
         { return makeCells([](CellsOptions& options) { options.placement = GridPlacement::OwnLevel; }); }},
        {"cells-mirtich2", "Mirtich's second method: all coarser levels, counted pairs",
         [](int)
         {
             return makeCells(
                 [](CellsOptions& options)
                 {
                     options.countsPairs = true;
                     options.rebuildFraction = 1;
                 });
         }},
        {"cells-ericson", "Ericson's grid: one cell per box",
         [](int)
         { return makeCells([](CellsOptions& options) { options.placement = GridPlacement::OnePoint; }); }},
        {"legrand", "Le Grand's grid: sorted cell ids, cells as large as the largest box",
         [](int) { return makeLeGrandBackend(); }},
        {"sap", "incremental sweep and prune", [](int) { return makeSapBackend(); }},
        {"psap", "subdivision and sweep and prune on CPU threads, rows",
         [](int threads) { return makePsap(threads, [](PsapOptions&) {}); }},
        {"psap-literal", "the thesis's steps; axis by variance, cells by extents",
         [](int threads) { return makeLiteral(threads, [](ThesisOptions&) {}); }},
        {"psap-x", "psap-literal along the x axis",
         [](int threads)
         { return makeLiteral(threads, [](ThesisOptions& options) { options.axis = PsapAxis::X; }); }},
        {"psap-random", "psap-literal with a random axis",
         [](int threads)
         { return makeLiteral(threads, [](ThesisOptions& options) { options.axis = PsapAxis::Random; }); }},
        {"psap-principal", "psap-literal with the principal component as the axis",
         [](int threads)
         { return makeLiteral(threads, [](ThesisOptions& options) { options.isAxisPrincipal = true; }); }},
        {"psap-bits", "psap-literal with second-level bit strings",
         [](int threads)
         { return makeLiteral(threads, [](ThesisOptions& options) { options.bitStrings = true; }); }},
        {"psap-split", "psap-literal with work split by length",
         [](int threads)
         { return makeLiteral(threads, [](ThesisOptions& options) { options.splitWork = true; }); }},
        {"psap-thesis", "psap-literal with one cell per 64,000 boxes",
         [](int threads) {
             return makeLiteral(threads, [](ThesisOptions& options) { options.cells = ThesisCells::Thesis; });
         }},
        {"psap-thesis-bits", "psap-thesis with second-level bit strings",
         [](int threads)
         {
             return makeLiteral(threads,
                                [](ThesisOptions& options)
                                {
                                    options.cells = ThesisCells::Thesis;
                                    options.bitStrings = true;
                                });
         }},
        {"psap-1024", "psap-literal with 1,024 cells",
         [](int threads)
         {
             return makeLiteral(threads,
                                [](ThesisOptions& options)
                                {
                                    options.cells = ThesisCells::FixedCount;
                                    options.cellCount = kSomeCells;
                                });
         }},
        {"psap-shifted", "psap-1024 with the thesis's shift in float",
         [](int threads)
         {
             return makeLiteral(threads,
                                [](ThesisOptions& options)
                                {
                                    options.isShifted = true;
                                    options.cells = ThesisCells::FixedCount;
                                    options.cellCount = kSomeCells;
                                });
         }},
        {"grid-refill", "grid, rows cleared and filled in every update",
         [](int threads)
         { return makeGrid(threads, [](GridOptions& options) { options.rebuildFraction = 0; }); }},
        {"grid-moving", "grid that never settles",
         [](int threads)
         { return makeGrid(threads, [](GridOptions& options) { options.settles = false; }); }},
        {"grid-settled", "grid that always settles",
         [](int threads)
         { return makeGrid(threads, [](GridOptions& options) { options.rebuildFraction = 1; }); }},
        fixedWidth("grid-width-1", "grid, cells as wide as the largest box of their level", 1),
        fixedWidth("grid-width-2", "grid, cells twice as wide", 2),
        fixedWidth("grid-width-4", "grid, cells four times as wide", 4),
        fixedWidth("grid-width-8", "grid, cells eight times as wide", 8),
        fixedLevels("grid-levels-1", "grid with one level", 1),
        fixedLevels("grid-levels-2", "grid with two levels, where there are two octaves of sizes", 2),
        fixedLevels("grid-levels-4", "grid with four levels, where there are four octaves of sizes", 4),
    };
    return backends;
}

const std::vector<NumberedBackend>& numberedBackends()
{
    static const std::vector<NumberedBackend> backends = {
        {"psap-cells:N", "psap-literal with N cells",
         [](int threads, double number)
         { return makeLiteral(threads, [=](ThesisOptions& options) { setCells(options, number); }); }},
        {"psap-rows:N", "psap with rows of N largest boxes width",
         [](int threads, double number) {
             return makePsap(threads,
                             [=](PsapOptions& options) { options.cellScale = static_cast<float>(number); });
         }},
        {"grid-rows:N", "grid with rows of N largest boxes width",
         [](int threads, double number) {
             return makeGrid(threads,
                             [=](GridOptions& options) { options.cellScale = static_cast<float>(number); });
         }},
        {"uniform:N", "uniform with cells of N mean boxes width",
         [](int, double number) { return makeUniform(number); }},
        {"cuda-cells:N", "psap-cells:N on an NVIDIA GPU",
         [](int, double number)
         { return makeCudaLiteral([=](ThesisOptions& options) { setCells(options, number); }); }},
    };
    return backends;
}

std::string listedName(const std::string& name)
{
    const std::size_t colon = name.find(':');
    return colon == std::string::npos ? name : name.substr(0, colon) + ":N";
}

std::unique_ptr<Backend> makeBackend(const std::string& name, int threads)
{
    for (const NamedBackend& backend : namedBackends())
    {
        if (name == backend.name)
            return backend.make(threads);
    }
    for (const NumberedBackend& backend : numberedBackends())
    {
        if (listedName(name) == backend.name)
            return backend.make(threads, numberOf(name));
    }
    return nullptr;
}

std::vector<std::string> ablationNames()
{
    std::vector<std::string> names;
    for (const NamedBackend& backend : namedBackends())
    {
        const std::string name = backend.name;
        if (name != "brute" && name.compare(0, 4, "cuda") != 0 && !isChoice(name))
            names.push_back(name);
    }
    return names;
}

std::vector<std::string> choiceNames()
{
    std::vector<std::string> names = {"grid"};
    for (const NamedBackend& backend : namedBackends())
    {
        if (isChoice(backend.name))
            names.push_back(backend.name);
    }
    return names;
}
}  // namespace cullet
