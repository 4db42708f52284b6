// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/psap/verlet/skin_policy.h"

#include <algorithm>
#include <cstddef>

namespace cullet::psap
{
namespace
{
// Beyond these limits quotients and sums lose precision.
constexpr float kSmallest = 1e-30f, kLargest = 1e30f;

/// The quantile of a value over the sample, by selection.
template <class Get>
float quantile(BoxInSample* sample, std::uint64_t count, double share, const Get& get)
{
    BoxInSample* const place = sample + static_cast<std::ptrdiff_t>(share * static_cast<double>(count - 1));
    std::nth_element(sample, place, sample + count,
                     [&](const BoxInSample& a, const BoxInSample& b) { return get(a) < get(b); });
    return get(*place);
}
}  // namespace

NeighbourMode SkinPolicy::choose(std::uint64_t boxes)
{
    if (chooseFollow(boxes, 0))
        return NeighbourMode::Follow;
    return isUsed(boxes) ? search() : NeighbourMode::Search;
}

bool SkinPolicy::chooseFollow(std::uint64_t boxes, float thinnest)
{
    m_thinnest = thinnest;
    if (!isUsed(boxes))
    {
        forget();
        return false;
    }
    m_setsToSample -= m_setsToSample != 0 ? 1 : 0;
    endIfExpiring();
    return m_hasList;
}

bool SkinPolicy::tryBeginEarly()
{
    const float expected = m_displacement + m_step;
    const bool isLast = expected <= kMostDisplacement && !(expected + m_step <= kMostDisplacement);
    if (!m_hasList || !isLast || m_pause != 0 || !canBegin())
        return false;
    recordFollowed(expected);
    end(expected + m_step);
    return search() == NeighbourMode::Begin;
}

bool SkinPolicy::tryBegin(std::uint64_t boxes)
{
    endIfExpiring();
    return isUsed(boxes) && !m_hasList && search() == NeighbourMode::Begin;
}

void SkinPolicy::endIfExpiring()
{
    if (m_hasList && !(m_displacement + m_step <= kMostDisplacement))
        end(m_displacement + m_step);
}

NeighbourMode SkinPolicy::search()
{
    if (m_pause != 0)
        --m_pause;
    else if (canBegin())
    {
        begin();
        return NeighbourMode::Begin;
    }
    return NeighbourMode::Search;
}

bool SkinPolicy::canBegin() const
{
    const bool isThin = m_choice == PsapNearPairs::Always || m_thinnest <= kThickest * m_side;
    return m_isSlow && isThin && m_thinnest < kLargest;
}

void SkinPolicy::begin()
{
    if (m_skin < m_thinnest)
        setSkin();
    m_hasList = true;
    m_displacement = m_step = 0;
    m_age = 0;
}

void SkinPolicy::recordSample(BoxInSample* sample, std::uint64_t count)
{
    BoxInSample* const end =
        std::remove_if(sample, sample + count, [](const BoxInSample& box) { return box.side < 0; });
    const auto bounded = static_cast<std::uint64_t>(end - sample);
    m_isSlow = false;
    if (bounded == 0)
        return;
    m_side = quantile(sample, bounded, 0.5, [](const BoxInSample& box) { return box.side; });
    m_distance = quantile(sample, bounded, 0.99, [](const BoxInSample& box) { return box.distance; });
    // A list pays if it is followed at least twice.
    m_isSlow =
        m_side > kSmallest && (m_choice == PsapNearPairs::Always || 2 * m_distance <= kThickest * m_side);
    if (m_isSlow)
        setSkin();
    else
        m_setsToSample = std::min(m_setsToSample, kSetsAfterFastSample);
}

void SkinPolicy::recordBegun(std::uint64_t neighbours, std::uint64_t boxes, std::uint64_t pairs)
{
    // More than thick skins cause for boxes of equal size: most of the pairs are due to other boxes.
    constexpr std::uint64_t kMostPerPair = 6;
    if (neighbours > kMostPerPair * (boxes + pairs))
        pause();
}

void SkinPolicy::recordFollowed(float displacement)
{
    if (!(displacement <= kMostDisplacement))
        return end(displacement);
    ++m_age;
    m_nextPause = m_age > 2 ? kShortestPause : m_nextPause;
    m_step = std::max(m_step, displacement - m_displacement);
    m_displacement = displacement;
}

/// Adapts the skins after a list that has expired.
void SkinPolicy::end(float displacement)
{
    // A larger displacement is a teleported or created box, for which thicker skins do not help.
    constexpr float kHeldByThicker = 4;
    constexpr std::uint32_t kFewSets = 3, kManySets = 64;
    constexpr float kMore = 1.5f, kFewer = 0.7f;
    m_hasList = false;
    if (m_age < kFewSets && m_sets < kMostSets && displacement < kHeldByThicker)
        m_sets = std::min(kMore * m_sets, kMostSets);
    else if (m_age < 2)
        pause();
    else if (m_age > kManySets)
        m_sets = std::max(kFewer * m_sets, kFewestSets);
    setSkin();
}

void SkinPolicy::setSkin()
{
    // Where nearly all boxes rest, their motion would give no skin at all; the few moving ones need one.
    const float distance = std::max(m_distance, kThinnest * m_side / kFirstSets);
    const float wanted = std::clamp(m_sets * distance, kThinnest * m_side, kThickest * m_side);
    const float skin = std::max(wanted, m_thinnest);
    // Small changes do not matter, but would void recorded launches and plans.
    if (skin > 0.8f * m_skin && skin < 1.25f * m_skin && m_skin >= m_thinnest)
        return;
    m_skin = skin;
    ++m_revision;
}

void SkinPolicy::pause()
{
    if (m_choice == PsapNearPairs::Always)
        return;
    m_hasList = false;
    m_pause = m_nextPause;
    m_nextPause = std::min(2 * m_nextPause, kLongestPause);
}
}  // namespace cullet::psap
