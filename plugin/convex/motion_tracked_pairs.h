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
/// Knows of each pair in the array of its pair cache whether it watches its bodies, and counts those that do.
///
/// Bodies of a pair in the array exist, or Bullet's own dispatch would read what is gone. Of a pair that has left it and whose
/// algorithm has not been destroyed (Bullet leaks those of pairs removed without a dispatcher) nothing is known. So bodies are
/// read only after as many watching pairs were found in the array as there are.
///
/// An algorithm need not be read again where it was in the last count, unless one of ISA-GJK has come or gone at its address
/// since: so a pair of another algorithm costs one comparison.
class MotionTrackedPairs
{
public:
    /// What a pair's algorithm is.
    enum class Kind : std::uintptr_t
    {
        Watching,  ///< of ISA-GJK, and watches its bodies
        Asked,     ///< of ISA-GJK
        Other      ///< another one, or none
    };

    void add() noexcept { ++m_total; }
    /// Of a pair that was added, and watches no longer.
    void remove() noexcept { --m_total; }
    /// An algorithm of ISA-GJK is made, or about to be destroyed.
    void touch(const btCollisionAlgorithm& algorithm) noexcept
    {
        if (m_known.empty())
            return;
        m_anyTouched = true;
        const std::size_t bit = bitOf(reinterpret_cast<std::uintptr_t>(&algorithm));
        m_touched[bit / 64] |= std::uint64_t(1) << bit % 64;
    }
    /// None that was added counts any more, and none of them may be removed.
    void clear() noexcept
    {
        m_total = 0;
        forget();
    }
    /// The next count reads all algorithms. From here to there touch() does nothing.
    void forget() noexcept
    {
        m_known.clear();
        m_isListOld = true;
        endCount();
    }
    std::uint64_t total() const { return m_total; }

    /// Before a count in an array of so many pairs. @return false without memory
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
    /// The first place from here on of whose pair nothing is known. @pre room was made for the count
    std::size_t firstUnknown(const btBroadphasePair* pairs, std::size_t from, std::size_t count) const
    {
        // Copies, which no write to memory can change.
        const std::uintptr_t* const known = m_known.data();
        const bool anyTouched = m_anyTouched;
        while (from < count && known[from] != 0 && addressOf(known[from]) == addressOf(pairs[from]) &&
               !(anyTouched && wasTouched(addressOf(known[from]))))
            ++from;
        return from;
    }
    /// @param algorithm null: the pair at this place has none yet
    void note(std::size_t place, const btCollisionAlgorithm* algorithm, Kind kind)
    {
        const std::uintptr_t known = algorithm == nullptr ? 0
                                                          : reinterpret_cast<std::uintptr_t>(algorithm) |
                                                                static_cast<std::uintptr_t>(kind);
        m_isListOld = m_isListOld || m_known[place] != known;
        m_known[place] = known;
    }
    /// When every place was known or noted.
    void endCount() noexcept
    {
        if (m_anyTouched)
            m_touched.fill(0);
        m_anyTouched = false;
        if (m_isListOld)
            listAsked();
        m_isListOld = false;
    }

    /// In the last count: places of the pairs of ISA-GJK in the array, ascending.
    const std::vector<std::uint32_t>& asked() const { return m_asked; }
    /// Those of them that watch.
    std::uint64_t watching() const { return m_watching; }

private:
    static constexpr int kBits = 14;
    /// An algorithm has a virtual table, so that the lowest bits of its address are free.
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
    /// There is room for all.
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
    std::vector<std::uintptr_t> m_known;  ///< by place in the array: algorithm and Kind; 0: to be read
    std::vector<std::uint32_t> m_asked;
    bool m_isListOld = false;
    /// A filter of Bloom's with one hash: addresses that may belong to another algorithm since the last count.
    std::array<std::uint64_t, (std::size_t(1) << kBits) / 64> m_touched{};
    bool m_anyTouched = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
