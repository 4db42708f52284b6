// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

#include <cstdint>
#include <memory>
#include <string>

/// The algorithms of the lecture and of the thesis (docs/references.md) as backends, to compare the product with. No
/// installed library has them. They find the same pairs as every backend.
namespace cullet
{
/// In which of its cells the lecture's grid stores a box.
enum class GridPlacement
{
    AllCoarser,  ///< all cells that it touches, at its level and at all coarser ones: Lesson 04; Mirtich, second method
    OwnLevel,  ///< all cells that it touches, at its own level: Mirtich 1997, first method
    OnePoint,  ///< the one cell of its lowest corner, at its own level: Ericson 2005, section 7.2
    OneGrid  ///< all cells that it touches, in one grid whose cells fit the mean box: uniform grid of Lesson 04
};

/// How the lecture's grid finds a cell.
enum class GridStorage
{
    Chained,         ///< hash with a chain for each bucket
    OpenAddressing,  ///< hash with linear probing
    Array            ///< three-dimensional array that repeats in space, with a chain for each element
};

/// Options of the lecture's grid. Any values give the same pairs.
struct CellsOptions
{
    /// Buckets of the cell hash; 0: as many as needed.
    std::uint32_t bucketCount = 0;
    GridPlacement placement = GridPlacement::AllCoarser;
    GridStorage storage = GridStorage::Chained;
    /// The simple update of Lesson 04, remove and add, instead of the one that touches changed cells only.
    bool updatesByRemoveAndAdd = false;
    /// Mirtich 1997, second method: count for each pair the cells that it shares, so that a box that stays in its cells
    /// costs its counted pairs and nothing else. For GridPlacement::AllCoarser.
    bool countsPairs = false;
    /// Cell width in units of the largest box of its level, at least 1/8; 0: 1, or 2 for GridPlacement::OnePoint. With
    /// GridPlacement::OneGrid in units of the mean box, 2 by default, chosen in each rebuild.
    float cellScale = 0.0f;
    /// Fraction of moved rows above which the grid is cleared and rebuilt instead of updated; negative: automatic,
    /// 0: always rebuild, 1: rebuild only when forced to.
    float rebuildFraction = -1.0f;
};

/// The hierarchical grid of Lesson 04: three-dimensional cells in a hash of buckets, ids stored per cell. Written for
/// clarity more than for speed; one thread.
///
/// Cost: O(rows that changed and their neighbours, plus pairs held) or, when more than rebuildFraction of the rows
/// changed, O(rows and their neighbours).
std::unique_ptr<Backend> makeCellGridBackend(const CellsOptions& options = {});

/// Incremental sweep and prune of Lesson 04, for scenes that move a little and evenly.
std::unique_ptr<Backend> makeSapBackend();

/// Le Grand's uniform grid (GPU Gems 3) on one thread, for boxes of one size.
std::unique_ptr<Backend> makeLeGrandBackend();

/// The steps of the CUDA backend run by the CPU.
std::unique_ptr<Backend> makeHostPsapBackend(const PsapOptions& options = {});

/// How many cells the thesis's search divides the two other axes into, at least: they are nearly square, in full lines.
enum class ThesisCells
{
    Automatic,   ///< cells about three mean extents wide
    Thesis,      ///< one per 64,000 boxes, rounded up: the thesis's ceil(N / 64000)
    FixedCount,  ///< ThesisOptions::cellCount
};

/// Options of the thesis's search: count, scan, fill, radix sort of (cell, start) keys, sweep. Any values give the same
/// pairs. Of PsapOptions, those of the executor, of the neighbour list and `axis` have a meaning.
struct ThesisOptions : PsapOptions
{
    ThesisCells cells = ThesisCells::Automatic;
    std::uint32_t cellCount = 1;  ///< for ThesisCells::FixedCount
    /// Sweep along the principal component of the centres (Liu et al. 2010), which is no world axis, instead of `axis`.
    bool isAxisPrincipal = false;
    bool bitStrings = false;  ///< 8 x 8 second-level cells as bit strings, compared before a test
    bool splitWork = false;   ///< long sweeps are cut into parts of 128 tests
    /// The thesis's shift by cell x scene length in float, which finds false pairs; they are counted
    /// (ComparisonStats::falsePairs) and dropped. Neither bitStrings nor splitWork; no shift along the principal axis.
    bool isShifted = false;
};

/// The thesis's broad phase on the CPU.
std::unique_ptr<Backend> makeHostThesisBackend(const ThesisOptions& options = {});

/// The thesis's broad phase on a GPU, or null with the reason in `*why`, as makeCudaPsapBackend().
std::unique_ptr<Backend> makeCudaThesisBackend(const ThesisOptions& options = {}, std::string* why = nullptr);
}  // namespace cullet
