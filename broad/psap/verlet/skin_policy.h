// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/psap/verlet/neighbour_steps.h"

#include <cstdint>

namespace cullet::psap
{
/// What is done with a set of boxes.
enum class NearFrame
{
    Search,  ///< searched, and nothing kept for the next
    Begin,   ///< searched with skins: the near pairs are kept
    Follow   ///< not searched: what has become of the near pairs
};

/// Chooses that, and how thick skins are.
///
/// A list with thick skins is of use for longer, and there is more in it: how thick they are matters little. To begin one takes
/// a million boxes twice as long as a search, to follow it half as long, so it pays from the second time on.
class SkinPolicy
{
public:
    explicit SkinPolicy(PsapNearPairs choice) : m_choice(choice) {}

    /// For the next set of so many boxes; tell what comes of it below.
    NearFrame choose(std::uint64_t boxes);
    /// For one that could not be followed.
    NearFrame search();

    /// The same where lists are made behind a set, for the next ones: whether the next set is followed.
    ///
    /// @param thinnest that skins may be in a list that begins
    bool follows(std::uint64_t boxes, float thinnest);
    /// Whether a list begins behind a set that is being followed, since the one of now will not last for another. Boxes are
    /// expected to go as far as before; noteFollowed() is not to be told of this set.
    bool beginsAhead();
    /// Whether a list begins behind a set, since there is none, or none that lasts.
    bool beginsBehind(std::uint64_t boxes);

    /// For a list that begins.
    SkinRule rule() const { return {m_skin}; }
    /// Changes where the rule does.
    std::uint32_t revision() const { return m_revision; }

    /// Whether sizes are to be looked at after this set of boxes.
    bool wantsSample(std::uint64_t boxes) const { return isUsed(boxes) && m_setsToSample == 0; }
    void noteSampling() { m_setsToSample = kSetsPerSample; }
    /// What was seen then. @param sample [count] overwritten
    void noteSample(BoxInSample* sample, std::uint64_t count);
    /// @param near pairs, of so many boxes, that overlap in so many pairs
    void noteBegun(std::uint64_t near, std::uint64_t boxes, std::uint64_t pairs);
    /// @param stretch how far boxes have gone since the list began, in skins: more than kMostStretch where it was of no use
    void noteFollowed(float stretch);
    /// The list is gone for other reasons.
    void forget() { m_hasList = false; }

private:
    void begin();
    void end(float stretch);
    void pause();
    void endUnlessLasting();
    void setSkin();
    bool canBegin() const;
    bool isUsed(std::uint64_t boxes) const
    {
        return m_choice == PsapNearPairs::Automatic ? boxes >= kFewestBoxes
                                                    : m_choice == PsapNearPairs::Always && boxes != 0;
    }

    // Fewer are searched in the time that it takes to begin two steps.
    static constexpr std::uint64_t kFewestBoxes = 1u << 15;
    // Sets of boxes that most boxes are in their skins for.
    static constexpr float kFewestSets = 3, kFirstSets = 5, kMostSets = 16;
    // Skins in longest sides of the median.
    static constexpr float kThinnest = 1.0f / 32, kThickest = 0.25f;
    static constexpr std::uint32_t kSetsPerSample = 32, kSetsAfterJump = 16;
    static constexpr std::uint32_t kShortestPause = 16, kLongestPause = 512;

    PsapNearPairs m_choice;
    bool m_hasList = false;
    bool m_isSlow = false;  ///< most boxes go short ways
    float m_side = 0;       ///< median of the longest sides
    float m_way = 0;        ///< that 99 of 100 boxes go at most
    float m_sets = kFirstSets;
    float m_skin = 0;
    float m_thinnest = 0;
    float m_stretch = 0;  ///< of the list
    float m_step = 0;     ///< the most that it has grown by from one set of boxes to the next
    std::uint32_t m_age = 0;
    std::uint32_t m_pause = 0, m_nextPause = kShortestPause;
    std::uint32_t m_setsToSample = 2;  // nothing has gone anywhere in the first
    std::uint32_t m_revision = 0;
};
}  // namespace cullet::psap
