// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
/// Integer coordinates of a cell of one grid level; the key of a row.
struct CellKey
{
    std::int32_t level;
    std::int32_t j;  ///< along the first tiled axis
    std::int32_t k;  ///< along the second tiled axis
};

/// Spatial hash from cells to dense row numbers: hash(i, j, k) = (i p1 xor j p2 xor k p3) mod n with chained buckets.
///
/// Lecture 4, "Spatial Hashing", with Teschner's primes in unsigned arithmetic. Cells are compared on every lookup, so
/// that any number of buckets, even one, is exact.
///
/// Threads: findOrInsert() may run concurrently with itself; the other members may not run beside it.
class RowDirectory
{
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    /// Empties the directory and makes room for `capacity` rows. `bucketCount` 0: twice the rows, a power of two.
    void reset(std::uint32_t capacity, std::uint32_t bucketCount);

    /// Number of the row of a cell, a new one if the cell has none yet; kNone when the room is used up.
    std::uint32_t findOrInsert(const CellKey& key);

    /// Number of the row of a cell, or kNone.
    std::uint32_t find(const CellKey& key) const;

    /// Rows handed out; a few of them may be unused when threads met.
    std::uint32_t size() const;
    std::uint32_t capacity() const { return m_capacity; }
    const CellKey& key(std::uint32_t row) const { return m_nodes[row].key; }
    std::uint64_t bytes() const;

private:
    struct Node
    {
        CellKey key;
        std::uint32_t next;
    };

    std::uint32_t bucket(const CellKey& key) const;
    std::uint32_t findInChain(std::uint32_t node, std::uint32_t end, const CellKey& key) const;

    std::unique_ptr<std::atomic<std::uint32_t>[]> m_heads;
    std::vector<Node> m_nodes;
    std::atomic<std::uint32_t> m_size{0};
    std::uint32_t m_capacity = 0;
    std::uint32_t m_bucketCount = 0;
    std::uint32_t m_bucketMask = 0;
    std::uint32_t m_headCapacity = 0;
};
}  // namespace cullet
