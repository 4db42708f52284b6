// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/body_motions.h"

#include "plugin/convex_pair.h"
#include "plugin/prefetch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Bodies between the first touch of one's memory and its use.
constexpr std::size_t kAhead = 6;

/// Updates for which a body whose motion was of no use is left alone; then it takes two to find out again.
constexpr std::uint32_t kPause = 14;

btScalar sumOfMagnitudes(const btVector3& v)
{
    return std::abs(v.x()) + std::abs(v.y()) + std::abs(v.z());
}

btScalar squaredDifference(const btVector3& a, const btVector3& b)
{
    const btScalar x = a.x() - b.x(), y = a.y() - b.y(), z = a.z() - b.z();
    return x * x + y * y + z * z;
}

/// The unused fourth components count too; at worst they make a motion of nothing.
bool areSameBits(const btTransform& a, const btTransform& b)
{
    std::array<std::uint64_t, sizeof(btTransform) / 8> x, y;
    std::memcpy(x.data(), &a, sizeof(a));
    std::memcpy(y.data(), &b, sizeof(b));
    std::uint64_t difference = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        difference |= x[i] ^ y[i];
    return difference == 0;
}
}  // namespace

bool BodyMotions::serves(const btOverlappingPairCache* cache)
{
    if (m_places.empty())
        m_cache = cache;
    return m_cache == cache;
}

std::uint32_t BodyMotions::acquire(const btCollisionObject& body)
{
    const auto [known, isNew] = m_places.try_emplace(&body, kNone);
    if (!isNew)
    {
        ++m_slots[known->second].watchers;
        return known->second;
    }
    try
    {
        if (m_free.empty())
            addPlace();
    }
    catch (...)
    {
        m_places.erase(known);
        throw;
    }
    known->second = m_free.back();
    m_free.pop_back();
    Slot& slot = m_slots[known->second];
    slot.body = &body;
    slot.watchers = 1;
    slot.pause = 0;
    m_moved[known->second] = Motion();
    slot.shape = nullptr;
    return known->second;
}

void BodyMotions::addPlace()
{
    if (m_slots.size() == m_slots.capacity())
    {
        // Room for all places, so that a release never allocates.
        const std::size_t room = std::max<std::size_t>(64, 2 * m_slots.size());
        m_free.reserve(room);
        m_moved.reserve(room);
        m_isUsed.reserve(room);
        m_slots.reserve(room);
    }
    m_free.push_back(static_cast<std::uint32_t>(m_slots.size()));
    m_slots.emplace_back();
    m_moved.emplace_back();
    m_isUsed.push_back(0);
}

void BodyMotions::release(std::uint32_t place) noexcept
{
    Slot& slot = m_slots[place];
    if (--slot.watchers > 0)
        return;
    m_places.erase(slot.body);
    slot.body = nullptr;
    slot.hull.reset();
    m_free.push_back(place);
}

void BodyMotions::update(std::size_t begin, std::size_t end, std::uint64_t pass, bool isGap) noexcept
{
    for (std::size_t i = begin; i < end; ++i)
    {
        const Slot& later = m_slots[std::min(i + kAhead, end - 1)];
        if (later.pause == 0)
            prefetchBody(later.body);
        Slot& slot = m_slots[i];
        if (slot.body == nullptr)
            continue;
        // Its motion is unknown since the pause began.
        if (slot.pause > 0)
        {
            --slot.pause;
            continue;
        }
        const bool wasInVain = !std::isinf(m_moved[i].rest) && m_isUsed[i] == 0;
        m_moved[i] = Motion();
        m_isUsed[i] = 0;
        if (wasInVain)
        {
            // The first look after the pause is no comparison with what was before.
            slot.shape = nullptr;
            slot.pause = kPause - 1;
            continue;
        }
        const Motion moved = slot.move(pass);
        if (!isGap)
            m_moved[i] = moved;
    }
}

void BodyMotions::clear()
{
    m_slots.clear();
    m_moved.clear();
    m_isUsed.clear();
    m_free.clear();
    m_places.clear();
}

/// A point x of the core, |x| <= reach, moves by Rx + t - R'x - t': by the shift t - t', and by no more than |R - R'| |x|
/// from there, with the Frobenius norm, which bounds the spectral one whether or not R and R' are rotations.
///
/// A chain of a dozen operations, none of which cancels, is off by less than twelve roundings of 6e-8 of itself; the shift
/// by two of each component. Squares that underflow are below 2^-126, the root of nine of them below 4e-19.
BodyMotions::Motion BodyMotions::motionOf(const btTransform& from, const btTransform& to, btScalar reach)
{
    const btMatrix3x3 &m = from.getBasis(), &n = to.getBasis();
    const btScalar turned =
        squaredDifference(m[0], n[0]) + squaredDifference(m[1], n[1]) + squaredDifference(m[2], n[2]);
    const btVector3 shift = to.getOrigin() - from.getOrigin();
    Motion motion;
    motion.shift = {float(shift.x()), float(shift.y()), float(shift.z())};
    motion.rest = float((std::sqrt(turned) + btScalar(4e-19)) * reach) * (1.0f + 1e-6f) +
                  1.3e-7f * float(sumOfMagnitudes(shift)) + 4e-19f;
    return motion;
}

BodyMotions::Motion BodyMotions::Slot::move(std::uint64_t pass) noexcept
{
    const btTransform& to = body->getWorldTransform();
    if (!hasSameCore(pass))
    {
        readCore(pass);
        place = to;
        return {};
    }
    Motion moved;
    if (areSameBits(place, to))
        moved.rest = 0.0f;
    else
        moved = motionOf(place, to, reach);
    place = to;
    return moved;
}

bool BodyMotions::Slot::hasSameCore(std::uint64_t pass) noexcept
{
    StretchedHull core;
    if (shape == nullptr || body->getCollisionShape() != shape || shape->getShapeType() != type ||
        !stretchShape(static_cast<const btConvexShape&>(*shape), place, hull, pass, core))
        return false;
    return (type != CONVEX_HULL_SHAPE_PROXYTYPE || hull.revision() == revision) &&
           marginOf(static_cast<const btConvexShape&>(*shape), convexKindOf(type)) == margin &&
           core.stretch->x() == stretch.x() && core.stretch->y() == stretch.y() &&
           core.stretch->z() == stretch.z();
}

void BodyMotions::Slot::readCore(std::uint64_t pass) noexcept
{
    shape = nullptr;
    const btCollisionShape& any = *body->getCollisionShape();
    const auto& convex = static_cast<const btConvexShape&>(any);
    StretchedHull core;
    type = any.getShapeType();
    if (!stretchShape(convex, place, hull, pass, core))
        return;
    shape = &any;
    revision = hull.revision();
    margin = marginOf(convex, convexKindOf(type));
    stretch = *core.stretch;
    const btScalar most = std::max({std::abs(stretch.x()), std::abs(stretch.y()), std::abs(stretch.z())});
    reach = most * static_cast<btScalar>(core.hull->radius()) *
            (1 + 4 * std::numeric_limits<btScalar>::epsilon());
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
