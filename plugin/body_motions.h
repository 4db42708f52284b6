// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "plugin/hull_cache.h"
#include "plugin/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <array>
#include <cmath>
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
/// two entries of this table, no shape. Bodies are counted by the pairs of one pair cache that watch them. As long as a
/// pair has its algorithm, its bodies exist, or Bullet's own dispatch would read what is gone; nothing else is assumed of
/// them, and whatever of a body has changed is found by comparing.
///
/// A body whose motion was of no use, since it or all of its partners move too fast, is not looked at for some updates.
///
/// Threads: update() of different ranges, or between() and use(), may run concurrently; everything else on one thread.
class BodyMotions
{
public:
    static constexpr std::uint32_t kNone = ~std::uint32_t(0);

    /// True if pairs of this cache may watch: a dispatcher may serve others too (those of ghosts), whose bodies may be
    /// gone when this one is dispatched. The first, until no pair watches.
    bool serves(const btOverlappingPairCache* cache);

    /// One more watcher of a body. @return its place, for between() and release(). Errors: std::bad_alloc.
    std::uint32_t acquire(const btCollisionObject& body);
    void release(std::uint32_t place) noexcept;

    std::size_t size() const { return m_moved.size(); }
    /// Compares bodies with what they were in the last update; all of [0, size()), once per dispatch.
    ///
    /// @param pass  see HullCache::hullOf()
    /// @param isGap updates have been missed by some pairs: every body counts as moved
    void update(std::size_t begin, std::size_t end, std::uint64_t pass, bool isGap) noexcept;
    /// An upper bound for how much nearer any point of the one core may have come to any of the other: what they have
    /// moved together does not count. Infinite or NaN if it is not known, 0 only if neither has moved.
    float between(std::uint32_t a, std::uint32_t b) const
    {
        const Motion &m = m_moved[a], &n = m_moved[b];
        // The rest of a body that has moved is never 0.
        if (m.rest + n.rest == 0.0f)
            return 0.0f;
        const float x = m.shift[0] - n.shift[0], y = m.shift[1] - n.shift[1], z = m.shift[2] - n.shift[2];
        // Five roundings, and three squares below 2^-126 whose root the rest covers.
        return std::sqrt(x * x + y * y + z * z) * (1.0f + 1e-6f) + (m.rest + n.rest);
    }
    /// What between() gave has spared a look at a pair.
    void use(std::uint32_t place)
    {
        if (__atomic_load_n(&m_isUsed[place], __ATOMIC_RELAXED) == 0)
            __atomic_store_n(&m_isUsed[place], std::uint8_t(1), __ATOMIC_RELAXED);
    }

    void clear();

private:
    /// How a body's origin has moved, and how much farther any point of its core may have.
    struct Motion
    {
        std::array<float, 3> shift = {};
        float rest = std::numeric_limits<float>::infinity();  ///< infinite: unknown; see motionOf()
    };
    static Motion motionOf(const btTransform& from, const btTransform& to, btScalar reach);

    /// A body as it was in the last update.
    struct Slot
    {
        Motion move(std::uint64_t pass) noexcept;
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
    std::vector<Motion> m_moved;
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

    /// @param moved see BodyMotions::between()
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
