// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Classifies the pairs in the array of a pair cache by whether they track their bodies, and counts those that do.
///
/// Bodies of a pair in the array exist, otherwise Bullet's own dispatch would read destroyed objects. A pair that has
/// left the array without destruction of its algorithm (Bullet leaks those of pairs removed without a dispatcher) may
/// have lost its bodies. So bodies are read only if the array contains all tracking pairs.
///
/// An array entry is read again only if its algorithm differs from the last count, or an algorithm of ISA-GJK was
/// created or destroyed at its address since. So a pair of another algorithm costs one comparison.
class MotionTrackedPairs
{
public:
    /// The kind of a pair's algorithm.
    enum class Kind : std::uintptr_t
    {
        Tracking,   ///< of ISA-GJK, tracks its bodies
        Untracked,  ///< of ISA-GJK, does not track them
        Other       ///< another algorithm, or none
    };

    void add() noexcept { ++m_trackingTotal; }
    /// A pair that was added ends tracking.
    void remove() noexcept { --m_trackingTotal; }
    /// An algorithm of ISA-GJK is created or about to be destroyed.
    void touch(const btCollisionAlgorithm& algorithm) noexcept
    {
        if (m_entries.empty())
            return;
        m_hasChanges = true;
        const std::size_t bit = bitOf(reinterpret_cast<std::uintptr_t>(&algorithm));
        m_changedAddresses[bit / 64] |= std::uint64_t(1) << bit % 64;
    }
    /// Drops all added pairs; remove() must not be called for them.
    void clear() noexcept
    {
        m_trackingTotal = 0;
        forget();
    }
    /// Makes the next count read all algorithms. Until then touch() does nothing.
    void forget() noexcept
    {
        m_entries.clear();
        m_isListStale = true;
        endCount();
    }
    std::uint64_t trackingTotal() const { return m_trackingTotal; }

    /// Whether the pairs of an array are those of the last count, so that none need be counted.
    bool areClassified(const btBroadphasePair* pairs, std::size_t count) const
    {
        return !m_hasChanges && !m_isListStale && m_entries.size() == count &&
               firstUnclassified(pairs, 0, count) == count;
    }
    /// Begins a count in an array of so many pairs. @return false if out of memory
    bool tryReserve(std::size_t pairs) noexcept
    try
    {
        m_isListStale = m_isListStale || m_entries.size() != pairs;
        m_isaGjkPairs.reserve(pairs);
        m_entries.resize(pairs);
        return true;
    }
    catch (const std::exception&)
    {
        return false;
    }
    /// The first index from `from` on whose pair is not classified. @pre tryReserve() was true
    std::size_t firstUnclassified(const btBroadphasePair* pairs, std::size_t from, std::size_t count) const
    {
        // Local copies, since other writes could alias the members.
        const std::uintptr_t* const entry = m_entries.data();
        const bool hasChanges = m_hasChanges;
        while (from < count && entry[from] != 0 && addressOf(entry[from]) == addressOf(pairs[from]) &&
               !(hasChanges && mayHaveChanged(addressOf(entry[from]))))
            ++from;
        return from;
    }
    /// @param algorithm null: the pair at this index has none yet
    void record(std::size_t place, const btCollisionAlgorithm* algorithm, Kind kind)
    {
        const std::uintptr_t entry = algorithm == nullptr ? 0
                                                          : reinterpret_cast<std::uintptr_t>(algorithm) |
                                                                static_cast<std::uintptr_t>(kind);
        m_isListStale = m_isListStale || m_entries[place] != entry;
        m_entries[place] = entry;
    }
    /// Ends a count after all pairs were classified.
    void endCount() noexcept
    {
        if (m_hasChanges)
            m_changedAddresses.fill(0);
        m_hasChanges = false;
        if (m_isListStale)
            rebuildList();
        m_isListStale = false;
    }

    /// Indices of the pairs of ISA-GJK in the array of the last count, ascending.
    const std::vector<std::uint32_t>& isaGjkPairs() const { return m_isaGjkPairs; }
    /// The number of tracking pairs among them.
    std::uint64_t trackingCount() const { return m_trackingCount; }

private:
    static constexpr int kBits = 14;
    /// An algorithm has a virtual table, so that the lowest bits of its address are 0.
    static constexpr std::uintptr_t kKinds = 3;

    static std::uintptr_t addressOf(std::uintptr_t entry) { return entry & ~kKinds; }
    static std::uintptr_t addressOf(const btBroadphasePair& pair)
    {
        return reinterpret_cast<std::uintptr_t>(pair.m_algorithm);
    }
    static std::size_t bitOf(std::uintptr_t address)
    {
        return address * std::uint64_t(0x9e3779b97f4a7c15) >> (64 - kBits);
    }
    bool mayHaveChanged(std::uintptr_t address) const
    {
        const std::size_t bit = bitOf(address);
        return (m_changedAddresses[bit / 64] >> bit % 64 & 1) != 0;
    }
    /// tryReserve() has reserved the memory.
    void rebuildList() noexcept
    {
        m_isaGjkPairs.clear();
        m_trackingCount = 0;
        for (std::size_t place = 0; place < m_entries.size(); ++place)
        {
            const auto kind = static_cast<Kind>(m_entries[place] & kKinds);
            if (m_entries[place] == 0 || kind == Kind::Other)
                continue;
            m_isaGjkPairs.push_back(static_cast<std::uint32_t>(place));
            m_trackingCount += kind == Kind::Tracking ? 1 : 0;
        }
    }

    std::uint64_t m_trackingTotal = 0, m_trackingCount = 0;
    std::vector<std::uintptr_t> m_entries;  ///< by index in the array: algorithm and Kind; 0: to be read
    std::vector<std::uint32_t> m_isaGjkPairs;
    bool m_isListStale = false;
    /// A Bloom filter with one hash: addresses at which the algorithm may have changed since the last count.
    std::array<std::uint64_t, (std::size_t(1) << kBits) / 64> m_changedAddresses{};
    bool m_hasChanges = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
