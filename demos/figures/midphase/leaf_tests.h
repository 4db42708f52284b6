// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/row_pair.h"
#include "cullet/demos/figures/midphase/midphase_scene.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What a leaf test answers for the pairs of one frame.
struct LeafAnswers
{
    std::vector<char> isCrossing;  ///< by pair
    std::uint64_t tests = 0;       ///< queries, or blocks of up to eight triangles
};

/// A test of a query (a hull or a triangle) and a triangle whose boxes overlap: do they cross?
class LeafTest
{
public:
    virtual ~LeafTest() = default;

    /// Looks up what is remembered of the pairs, outside of the timing.
    ///
    /// @param pairs (query, triangle), ascending; they and the scene live until the next call
    virtual void setFrame(const MidphaseScene& scene, const std::vector<RowPair>& pairs)
    {
        m_scene = &scene;
        m_pairs = &pairs;
    }

    /// Tests all pairs, from the vertices of the mesh and the poses of the hulls on. Each call does the same work.
    virtual void run(LeafAnswers& answers) = 0;

protected:
    const MidphaseScene* m_scene = nullptr;
    const std::vector<RowPair>* m_pairs = nullptr;
};

struct NamedLeafTest
{
    std::string name;
    std::unique_ptr<LeafTest> test;
};

/// triangles: separating axes, eight triangles at once; a hull is its faces, each of which is compared with the triangle.
/// triangles-1: the same, one triangle at a time. faces: as triangles, only those faces of a hull whose boxes overlap the
/// triangle's. triangle-distance: the distance of two triangles (mid/triangle_pair). isa-gjk, gjk: boolean and distance, with
/// -warm from where the search for the pair ended in the last frame. bullet: btGjkPairDetector.
///
/// A hull whose inside has a triangle without touching it crosses for a GJK only.
std::vector<NamedLeafTest> makeLeafTests(bool hasHulls);
}  // namespace CULLET_PRECISION
}  // namespace cullet
