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
/// Upper bounds of the motion of each body's core from one dispatch to the next.
///
/// Two cores stay separated while their gap exceeds the motion of their bodies since it was computed. So a pair with a
/// known gap is tested with two entries of this table and without its shapes. Bodies are reference-counted by the pairs
/// of one pair cache that track them. While all of these pairs are in the cache, their bodies exist; see
/// MotionTrackedPairs. Nothing else is assumed about bodies; changes are detected by comparison.
///
/// A body whose motion saves less than one pair test per update, because it or its partners move too fast or are few,
/// is paused for some updates.
///
/// Threads: update() of different ranges, or approachBound() and use(), may run concurrently; other calls need
/// exclusive access.
class BodyMotions
{
public:
    static constexpr std::uint32_t kNone = ~std::uint32_t(0);

    /// Whether pairs of this cache may track their bodies: only those of the first cache, until no body is tracked. A
    /// dispatcher may also serve other caches (those of ghosts), whose bodies may not exist when this one is
    /// dispatched.
    bool serves(const btOverlappingPairCache* cache);

    /// Adds a reference to a body. @return its slot, for approachBound() and release(). Errors: std::bad_alloc.
    std::uint32_t acquire(const btCollisionObject& body);
    void release(std::uint32_t place) noexcept;
    /// Stops reading all bodies, since some no longer exist. Their slots stay until they are released, with motions
    /// that remain unknown; a body that is acquired again gets another slot.
    void abandon() noexcept;
    bool isAbandoned(std::uint32_t place) const { return m_slots[place].body == nullptr; }

    MotionTrackedPairs& pairs() { return m_pairs; }
    const MotionTrackedPairs& pairs() const { return m_pairs; }

    std::size_t size() const { return m_motions.size(); }
    /// Whether all bodies of a sample are asleep. Then updates hardly pay. @pre as of update()
    bool areMostAsleep() const noexcept;
    /// Compares bodies with their state in the last update; call for all of [0, size()), once per dispatch.
    ///
    /// @pre all bodies that are not abandoned exist
    /// @param pass  see HullCache::hullOf()
    /// @param missedUpdates some pairs have missed updates: every motion is unknown
    void update(std::size_t begin, std::size_t end, std::uint64_t pass, bool missedUpdates) noexcept;
    /// An upper bound of the decrease of the gap between A and B along an axis, times the length of the axis. Common
    /// motion cancels, and motion away from each other offsets turning. Infinite or NaN if it is unknown, 0 if neither
    /// has moved, and that with a minus sign if both are asleep.
    ///
    /// @param axis from B to A, no component above 1
    /// @pre the previous dispatch has set or reduced the pair's SeparationBudget
    float approachBound(std::uint32_t a, std::uint32_t b, const std::array<float, 3>& axis,
                        const TurnRates& rates) const
    {
        const Motion &m = m_motions[a], &n = m_motions[b];
        // `arcBound` of a body that has moved is never 0.
        if (m.arcBound + n.arcBound == 0.0f)
            return m.arcBound + n.arcBound;
        const float x = n.shift[0] - m.shift[0], y = n.shift[1] - m.shift[1], z = n.shift[2] - m.shift[2];
        return (x * axis[0] + y * axis[1] + z * axis[2]) + (rates.a() * m.arcBound + rates.b() * n.arcBound);
    }
    /// Counts a pair test that approachBound() has saved. Concurrent calls may lose counts, which only decide the
    /// bodies whose motions are computed.
    void use(std::uint32_t place)
    {
        const std::uint8_t uses = __atomic_load_n(&m_uses[place], __ATOMIC_RELAXED);
        if (uses < kEnoughUses)
            __atomic_store_n(&m_uses[place], static_cast<std::uint8_t>(uses + 1), __ATOMIC_RELAXED);
    }
    /// Whether the motion of the body from this update to the next will be unknown.
    bool isPaused(std::uint32_t place) const { return m_pauses[place] != 0; }

    void clear();
    /// Frees all memory if no pair tracks a body, else does nothing.
    void freeIfUnused() noexcept;

private:
    /// The motion of a body's origin. `arcBound` times a rate of TurnRates bounds the increase of the core's height
    /// along an axis, relative to the origin.
    struct Motion
    {
        std::array<float, 3> shift = {};
        /// Infinite: unknown; see Slot::motionTo(). -0: asleep, and has not moved.
        float arcBound = std::numeric_limits<float>::infinity();
    };

    /// The state of a body in the last update.
    struct Slot
    {
        Motion move(std::uint64_t pass) noexcept;
        bool hasSameCore(std::uint64_t pass) noexcept;
        void readCore(std::uint64_t pass) noexcept;
        Motion motionTo(const btTransform& to) noexcept;

        const btCollisionObject* body = nullptr;
        std::uint32_t trackers = 0;
        std::uint8_t pause = kPause;  ///< length of the next one
        std::int32_t credit = 0;      ///< pair tests saved by its motion, less the cost of updates
        const btCollisionShape* shape = nullptr;  ///< null: not a shape whose changes can be detected
        HullUse hull;
        std::uint32_t revision = 0;  ///< of the hull's points
        int type = -1;
        bool isKinematic = false;  ///< a pair of a kinematic body is idle only if it has a manifold
        btScalar margin = 0;
        btScalar radius = 0;  ///< of a ball around the origin that contains the core
        float skew = 0;       ///< see skewOf()
        btVector3 stretch = btVector3(0, 0, 0);
        btTransform place;
    };

    static constexpr std::uint8_t kEnoughUses = 8;
    /// Length of a pause in updates; it doubles with each pause in a row.
    static constexpr std::uint8_t kPause = 24, kLongestPause = 96;

    bool isUnprofitable(std::size_t place);
    void addPlace();

    std::vector<Slot> m_slots;
    std::vector<Motion> m_motions;
    std::vector<std::uint8_t> m_uses;    ///< saved pair tests since the last update, up to kEnoughUses
    std::vector<std::uint8_t> m_pauses;  ///< remaining updates of the pause
    std::vector<std::uint32_t> m_free;
    std::unordered_map<const btCollisionObject*, std::uint32_t> m_places;
    const btOverlappingPairCache* m_cache = nullptr;
    MotionTrackedPairs m_pairs;
};

/// A lower bound of the surplus gap between the cores of a pair along an axis, since the last proof of separation.
class SeparationBudget
{
public:
    void forget() { m_remainingGap = kUnknownGap; }
    bool isForgotten() const { return m_remainingGap == kUnknownGap; }
    /// Call after an axis has proved separation. @param surplus not negative
    void set(const AxisSurplus& surplus)
    {
        // Finite, since an infinite number would never decrease.
        m_remainingGap = static_cast<float>(std::min(double(surplus.left), 1e38) * (1.0 - 1e-6));
        m_rates = surplus.rates;
    }
    const TurnRates& rates() const { return m_rates; }

    /// @param moved see BodyMotions::approachBound()
    /// @return whether the pair is still separated
    bool consume(float moved)
    {
        if (moved == 0.0f)
            return m_remainingGap != kUnknownGap;
        // The difference has a rounding error of half of 2^-23 of itself.
        m_remainingGap = m_remainingGap >= 0.0f ? (m_remainingGap - moved) * (1.0f - 0x1p-22f) : kUnknownGap;
        if (m_remainingGap >= 0.0f)
            return true;
        m_remainingGap = kUnknownGap;
        return false;
    }

private:
    static constexpr float kUnknownGap = -1.0f;

    float m_remainingGap = kUnknownGap;
    TurnRates m_rates;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
