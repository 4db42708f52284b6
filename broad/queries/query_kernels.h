// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/trees/wide_node.h"
#include "cullet/broad/aabb.h"

#include <cstdint>

namespace cullet
{
/// A ray prepared for conservative float slab tests; made by prepareRay().
///
/// A box is a candidate when, with the near and far plane of every axis chosen by the sign of `inverse`,
/// max((near - nearOrigin) * inverse) <= limit, min((far - farOrigin) * inverse) >= 0 and
/// max(near) <= min(far) * (1 + slack). The origins include the growth of the boxes and the rounding errors.
struct RayQuery
{
    float nearOrigin[3];
    float farOrigin[3];
    float inverse[3];
    float limit;
};

/// Position of a traversal: per level, from a virtual node above the root down, one node and its children still to
/// visit.
struct TreeCursor
{
    std::uint32_t nodes[kMaxWideLevels + 1];
    std::uint32_t pending[kMaxWideLevels + 1];
    int depth;  ///< levels in use; 0: the traversal is over
};

/// A complete tree of eight-lane nodes as the kernels see it: child i of node n is node 8 n + i of the level below.
struct BoxTreeView
{
    const WideNode* levels[kMaxWideLevels];  ///< [0] holds the leaves, whose lanes are rows
    int levelCount;
    const std::uint32_t* rows;  ///< [8 * leaves] the row in each lane of a leaf
};

/// Rows that one call of a kernel may write.
inline constexpr std::uint32_t kQueryBatch = 64;

/// Table boxes to be tested one after the other.
struct ScanView
{
    const Aabb* boxes;          ///< by row
    const std::uint32_t* rows;  ///< [size] the rows to test, or null: the rows 0 .. size - 1
    std::uint32_t size;
};

/// The inner loops of the queries for one instruction set. All sets give the same rows in the same order.
///
/// Each call of a query continues at the cursor or `position`, writes at most kQueryBatch rows and returns their
/// number; zero means that the query is over. Nothing is allocated and nothing shared is written, so calls may run
/// concurrently and nested.
struct QueryKernels
{
    std::uint32_t (*treeOverlap)(const BoxTreeView&, const Aabb&, TreeCursor&, std::uint32_t* rows);
    std::uint32_t (*treeRay)(const BoxTreeView&, const RayQuery&, TreeCursor&, std::uint32_t* rows);
    std::uint32_t (*scanOverlap)(const ScanView&, const Aabb&, std::uint32_t& position, std::uint32_t* rows);
    std::uint32_t (*scanRay)(const ScanView&, const RayQuery&, std::uint32_t& position, std::uint32_t* rows);
    /// Writes eight boxes into the lanes of a node and the box around them into `bounds`; returns the mask of those
    /// that are not empty.
    std::uint32_t (*fillNode)(const Aabb* const* boxes, WideNode& node, Aabb& bounds);
};

extern const QueryKernels kQueryKernelsBaseline;
/// Equal to the baseline where the compiler has no AVX2.
extern const QueryKernels kQueryKernelsAvx2;

/// The fastest kernels that this machine runs, or the baseline ones.
const QueryKernels& queryKernels(bool baselineSimd) noexcept;
}  // namespace cullet
