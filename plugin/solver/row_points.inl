// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Reading points of manifolds, and storing directions of friction in them. Internal linkage.
#include "cullet/plugin/solver/row_parts.inl"

#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>

#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
// Four numbers that follow each other are read at once.
constexpr std::size_t kNumber = sizeof(btScalar);
static_assert(offsetof(btManifoldPoint, m_combinedFriction) ==
              offsetof(btManifoldPoint, m_distance1) + kNumber);
static_assert(offsetof(btManifoldPoint, m_appliedImpulseLateral1) ==
              offsetof(btManifoldPoint, m_appliedImpulse) + 2 * kNumber);
static_assert(offsetof(btManifoldPoint, m_appliedImpulseLateral2) ==
              offsetof(btManifoldPoint, m_appliedImpulse) + 3 * kNumber);
static_assert(offsetof(btManifoldPoint, m_combinedRestitution) + 4 * kNumber <= sizeof(btManifoldPoint));

/// What lanes without a point read.
alignas(16) constexpr char kNoPoint[sizeof(btManifoldPoint)] = {};

/// The points of a part of the lanes.
struct PartPoints
{
    const char* point[kLanes];

    PartPoints(const PointSource& source, int part)
    {
        for (int i = 0; i < kLanes; ++i)
        {
            const btManifoldPoint* const own = source.points[part * kLanes + i];
            point[i] = own != nullptr ? reinterpret_cast<const char*>(own) : kNoPoint;
        }
    }

    [[gnu::always_inline]] WideQuad read(std::size_t offset) const
    {
        const btScalar* from[kLanes];
        for (int i = 0; i < kLanes; ++i)
            from[i] = reinterpret_cast<const btScalar*>(point[i] + offset);
        return WideRecords::read(from);
    }
    [[gnu::always_inline]] Wide3 readVector(std::size_t offset) const
    {
        const WideQuad quad = read(offset);
        return {quad.a, quad.b, quad.c};
    }
};

/// The friction of the last step. Its directions are not set before the first one.
[[gnu::always_inline]] inline Wide3 slideImpulseOf(const PartPoints& points, Wide first, Wide second)
{
    const Wide zero{};
    const Wide3 none = {zero, zero, zero};
    const Wide3 along = points.readVector(offsetof(btManifoldPoint, m_lateralFrictionDir1)) * first;
    const Wide3 beside = points.readVector(offsetof(btManifoldPoint, m_lateralFrictionDir2)) * second;
    return none + choose(first != zero, along, none) + choose(second != zero, beside, none);
}

inline void readPart(const SolverStep& step, int part, PointSource& source)
{
    const PartPoints points(source, part);
    btScalar isLive[kLanes];
    for (int i = 0; i < kLanes; ++i)
        isLive[i] = source.points[part * kLanes + i] != nullptr ? 1 : 0;
    Wide live;
    std::memcpy(&live, isLive, sizeof(live));
    store(source.isLive, part, live);
    store(source.positionA, part, points.readVector(offsetof(btManifoldPoint, m_positionWorldOnA)));
    store(source.positionB, part, points.readVector(offsetof(btManifoldPoint, m_positionWorldOnB)));
    store(source.normal, part, points.readVector(offsetof(btManifoldPoint, m_normalWorldOnB)));
    const WideQuad marks = points.read(offsetof(btManifoldPoint, m_distance1));
    store(source.gap, part, live > Wide{} ? marks.a + fill(step.slop) : Wide{});
    store(source.friction, part, marks.b);
    store(source.restitution, part, points.read(offsetof(btManifoldPoint, m_combinedRestitution)).a);
    store(source.softness, part, fill(step.softness));
    store(source.errorReduction, part, fill(step.errorReduction));
    const WideQuad impulses = points.read(offsetof(btManifoldPoint, m_appliedImpulse));
    store(source.impulse, part, impulses.a);
    if (step.isSoft)
        store(source.slideImpulse, part, slideImpulseOf(points, impulses.c, impulses.d));
}

void readPoints(const SolverStep& step, PointSource& source)
{
    for (int part = 0; part < kParts; ++part)
        readPart(step, part, source);
}

/// Stores the directions of sliding friction in the points.
inline void writeSlides(const PointSource& source)
{
    constexpr std::size_t kOffsets[2] = {offsetof(btManifoldPoint, m_lateralFrictionDir1),
                                         offsetof(btManifoldPoint, m_lateralFrictionDir2)};
    for (int part = 0; part < kParts; ++part)
    {
        for (int i = 0; i < 2; ++i)
        {
            btScalar* to[kLanes];
            unsigned lanes = 0;
            for (int lane = 0; lane < kLanes; ++lane)
            {
                btManifoldPoint* const point = source.points[part * kLanes + lane];
                lanes |= unsigned(point != nullptr) << lane;
                to[lane] = point != nullptr
                               ? reinterpret_cast<btScalar*>(reinterpret_cast<char*>(point) + kOffsets[i])
                               : nullptr;
            }
            const Wide3 slide = load(source.slide[i], part);
            WideRecords::write({slide.x, slide.y, slide.z, Wide{}}, to, lanes);
        }
    }
}
}  // namespace
}  // namespace CULLET_PRECISION
}  // namespace cullet
