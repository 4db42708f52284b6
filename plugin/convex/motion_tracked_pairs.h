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
        Watching,  ///< of ISA-GJK, tracks its bodies
        Asked,     ///< of ISA-GJK, does not track them
        Other      ///< another algorithm, or none
    };

    void add() noexcept { ++m_total; }
    /// A pair that was added ends tracking.
    void remove() noexcept { --m_total; }
    /// An algorithm of ISA-GJK is created or about to be destroyed.
    void touch(const btCollisionAlgorithm& algorithm) noexcept
    {
        if (m_known.empty())
            return;
        m_anyTouched = true;
        const std::size_t bit = bitOf(reinterpret_cast<std::uintptr_t>(&algorithm));
        m_touched[bit / 64] |= std::uint64_t(1) << bit % 64;
    }
    /// Drops all added pairs; remove() must not be called for them.
    void clear() noexcept
    {
        m_total = 0;
        forget();
    }
    /// Makes the next count read all algorithms. Until then touch() does nothing.
    void forget() noexcept
    {
        m_known.clear();
        m_isListOld = true;
        endCount();
    }
    std::uint64_t total() const { return m_total; }

    /// Begins a count in an array of so many pairs. @return false if out of memory
    bool makeRoom(std::size_t pairs) noexcept
    try
    {
        m_isListOld = m_isListOld || m_known.size() != pairs;
        m_asked.reserve(pairs);
        m_known.resize(pairs);
        return true;
    }
    catch (const std::exception&)
    {
        return false;
    }
    /// The first index from `from` on whose pair is not classified. @pre makeRoom() was true
    std::size_t firstUnknown(const btBroadphasePair* pairs, std::size_t from, std::size_t count) const
    {
        // Local copies, since other writes could alias the members.
        const std::uintptr_t* const known = m_known.data();
        const bool anyTouched = m_anyTouched;
        while (from < count && known[from] != 0 && addressOf(known[from]) == addressOf(pairs[from]) &&
               !(anyTouched && wasTouched(addressOf(known[from]))))
            ++from;
        return from;
    }
    /// @param algorithm null: the pair at this index has none yet
    void note(std::size_t place, const btCollisionAlgorithm* algorithm, Kind kind)
    {
        const std::uintptr_t known = algorithm == nullptr ? 0
                                                          : reinterpret_cast<std::uintptr_t>(algorithm) |
                                                                static_cast<std::uintptr_t>(kind);
        m_isListOld = m_isListOld || m_known[place] != known;
        m_known[place] = known;
    }
    /// Ends a count after all pairs were classified.
    void endCount() noexcept
    {
        if (m_anyTouched)
            m_touched.fill(0);
        m_anyTouched = false;
        if (m_isListOld)
            listAsked();
        m_isListOld = false;
    }

    /// Indices of the pairs of ISA-GJK in the array of the last count, ascending.
    const std::vector<std::uint32_t>& asked() const { return m_asked; }
    /// The number of tracking pairs among them.
    std::uint64_t watching() const { return m_watching; }

private:
    static constexpr int kBits = 14;
    /// An algorithm has a virtual table, so that the lowest bits of its address are 0.
    static constexpr std::uintptr_t kKinds = 3;

    static std::uintptr_t addressOf(std::uintptr_t known) { return known & ~kKinds; }
    static std::uintptr_t addressOf(const btBroadphasePair& pair)
    {
        return reinterpret_cast<std::uintptr_t>(pair.m_algorithm);
    }
    static std::size_t bitOf(std::uintptr_t address)
    {
        return address * std::uint64_t(0x9e3779b97f4a7c15) >> (64 - kBits);
    }
    bool wasTouched(std::uintptr_t address) const
    {
        const std::size_t bit = bitOf(address);
        return (m_touched[bit / 64] >> bit % 64 & 1) != 0;
    }
    /// makeRoom() has reserved the memory.
    void listAsked() noexcept
    {
        m_asked.clear();
        m_watching = 0;
        for (std::size_t place = 0; place < m_known.size(); ++place)
        {
            const auto kind = static_cast<Kind>(m_known[place] & kKinds);
            if (m_known[place] == 0 || kind == Kind::Other)
                continue;
            m_asked.push_back(static_cast<std::uint32_t>(place));
            m_watching += kind == Kind::Watching ? 1 : 0;
        }
    }

    std::uint64_t m_total = 0, m_watching = 0;
    std::vector<std::uintptr_t> m_known;  ///< by index in the array: algorithm and Kind; 0: to be read
    std::vector<std::uint32_t> m_asked;
    bool m_isListOld = false;
    /// A Bloom filter with one hash: addresses at which the algorithm may have changed since the last count.
    std::array<std::uint64_t, (std::size_t(1) << kBits) / 64> m_touched{};
    bool m_anyTouched = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
