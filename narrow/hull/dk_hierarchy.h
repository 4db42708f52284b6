// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/debug_containers.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Nested convex hulls of fewer and fewer of a hull's corners: level 0 is the hull, and from each level an independent
/// set of corners of low degree is removed to get the next coarser one.
///
/// Dobkin and Kirkpatrick 1985, "A Linear Algorithm for Determining the Separation of Convex Polyhedra", and the
/// thesis, section 6.2.1. Let s be the support corner of level i + 1. The corners of level i above s along the
/// direction are connected and were all removed, so there is at most one, and it was a neighbour of s: the search
/// compares only these neighbours. Ties may lead it astray; a climb on the whole hull has to follow.
///
/// Memory: O(n), since levels shrink geometrically.
class DkHierarchy
{
public:
    struct Range
    {
        const std::int32_t* first;
        const std::int32_t* last;
        const std::int32_t* begin() const { return first; }
        const std::int32_t* end() const { return last; }
    };

    bool isBuilt() const { return !m_top.empty(); }
    /// Number of levels coarser than the hull, O(log n).
    std::int32_t levelCount() const { return m_levelCount; }
    /// Vertices of the coarsest hull.
    const std::vector<std::int32_t>& top() const { return m_top; }
    /// Neighbours of a vertex that were removed at a level. @pre the vertex is in the next coarser level
    Range removed(std::int32_t level, std::int32_t vertex) const
    {
        const std::size_t place = static_cast<std::size_t>(m_first[vertex] + level);
        return {m_removed.data() + m_begin[place], m_removed.data() + m_begin[place + 1]};
    }

private:
    friend class DkBuilder;

    std::int32_t m_levelCount = 0;
    std::vector<std::int32_t> m_top;
    std::vector<std::int32_t> m_first;    ///< by vertex: its entry in m_begin for level 0
    std::vector<std::int32_t> m_begin;    ///< by vertex and level: first place in m_removed
    std::vector<std::int32_t> m_removed;  ///< vertices
};
}  // namespace cullet
