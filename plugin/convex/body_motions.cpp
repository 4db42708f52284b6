// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/body_motions.h"

#include "cullet/base/simd_vector.h"
#include "cullet/plugin/convex/convex_pair.h"
#include "cullet/plugin/core/prefetch.h"

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
/// Bodies between the prefetch of a body's memory and its use.
constexpr std::size_t kMotionsAhead = 6;

/// A body whose credit falls below kLeastCredit is paused. After the pause its credit is kLeastCredit, so the motion
/// must be useful at once.
constexpr std::int32_t kLeastCredit = -2, kMostCredit = 8;

/// Bodies that are sampled to find out whether most are asleep.
constexpr std::size_t kSleepSample = 64;

/// Up to this skew a matrix is close enough to a rotation for the bound of motionTo().
constexpr float kMostSkew = 4e-5f;

using MatrixRows = std::array<Components, 3>;

void readRows(const btMatrix3x3& m, MatrixRows& rows)
{
    for (int k = 0; k < 3; ++k)
        read(m[k], rows[static_cast<std::size_t>(k)]);
}

btScalar sumOfMagnitudes(const Components& v)
{
    Components magnitudes = v;
    Quad<btScalar>::makePositive(magnitudes);
    return Quad<btScalar>::sumOfThree(magnitudes);
}

/// An upper bound of the Frobenius norm of M^T M - I, and so of the distance of M from some rotation or mirrored
/// rotation. Of two of these that are close to each other, both or neither are mirrored.
float skewOf(const MatrixRows& m)
{
    Components squares = {-1, -1, -1}, products = {};
    for (const Components& row : m)
    {
        squares += row * row;
        products += row * CULLET_SHUFFLE(row, row, 1, 2, 0, 3);
    }
    // Covers nine roundings of sums of products that are about 1.
    return static_cast<float>(sumOfMagnitudes(squares) + 2 * sumOfMagnitudes(products)) + 2e-6f;
}

/// Decrements eight pauses; false, without a change, if one of them is 0. @pre none is longer than 127
bool passPauses(std::uint8_t* pauses)
{
    constexpr std::uint64_t kOnes = 0x0101010101010101u;
    std::uint64_t eight;
    std::memcpy(&eight, pauses, sizeof(eight));
    // Bytes are at most 127, so only the borrow of a zero byte sets a highest bit.
    const std::uint64_t shorter = eight - kOnes;
    if ((shorter & ~eight & kOnes << 7) != 0)
        return false;
    std::memcpy(pauses, &shorter, sizeof(shorter));
    return true;
}

/// Includes the unused fourth components; a difference there only makes a resting body count as moved.
bool areSameBits(const btTransform& a, const btTransform& b)
{
    using Bits = VectorOf<std::uint64_t, 2>::Type;
    std::array<Bits, sizeof(btTransform) / sizeof(Bits)> x, y;
    std::memcpy(x.data(), &a, sizeof(a));
    std::memcpy(y.data(), &b, sizeof(b));
    Bits difference = {};
    for (std::size_t i = 0; i < x.size(); ++i)
        difference |= x[i] ^ y[i];
    return (difference[0] | difference[1]) == 0;
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
        ++m_slots[known->second].trackers;
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
    slot.trackers = 1;
    slot.credit = 0;
    slot.pause = kPause;
    m_pauses[known->second] = 0;
    m_motions[known->second] = Motion();
    slot.shape = nullptr;
    return known->second;
}

void BodyMotions::addPlace()
{
    if (m_slots.size() == m_slots.capacity())
    {
        // Room for all slots, so that a release never allocates.
        const std::size_t room = std::max<std::size_t>(64, 2 * m_slots.size());
        m_free.reserve(room);
        m_motions.reserve(room);
        m_uses.reserve(room);
        m_pauses.reserve(room);
        m_slots.reserve(room);
    }
    m_free.push_back(static_cast<std::uint32_t>(m_slots.size()));
    m_slots.emplace_back();
    m_motions.emplace_back();
    m_uses.push_back(0);
    m_pauses.push_back(0);
}

void BodyMotions::release(std::uint32_t place) noexcept
{
    Slot& slot = m_slots[place];
    if (--slot.trackers > 0)
        return;
    if (!isAbandoned(place))
        m_places.erase(slot.body);
    slot.body = nullptr;
    slot.hull.reset();
    m_free.push_back(place);
}

void BodyMotions::abandon() noexcept
{
    for (Slot& slot : m_slots)
    {
        slot.body = nullptr;
        slot.hull.reset();
    }
    std::fill(m_motions.begin(), m_motions.end(), Motion());
    m_places.clear();
    m_pairs.clear();
}

bool BodyMotions::areMostAsleep() const noexcept
{
    const std::size_t stride = m_slots.size() / kSleepSample + 1;
    for (std::size_t i = 0; i < m_slots.size(); i += stride)
    {
        if (m_slots[i].body != nullptr && m_slots[i].body->isActive())
            return false;
    }
    return true;
}

void BodyMotions::update(std::size_t begin, std::size_t end, std::uint64_t pass, bool missedUpdates) noexcept
{
    for (std::size_t i = begin; i < end; ++i)
    {
        if (i + sizeof(std::uint64_t) <= end && passPauses(&m_pauses[i]))
        {
            i += sizeof(std::uint64_t) - 1;
            continue;
        }
        const std::size_t later = std::min(i + kMotionsAhead, end - 1);
        if (m_pauses[later] == 0)
            prefetchBody(m_slots[later].body);
        // The motion is unknown since the pause began.
        if (m_pauses[i] > 0)
        {
            --m_pauses[i];
            continue;
        }
        Slot& slot = m_slots[i];
        if (slot.body == nullptr)
            continue;
        const bool beginsPause = isUnprofitable(i);
        m_motions[i] = Motion();
        m_uses[i] = 0;
        if (beginsPause)
        {
            // The first update after the pause must not compare with the state before it.
            slot.shape = nullptr;
            slot.credit = kLeastCredit;
            m_pauses[i] = static_cast<std::uint8_t>(slot.pause - 1);
            slot.pause = std::min(static_cast<std::uint8_t>(2 * slot.pause), kLongestPause);
            continue;
        }
        Motion moved = slot.move(pass);
        // Bullet leaves out pairs of which both are asleep, so that these must be told from the others.
        if (!slot.body->isActive())
            moved.arcBound = moved.arcBound == 0.0f ? -0.0f : std::numeric_limits<float>::infinity();
        if (!missedUpdates)
            m_motions[i] = moved;
    }
}

bool BodyMotions::isUnprofitable(std::size_t place)
{
    if (std::isinf(m_motions[place].arcBound))
        return false;
    // An update costs about half a pair test for a resting body, two for one that has moved.
    Slot& slot = m_slots[place];
    const std::int32_t cost = m_motions[place].arcBound == 0.0f ? 1 : 2;
    slot.credit = std::min(slot.credit + m_uses[place] - cost, kMostCredit);
    if (slot.credit >= 0)
        slot.pause = kPause;
    return slot.credit < kLeastCredit;
}

void BodyMotions::clear()
{
    m_slots.clear();
    m_motions.clear();
    m_uses.clear();
    m_pauses.clear();
    m_free.clear();
    m_places.clear();
    m_pairs.clear();
}

void BodyMotions::freeIfUnused() noexcept
{
    if (m_free.size() == m_slots.size())
        *this = BodyMotions();
}

/// The height of the core above its origin along an axis n is a function of R^T n. The direction of R^T n turns by at
/// most the angle between R and R', and its length changes by at most the skews. For rotations that angle is
/// 2 asin(|R - R'| / sqrt(8)), with the Frobenius norm, and every matrix is as close to a rotation as its skew. If the
/// matrices are no rotations, or far apart, TurnRates prove nothing, but no height grows by more than
/// |R - R'| |n| radius, and |n| <= sqrt(3).
///
/// Terms that no rate multiplies are divided by the least rate: the skews, as twice 5 times the radius, which TurnRates
/// do not cover, and seven roundings of 6e-8 of each shift, those of approachBound() included. A chain of a dozen
/// operations without cancellation is off by less than twelve roundings of its result. Squares that underflow are
/// below 2^-126, the root of nine of them below 4e-19.
BodyMotions::Motion BodyMotions::Slot::motionTo(const btTransform& to) noexcept
{
    MatrixRows before, after;
    readRows(place.getBasis(), before);
    readRows(to.getBasis(), after);
    const Components x = after[0] - before[0], y = after[1] - before[1], z = after[2] - before[2];
    const auto turned = static_cast<float>(squareRoot(Quad<btScalar>::sumOfThree(x * x + y * y + z * z)));
    Components shift, from;
    read(to.getOrigin(), shift);
    read(place.getOrigin(), from);
    shift -= from;
    Motion motion;
    motion.shift = {float(shift[0]), float(shift[1]), float(shift[2])};
    float arc = 0.0f;
    if (turned != 0.0f)
    {
        const float skewBefore = skew;
        skew = skewOf(after);
        const float skews = skewBefore + skew;
        const float chord = (turned * 0.70710683f + 2.0f * skews) * (1.0f + 2.0f * skews);
        // asin x <= x + (pi / 2 - 1) x^3
        arc = chord * (1.0f + 0.15f * chord * chord) + 80.0f * skews;
        if (!(skews <= kMostSkew && turned < 0.7f))
            arc = 2.0f / TurnRates::kLeast * turned;
    }
    motion.arcBound = (arc + 1e-17f) * static_cast<float>(radius) * (1.0f + 1e-5f) +
                      5e-7f / TurnRates::kLeast * static_cast<float>(sumOfMagnitudes(shift)) + 4e-19f;
    return motion;
}

BodyMotions::Motion BodyMotions::Slot::move(std::uint64_t pass) noexcept
{
    const btTransform& to = body->getWorldTransform();
    if (!hasSameCore(pass))
    {
        readCore(pass);
        MatrixRows rows;
        readRows(to.getBasis(), rows);
        skew = skewOf(rows);
        place = to;
        return {};
    }
    Motion moved;
    if (areSameBits(place, to))
        moved.arcBound = 0.0f;
    else
        moved = motionTo(to);
    place = to;
    return moved;
}

bool BodyMotions::Slot::hasSameCore(std::uint64_t pass) noexcept
{
    StretchedHull core;
    if (shape == nullptr || body->getCollisionShape() != shape || shape->getShapeType() != type ||
        body->isKinematicObject() != isKinematic ||
        !stretchShape(static_cast<const btConvexShape&>(*shape), place, hull, pass, core))
        return false;
    const bool isHull = type == CONVEX_HULL_SHAPE_PROXYTYPE;
    const ConvexKind kind = isHull ? ConvexKind::Hull : convexKindOf(type);
    return (!isHull || hull.revision() == revision) &&
           marginOf(static_cast<const btConvexShape&>(*shape), kind) == margin &&
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
    isKinematic = body->isKinematicObject();
    margin = marginOf(convex, convexKindOf(type));
    stretch = *core.stretch;
    const btScalar most = std::max({std::abs(stretch.x()), std::abs(stretch.y()), std::abs(stretch.z())});
    radius = most * static_cast<btScalar>(core.hull->radius()) *
             (1 + 4 * std::numeric_limits<btScalar>::epsilon());
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
