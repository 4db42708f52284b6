// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/row_pair.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/narrow/hull/hull.h"

#include <Eigen/Core>

#include <cstddef>
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
    /// The first body of each pair stays as it is. Its pose is that of row k for pair k, and all those that move come
    /// after them, so that one copy brings a frame's changes to a device.
    bool isFirstAtRest = false;
};

/// Frames of pairs of hulls with planted gaps and depths. Bodies 2 k and 2 k + 1 are pair k, or with isFirstAtRest k and
/// k + the number of pairs; it stays as far apart as its kind. The hulls are 64 ellipsoids with random points, of sizes
/// about 1.
class ConvexMotion
{
public:
    explicit ConvexMotion(const ConvexMotionOptions& options);

    const HullSet& hulls() const { return m_set; }
    /// The same hulls in double, of the same points.
    const std::vector<Hull<double>>& exactHulls() const { return m_exact; }
    /// The same hulls once more, in float.
    const std::vector<Hull<float>>& floatHulls() const { return m_float; }
    const std::vector<RowPair>& pairs() const { return m_pairs; }
    const std::vector<BodyPose>& frame(int index) const { return m_frames[static_cast<std::size_t>(index)]; }
    int frameCount() const { return static_cast<int>(m_frames.size()); }
    /// The frame of a step of a motion to the last frame and back: neighbours in the sequence are neighbours in time.
    int frameAt(int step) const;
    /// The poses from this row on differ from frame to frame.
    std::size_t firstMoving() const { return m_firstMoving; }
    /// How many pairs have been planted with a depth.
    std::uint32_t overlapping() const { return m_overlapping; }
    /// Whether this one has.
    bool isPlantedDeep(std::uint32_t pair) const;
    /// @throws std::runtime_error if another number of pairs was found to overlap
    void requireOverlapping(std::uint32_t found) const;

private:
    void plant(std::uint32_t pair, const ConvexMotionOptions& options);

    HullSet m_set;
    GapShares m_shares;
    std::vector<Hull<double>> m_exact;
    std::vector<Hull<float>> m_float;
    std::vector<Eigen::Vector3d> m_centres;  ///< a point inside of each hull
    std::vector<RowPair> m_pairs;
    std::vector<std::vector<BodyPose>> m_frames;
    std::size_t m_firstMoving = 0;
    std::uint32_t m_overlapping = 0;
};

/// Whether a depth is proved to 1e-4 of the size of a pair of these hulls.
bool isProved(const PairDepth& depth);
}  // namespace cullet
