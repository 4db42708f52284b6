// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_check.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr double kUndecided = 1e-6;
constexpr double kLargestError = 1e-4;
/// Stride of the queries of a trajectory whose depths are checked.
constexpr std::size_t kDepthStride = 101;

bool needsContacts(NarrowQuery query)
{
    return query == NarrowQuery::Contacts || isBulletsOwn(query);
}
}  // namespace

NarrowErrors NarrowCheck::check(const std::vector<NarrowAnswer>& answers)
{
    NarrowErrors errors;
    for (std::size_t i = 0; i < answers.size(); ++i)
    {
        if (isThroughDispatcher(m_query))
        {
            // A manifold also keeps points of earlier frames, whose distances are estimates.
            errors.wrong += m_query == NarrowQuery::Still ? !std::isnan(answers[i].distance)
                                                          : isContactMissing(i, answers[i]);
            continue;
        }
        if (isBooleanWrong(i, answers[i]) || isContactMissing(i, answers[i]))
        {
            ++errors.wrong;
            continue;
        }
        const double error = errorOf(i, answers[i]);
        errors.wrong += error > kLargestError;
        errors.largest = std::max(errors.largest, error);
    }
    return errors;
}

bool NarrowCheck::isBooleanWrong(std::size_t query, const NarrowAnswer& answer)
{
    const Bounds& truth = m_trajectories.truth(query);
    if (answer.isOverlapping == truth.isInside)
        return false;
    return (truth.isInside ? depth(query) : static_cast<double>(truth.upper)) >= kUndecided;
}

bool NarrowCheck::isContactMissing(std::size_t query, const NarrowAnswer& answer) const
{
    const double gap = static_cast<double>(m_trajectories.truth(query).upper);
    return needsContacts(m_query) && std::isnan(answer.distance) && gap < kContactDistance - kUndecided;
}

double NarrowCheck::errorOf(std::size_t query, const NarrowAnswer& answer)
{
    const Bounds& truth = m_trajectories.truth(query);
    const bool isBoolean = m_query == NarrowQuery::Boolean;
    if (isBoolean || answer.isOverlapping != truth.isInside || std::isnan(answer.distance))
        return 0.0;
    if (!truth.isInside)
        return std::abs(answer.distance - static_cast<double>(truth.upper));
    const bool isSampled = query % kDepthStride == 0;
    return needsContacts(m_query) && isSampled ? std::abs(answer.distance + depth(query)) : 0.0;
}

double NarrowCheck::depth(std::size_t query)
{
    const auto [place, isNew] = m_depths.try_emplace(query, 0.0);
    if (isNew)
        place->second = m_trajectories.depth(query);
    return place->second;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
