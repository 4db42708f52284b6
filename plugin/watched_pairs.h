// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "plugin/precision.h"

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
/// Counts the pairs that watch their bodies, and finds them in the array of their pair cache.
///
/// Bodies of a pair in the array exist, or Bullet's own dispatch would read what is gone. Of a pair that has left it and whose
/// algorithm has not been destroyed (Bullet leaks those of pairs removed without a dispatcher) nothing is known. So bodies are
/// looked at only after as many watching pairs were found in the array as there are.
///
/// An algorithm need not be read to be found where it was in the last count, unless one at that address has gone since.
class WatchedPairs
{
public:
    void add() noexcept { ++m_total; }
    /// @param algorithm of a pair that was added, about to be destroyed or to watch no longer
    void remove(const btCollisionAlgorithm& algorithm) noexcept
    {
        --m_total;
        m_anyGone = true;
        const std::size_t bit = bitOf(&algorithm);
        m_gone[bit / 64] |= std::uint64_t(1) << bit % 64;
    }
    /// None that was added counts any more, and none of them may be removed.
    void clear() noexcept
    {
        m_total = 0;
        m_known.clear();
    }
    std::uint64_t total() const { return m_total; }

    /// Before a count in an array of so many pairs. @return false without memory
    bool makeRoom(std::size_t pairs) noexcept
    try
    {
        m_known.resize(pairs);
        return true;
    }
    catch (const std::exception&)
    {
        return false;
    }
    /// The first place from here on of which it is not known that its pair watches. @pre room was made for the count
    std::size_t firstUnknown(const btBroadphasePair* pairs, std::size_t from, std::size_t count) const
    {
        // Copies, which no write to memory can change.
        const btCollisionAlgorithm* const* const known = m_known.data();
        const bool anyGone = m_anyGone;
        while (from < count && pairs[from].m_algorithm == known[from] && known[from] != nullptr &&
               !(anyGone && mayBeGone(known[from])))
            ++from;
        return from;
    }
    /// @param algorithm null: the pair at this place does not watch
    void note(std::size_t place, const btCollisionAlgorithm* algorithm) { m_known[place] = algorithm; }
    /// When every place was known or noted.
    void endCount() noexcept
    {
        if (m_anyGone)
            m_gone.fill(0);
        m_anyGone = false;
    }

private:
    static constexpr int kBits = 14;

    static std::size_t bitOf(const btCollisionAlgorithm* algorithm)
    {
        return reinterpret_cast<std::uintptr_t>(algorithm) * std::uint64_t(0x9e3779b97f4a7c15) >>
               (64 - kBits);
    }
    bool mayBeGone(const btCollisionAlgorithm* algorithm) const
    {
        const std::size_t bit = bitOf(algorithm);
        return (m_gone[bit / 64] >> bit % 64 & 1) != 0;
    }

    std::uint64_t m_total = 0;
    std::vector<const btCollisionAlgorithm*> m_known;  ///< by place in the array; null: not, or to be read
    /// A filter of Bloom's with one hash: addresses that may belong to another algorithm since the last count.
    std::array<std::uint64_t, (std::size_t(1) << kBits) / 64> m_gone{};
    bool m_anyGone = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
