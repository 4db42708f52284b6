// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/motion_tracked_pairs.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/shapes/hull_cache.h"
#include "cullet/plugin/shapes/separating_axis.h"

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
/// two entries of this table, no shape. Bodies are counted by the pairs of one pair cache that watch them. While all of
/// these pairs are in the cache, their bodies exist; see MotionTrackedPairs. Nothing else is assumed of bodies, and whatever of
/// one has changed is found by comparing.
///
/// A body whose motion spares less than a look at a pair for each update, since it or its partners move too fast or are
/// few, is not looked at for some updates.
///
/// Threads: update() of different ranges, or approach() and use(), may run concurrently; everything else on one thread.
class BodyMotions
{
public:
    static constexpr std::uint32_t kNone = ~std::uint32_t(0);

    /// True if pairs of this cache may watch: a dispatcher may serve others too (those of ghosts), whose bodies may be
    /// gone when this one is dispatched. The first, until no pair watches.
    bool serves(const btOverlappingPairCache* cache);

    /// One more watcher of a body. @return its place, for approach() and release(). Errors: std::bad_alloc.
    std::uint32_t acquire(const btCollisionObject& body);
    void release(std::uint32_t place) noexcept;
    /// Looks at none of the bodies any more, some of which are gone. Their places stay until they are released, with motions
    /// that are never known again; a body that is acquired again gets another one.
    void abandon() noexcept;
    bool isAbandoned(std::uint32_t place) const { return m_slots[place].body == nullptr; }

    MotionTrackedPairs& pairs() { return m_pairs; }
    const MotionTrackedPairs& pairs() const { return m_pairs; }

    std::size_t size() const { return m_moved.size(); }
    /// Whether all bodies of a sample are asleep. Then hardly a pair is worth an update. @pre as of update()
    bool areMostAsleep() const noexcept;
    /// Compares bodies with what they were in the last update; all of [0, size()), once per dispatch.
    ///
    /// @pre all bodies that are not abandoned exist
    /// @param pass  see HullCache::hullOf()
    /// @param isGap updates have been missed by some pairs: every body counts as moved
    void update(std::size_t begin, std::size_t end, std::uint64_t pass, bool isGap) noexcept;
    /// An upper bound for how much less A may reach beyond B along an axis than before, in units of its length: what the
    /// bodies have moved together does not count, and what they have moved apart counts against how they have turned.
    /// Infinite or NaN if it is not known, 0 if neither has moved.
    ///
    /// @param axis from B to A, no component above 1; the pair was looked at in the last update, or outlasted it
    float approach(std::uint32_t a, std::uint32_t b, const std::array<float, 3>& axis,
                   const TurnRates& rates) const
    {
        const Motion &m = m_moved[a], &n = m_moved[b];
        // The rest of a body that has moved is never 0.
        if (m.rest + n.rest == 0.0f)
            return 0.0f;
        const float x = n.shift[0] - m.shift[0], y = n.shift[1] - m.shift[1], z = n.shift[2] - m.shift[2];
        return (x * axis[0] + y * axis[1] + z * axis[2]) + (rates.a() * m.rest + rates.b() * n.rest);
    }
    /// What approach() gave has spared a look at a pair. Threads may lose some of each other's counts, which only choose
    /// whose motions are looked at.
    void use(std::uint32_t place)
    {
        const std::uint8_t uses = __atomic_load_n(&m_uses[place], __ATOMIC_RELAXED);
        if (uses < kEnoughUses)
            __atomic_store_n(&m_uses[place], static_cast<std::uint8_t>(uses + 1), __ATOMIC_RELAXED);
    }
    /// True if nothing will be known about its motion from this update to the next.
    bool isPaused(std::uint32_t place) const { return m_pauses[place] != 0; }

    void clear();

private:
    /// How a body's origin has moved; times a TurnRate, how much higher its core may be along an axis, from the origin.
    struct Motion
    {
        std::array<float, 3> shift = {};
        float rest = std::numeric_limits<float>::infinity();  ///< infinite: unknown; see Slot::motionTo()
    };

    /// A body as it was in the last update.
    struct Slot
    {
        Motion move(std::uint64_t pass) noexcept;
        bool hasSameCore(std::uint64_t pass) noexcept;
        void readCore(std::uint64_t pass) noexcept;
        Motion motionTo(const btTransform& to) noexcept;

        const btCollisionObject* body = nullptr;
        std::uint32_t watchers = 0;
        std::uint8_t pause = kPause;              ///< the next one
        std::int32_t credit = 0;                  ///< looks spared by its motion, less what updates cost
        const btCollisionShape* shape = nullptr;  ///< null: of a kind whose changes cannot be noticed
        HullUse hull;
        std::uint32_t revision = 0;  ///< of the hull's points
        int type = -1;
        bool isKinematic = false;  ///< a pair of it is idle only if it has a manifold
        btScalar margin = 0;
        btScalar reach = 0;  ///< no point of the core is farther from its origin
        float skew = 0;      ///< see skewOf()
        btVector3 stretch = btVector3(0, 0, 0);
        btTransform place;
    };

    static constexpr std::uint8_t kEnoughUses = 8;
    /// Updates for which a body of no use is left alone; twice as many after each time that it was of none.
    static constexpr std::uint8_t kPause = 24, kLongestPause = 96;

    bool isInVain(std::size_t place);
    void addPlace();

    std::vector<Slot> m_slots;
    std::vector<Motion> m_moved;
    std::vector<std::uint8_t> m_uses;    ///< since the last update, up to kEnoughUses
    std::vector<std::uint8_t> m_pauses;  ///< updates for which a motion stays unknown
    std::vector<std::uint32_t> m_free;
    std::unordered_map<const btCollisionObject*, std::uint32_t> m_places;
    const btOverlappingPairCache* m_cache = nullptr;
    MotionTrackedPairs m_pairs;
};

/// A lower bound for how much farther apart than needed the cores of a pair are along an axis, from the last proof on.
class Leeway
{
public:
    void forget() { m_left = kNothing; }
    bool isForgotten() const { return m_left == kNothing; }
    /// Of a pair just proved to be apart by an axis. @param room left: not negative
    void set(const AxisRoom& room)
    {
        // Not infinite, which would never grow less.
        m_left = static_cast<float>(std::min(double(room.left), 1e38) * (1.0 - 1e-6));
        m_rates = room.rates;
    }
    const TurnRates& rates() const { return m_rates; }

    /// @param moved see BodyMotions::approach()
    /// @return true if the pair is still apart
    bool outlasts(float moved)
    {
        if (moved == 0.0f)
            return m_left != kNothing;
        // The difference is rounded by half of 2^-23 of itself.
        m_left = m_left >= 0.0f ? (m_left - moved) * (1.0f - 0x1p-22f) : kNothing;
        if (m_left >= 0.0f)
            return true;
        m_left = kNothing;
        return false;
    }

private:
    static constexpr float kNothing = -1.0f;

    float m_left = kNothing;
    TurnRates m_rates;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
