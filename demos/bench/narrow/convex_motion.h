// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/row_pair.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/narrow/hull/hull.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace cullet
{
/// The margin of all contacts that are measured.
inline constexpr float kContactMargin = 0.02f;

/// How many of a hundred pairs are how far apart.
struct GapShares
{
    int separated = 80;  ///< gaps from .03 to .08
    int near = 15;       ///< gaps from .001 to .003
    // The others overlap, .01 to .05 deep.
};

struct ConvexMotionOptions
{
    std::uint32_t pairs = 1000000;
    int vertices = 42;
    GapShares shares;
    double degrees = 1.0;  ///< a body turns by one to three times as much in each frame
    int frames = 8;
    unsigned seed = 12345;
};

/// Frames of pairs of hulls with planted gaps and depths. Bodies 2 k and 2 k + 1 are pair k, which stays as far apart
/// as its kind. The hulls are 64 ellipsoids with random points, of sizes about 1.
class ConvexMotion
{
public:
    explicit ConvexMotion(const ConvexMotionOptions& options);

    const HullSet& hulls() const { return m_set; }
    /// The same hulls in double, of the same points.
    const std::vector<Hull<double>>& exactHulls() const { return m_exact; }
    const std::vector<RowPair>& pairs() const { return m_pairs; }
    const std::vector<BodyPose>& frame(int index) const { return m_frames[static_cast<std::size_t>(index)]; }
    int frameCount() const { return static_cast<int>(m_frames.size()); }
    /// How many pairs have been planted with a depth.
    std::uint32_t overlapping() const { return m_overlapping; }

private:
    void plant(std::uint32_t pair, const ConvexMotionOptions& options);

    HullSet m_set;
    std::vector<Hull<double>> m_exact;
    std::vector<Eigen::Vector3d> m_centres;  ///< a point inside of each hull
    std::vector<RowPair> m_pairs;
    std::vector<std::vector<BodyPose>> m_frames;
    std::uint32_t m_overlapping = 0;
};

/// Whether a depth is proved to 1e-4 of the size of a pair of these hulls.
bool isProved(const PairDepth& depth);
}  // namespace cullet
