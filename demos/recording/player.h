// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/recording/recording_file.h"
#include "cullet/demos/scenes/bodies/broadphase_factory.h"

#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Interface of a broad phase that plays a recording.
class Player
{
public:
    virtual ~Player() = default;

    virtual const std::string& name() const = 0;
    virtual int threads() const = 0;

    /// Applies the events before a frame. Timed.
    virtual void apply(const std::vector<BoxEvent>& events) = 0;

    /// Finds the pairs. Timed.
    virtual void findPairs() = 0;

    /// The held pairs of ids that are pairs of these boxes now, sorted. A margin may keep more pairs.
    virtual Pairs pairs(const RecordedBoxes& boxes) = 0;

    /// Held pairs, including those kept by a margin.
    virtual std::uint64_t heldPairs() = 0;
};

/// A broad phase by name (broadphaseNames()) behind Bullet's interface; "exact": the reference, all pairs by a sweep in
/// each frame.
///
/// @throws std::invalid_argument for an unknown name; std::runtime_error if it cannot run here
std::unique_ptr<Player> makePlayer(const std::string& name, int threads, const RecordingSummary& summary);

/// A player for each name.
std::vector<std::unique_ptr<Player>> makePlayers(const std::vector<std::string>& names, int threads,
                                                 const RecordingSummary& summary);
}  // namespace CULLET_PRECISION
}  // namespace cullet
