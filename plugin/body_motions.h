// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "plugin/hull_cache.h"
#include "plugin/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

class btOverlappingPairCache;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// How far the points of each body's core have moved from one dispatch to the next.
///
/// Two cores that are farther apart than their bodies have moved since are still apart: a pair whose gap is known needs
/// two numbers of this table, no shape. Bodies are counted by the pairs of one pair cache that watch them. As long as a
/// pair has its algorithm, its bodies exist, or Bullet's own dispatch would read what is gone; nothing else is assumed of
/// them, and whatever of a body has changed is found by comparing.
///
/// A body whose motion was of no use, since it or all of its partners move too fast, is not looked at for some updates.
///
/// Threads: update() of different ranges, or of() and use(), may run concurrently; everything else on one thread.
class BodyMotions
{
public:
    static constexpr std::uint32_t kNone = ~std::uint32_t(0);

    /// True if pairs of this cache may watch: a dispatcher may serve others too (those of ghosts), whose bodies may be
    /// gone when this one is dispatched. The first, until no pair watches.
    bool serves(const btOverlappingPairCache* cache);

    /// One more watcher of a body. @return its place, for of() and release(). Errors: std::bad_alloc.
    std::uint32_t acquire(const btCollisionObject& body);
    void release(std::uint32_t place) noexcept;

    std::size_t size() const { return m_moved.size(); }
    /// Compares bodies with what they were in the last update; all of [0, size()), once per dispatch.
    ///
    /// @param pass  see HullCache::hullOf()
    /// @param isGap updates have been missed by some pairs: every body counts as moved
    void update(std::size_t begin, std::size_t end, std::uint64_t pass, bool isGap) noexcept;
    /// An upper bound for the distance that any point of the core has moved; infinite or NaN if it is not known.
    float of(std::uint32_t place) const { return m_moved[place]; }
    /// What of() gave has spared a look at a pair.
    void use(std::uint32_t place)
    {
        if (__atomic_load_n(&m_isUsed[place], __ATOMIC_RELAXED) == 0)
            __atomic_store_n(&m_isUsed[place], std::uint8_t(1), __ATOMIC_RELAXED);
    }

    void clear();

private:
    /// A body as it was in the last update.
    struct Slot
    {
        float move(std::uint64_t pass) noexcept;
        bool hasSameCore(std::uint64_t pass) noexcept;
        void readCore(std::uint64_t pass) noexcept;

        const btCollisionObject* body = nullptr;
        std::uint32_t pause = 0;  ///< updates for which its motion stays unknown
        std::uint32_t watchers = 0;
        const btCollisionShape* shape = nullptr;  ///< null: of a kind whose changes cannot be noticed
        HullUse hull;
        std::uint32_t revision = 0;  ///< of the hull's points
        int type = -1;
        btScalar margin = 0;
        btScalar reach = 0;  ///< no point of the core is farther from its origin
        btVector3 stretch = btVector3(0, 0, 0);
        btTransform place;
    };

    void addPlace();

    std::vector<Slot> m_slots;
    std::vector<float> m_moved;
    std::vector<std::uint8_t> m_isUsed;
    std::vector<std::uint32_t> m_free;
    std::unordered_map<const btCollisionObject*, std::uint32_t> m_places;
    const btOverlappingPairCache* m_cache = nullptr;
};

/// A lower bound for how much farther apart than needed the cores of a pair are, from the last proof on.
class Leeway
{
public:
    void forget() { m_left = -1.0f; }
    /// @param left of a pair just proved to be apart, in real numbers; 0 is always right
    void set(double left)
    {
        // Not infinite, which would never grow less.
        m_left = left > 0.0 ? static_cast<float>(std::min(left, 1e38) * (1.0 - 1e-6)) : 0.0f;
    }

    /// @param moved see BodyMotions::of(), the sum of both bodies'
    /// @return true if the pair is still apart
    bool outlasts(float moved)
    {
        if (moved == 0.0f)
            return m_left >= 0.0f;
        // The difference is rounded by half of 2^-23 of itself.
        m_left = m_left < 0.0f ? -1.0f : (m_left - moved) * (1.0f - 0x1p-22f);
        // False for a NaN.
        return m_left >= 0.0f;
    }

private:
    float m_left = -1.0f;  ///< negative or NaN: nothing is proved
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
