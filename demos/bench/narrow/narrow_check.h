// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/narrow/narrow_subject.h"

#include <cstdint>
#include <map>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Errors of a library's answers.
struct NarrowErrors
{
    /// Wrong booleans at gaps or depths of at least 1e-6 of the size, missing contacts, and distances and depths that
    /// are off by more than 1e-4.
    std::int64_t wrong = 0;
    double largest = 0.0;  ///< error of a distance or a depth
};

/// Compares answers with the exact ones of their trajectories; depths on a sample, since they cost O(E^2) each.
class NarrowCheck
{
public:
    NarrowCheck(const NarrowTrajectories& trajectories, NarrowQuery query)
        : m_trajectories(trajectories), m_query(query)
    {
    }

    NarrowErrors check(const std::vector<NarrowAnswer>& answers);

private:
    bool isBooleanWrong(std::size_t query, const NarrowAnswer& answer);
    bool isContactMissing(std::size_t query, const NarrowAnswer& answer) const;
    /// Error of the distance or depth; 0 where it is not checked.
    double errorOf(std::size_t query, const NarrowAnswer& answer);
    double depth(std::size_t query);

    const NarrowTrajectories& m_trajectories;
    NarrowQuery m_query;
    std::map<std::size_t, double> m_depths;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
