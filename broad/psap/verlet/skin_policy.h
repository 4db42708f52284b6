// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/psap/verlet/neighbour_steps.h"

#include <cstdint>

namespace cullet::psap
{
/// What is done with a set of boxes.
enum class NeighbourMode
{
    Search,  ///< a search without a neighbour list
    Begin,   ///< a search with skins, which makes a neighbour list
    Follow   ///< no search: the pairs of the neighbour list are tested
};

/// Chooses the mode and the thickness of the skins.
///
/// A list with thick skins lasts longer and contains more pairs, so that the thickness matters little. For a million
/// boxes, beginning a list takes twice as long as a search, following it half as long, so that a list pays from the
/// second time on.
class SkinPolicy
{
public:
    explicit SkinPolicy(PsapNearPairs choice) : m_choice(choice) {}

    /// Mode for the next set of boxes. Its outcome is reported to the record functions below.
    NeighbourMode choose(std::uint64_t boxes);
    /// Mode for a set that could not be followed.
    NeighbourMode search();

    /// Chooses whether the list is followed for the next set, where lists are made after a set for the next ones.
    ///
    /// @param thinnest least thickness of the skins of a new list
    bool chooseFollow(std::uint64_t boxes, float thinnest);
    /// Begins the next list while this set is still followed, where the current list will not last for another one.
    /// Returns whether it does. Assumes that boxes move as far as before; recordFollowed() must not be called for
    /// this set.
    bool tryBeginEarly();
    /// Begins a list after a set, where there is none, or none that lasts. Returns whether it does.
    bool tryBegin(std::uint64_t boxes);

    /// Skins of the next list.
    SkinRule rule() const { return {m_skin}; }
    /// Changes when the rule changes.
    std::uint32_t revision() const { return m_revision; }

    /// Whether the sizes of boxes are to be sampled after this set.
    bool wantsSample(std::uint64_t boxes) const { return isUsed(boxes) && m_setsToSample == 0; }
    void recordSampling() { m_setsToSample = kSetsPerSample; }
    /// Evaluates that sample. @param sample [count] overwritten
    void recordSample(BoxInSample* sample, std::uint64_t count);
    /// @param neighbours pairs in the list, for so many boxes and so many overlapping pairs
    void recordBegun(std::uint64_t neighbours, std::uint64_t boxes, std::uint64_t pairs);
    /// @param displacement since the list was made, in skins; above kMostDisplacement the list was of no use
    void recordFollowed(float displacement);
    /// Discards the list for other reasons.
    void forget() { m_hasList = false; }

private:
    void begin();
    void end(float displacement);
    void pause();
    void endIfExpiring();
    void setSkin();
    bool canBegin() const;
    bool isUsed(std::uint64_t boxes) const
    {
        return m_choice == PsapNearPairs::Automatic ? boxes >= kFewestBoxes
                                                    : m_choice == PsapNearPairs::Always && boxes != 0;
    }

    // Fewer boxes are searched in the time that two launches take.
    static constexpr std::uint64_t kFewestBoxes = 1u << 15;
    // Number of sets for which most boxes are to stay within their skins.
    static constexpr float kFewestSets = 3, kFirstSets = 5, kMostSets = 16;
    // Thickness of skins, in the median of the longest sides.
    static constexpr float kThinnest = 1.0f / 32, kThickest = 0.25f;
    static constexpr std::uint32_t kSetsPerSample = 32, kSetsAfterFastSample = 16;
    static constexpr std::uint32_t kShortestPause = 16, kLongestPause = 512;

    PsapNearPairs m_choice;
    bool m_hasList = false;
    bool m_isSlow = false;  ///< most boxes move short distances
    float m_side = 0;       ///< median of the longest sides
    float m_distance = 0;   ///< distance that 99 % of the boxes do not exceed
    float m_sets = kFirstSets;
    float m_skin = 0;
    float m_thinnest = 0;
    float m_displacement = 0;  ///< since the list was made
    float m_step = 0;          ///< largest growth from one set to the next
    std::uint32_t m_age = 0;
    std::uint32_t m_pause = 0, m_nextPause = kShortestPause;
    std::uint32_t m_setsToSample = 2;  // the first set has no motion
    std::uint32_t m_revision = 0;
};
}  // namespace cullet::psap
