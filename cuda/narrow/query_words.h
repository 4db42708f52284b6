// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/contact_queries.h"
#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/cuda/narrow/pair_queries.h"

/// What the public classes of convex pairs take and give, in the words of the queries.
namespace cullet::convex
{
inline QueryExtras extrasOf(const ConvexQuery& query)
{
    // A NaN asks for none.
    QueryExtras extras;
    extras.isMeasured = query.maxDistance >= 0.0f;
    extras.hasPoints = query.contactMargin >= 0.0f;
    extras.isDeep = extras.hasPoints || query.measureDepths;
    extras.isListed = extras.isDeep || query.listOverlaps;
    return extras;
}

inline ConvexPairCounts countsOf(const PairCounts& found)
{
    ConvexPairCounts counts;
    counts.overlapping = found.overlapping;
    counts.undecided = found.undecided;
    counts.invalid = found.invalid;
    counts.failed = found.failed;
    counts.remembered = found.remembered;
    counts.doubtful = found.doubtful;
    return counts;
}

inline void setDepthCounts(const DepthCounts& found, ConvexPairCounts& counts)
{
    counts.largeDepths = found.large;
    counts.examinedDepths = found.examined;
    counts.unprovedDepths = found.unproved;
}

/// The addresses of answers.
///
/// @param last  places of the list, of the query
/// @param count of pairs, or the room for them
template <class Exec>
DevicePairAnswers answersOf(const PairQueries<Exec>& pairs, const ContactQueries<Exec>& contacts,
                            const QueryExtras& extras, std::uint32_t last, std::uint64_t count)
{
    DevicePairAnswers answers;
    answers.states = pairs.states();
    answers.axes = pairs.axes();
    answers.distances = extras.isMeasured ? pairs.distances() : nullptr;
    answers.overlaps = extras.isListed ? pairs.overlaps() : nullptr;
    answers.overlapCount = extras.isListed ? pairs.overlapCount(last) : nullptr;
    answers.count = count;
    answers.depths = extras.isDeep ? contacts.depths() : nullptr;
    answers.contacts = extras.hasPoints ? contacts.contacts() : nullptr;
    answers.room = extras.isDeep ? contacts.room() : 0;
    return answers;
}
}  // namespace cullet::convex
