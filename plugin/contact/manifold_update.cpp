// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/contact/manifold_update.h"

#include "cullet/plugin/contact/manifold_renewal.h"
#include "cullet/plugin/contact/pair_material.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using FourScalars = FourLanes<btScalar>;

/// Access to the identifiers that btManifoldResult keeps to itself.
struct ShapeIds : btManifoldResult
{
    static void copy(const btManifoldResult& from, bool isSwapped, btManifoldPoint& to)
    {
        to.m_partId0 = from.*(isSwapped ? &ShapeIds::m_partId1 : &ShapeIds::m_partId0);
        to.m_partId1 = from.*(isSwapped ? &ShapeIds::m_partId0 : &ShapeIds::m_partId1);
        to.m_index0 = from.*(isSwapped ? &ShapeIds::m_index1 : &ShapeIds::m_index0);
        to.m_index1 = from.*(isSwapped ? &ShapeIds::m_index0 : &ShapeIds::m_index1);
    }
};

/// A coordinate of four points each.
struct Points
{
    FourScalars x, y, z;
};

/// btTransform::invXform() of four points.
[[gnu::always_inline]] inline Points toLocal(const btTransform& transform, const Points& points)
{
    const btMatrix3x3& m = transform.getBasis();
    const btVector3& origin = transform.getOrigin();
    const FourScalars x = points.x - origin[0], y = points.y - origin[1], z = points.z - origin[2];
    const auto row = [&](int i) { return x * m[0][i] + y * m[1][i] + z * m[2][i]; };
    return {row(0), row(1), row(2)};
}

/// btTransform::operator() of four points.
[[gnu::always_inline]] inline Points toWorld(const btTransform& transform, const Points& points)
{
    const btMatrix3x3& m = transform.getBasis();
    const btVector3& origin = transform.getOrigin();
    const auto row = [&](int i)
    { return points.x * m[i][0] + points.y * m[i][1] + points.z * m[i][2] + origin[i]; };
    return {row(0), row(1), row(2)};
}

[[gnu::always_inline]] inline FourScalars squaredLengths(const Points& p)
{
    return p.x * p.x + p.y * p.y + p.z * p.z;
}

/// Four points, each as the numbers of a btVector3.
class Rows
{
public:
    [[gnu::always_inline]] explicit Rows(const Points& p)
    {
        const FourScalars zero(btScalar(0));
        const FourScalars xyLow = FourScalars::shuffle<0, 4, 1, 5>(p.x, p.y),
                          xyHigh = FourScalars::shuffle<2, 6, 3, 7>(p.x, p.y);
        const FourScalars zLow = FourScalars::shuffle<0, 4, 1, 5>(p.z, zero);
        const FourScalars zHigh = FourScalars::shuffle<2, 6, 3, 7>(p.z, zero);
        m_rows[0] = FourScalars::shuffle<0, 1, 4, 5>(xyLow, zLow);
        m_rows[1] = FourScalars::shuffle<2, 3, 6, 7>(xyLow, zLow);
        m_rows[2] = FourScalars::shuffle<0, 1, 4, 5>(xyHigh, zHigh);
        m_rows[3] = FourScalars::shuffle<2, 3, 6, 7>(xyHigh, zHigh);
    }
    [[gnu::always_inline]] void copy(int lane, btVector3& to) const { m_rows[lane].store(to.m_floats); }

private:
    FourScalars m_rows[4];
};

/// btPersistentManifold::replaceContactPoint(): all but places, impulses, lifetime and the application's data.
[[gnu::always_inline]] inline void renew(btManifoldPoint& point, const btManifoldPoint& by)
{
    renewPoint(by, point);
    point.m_partId0 = by.m_partId0;
    point.m_partId1 = by.m_partId1;
    point.m_index0 = by.m_index0;
    point.m_index1 = by.m_index1;
}

/// Whether the application sees or changes single points.
bool needsBullet(const btCollisionObject& a, const btCollisionObject& b)
{
    constexpr int kFlags =
        btCollisionObject::CF_HAS_CONTACT_STIFFNESS_DAMPING | btCollisionObject::CF_HAS_FRICTION_ANCHOR;
    return gContactAddedCallback != nullptr || gContactProcessedCallback != nullptr ||
           gContactStartedCallback != nullptr ||
           ((a.getCollisionFlags() | b.getCollisionFlags()) & kFlags) != 0;
}

class Update
{
public:
    [[gnu::always_inline]] Update(const BoxContact<btScalar>& contact, const btCollisionObject& a,
                                  const btCollisionObject& b, btPersistentManifold& manifold)
        : m_contact(contact),
          m_normal(contact.normal[0], contact.normal[1], contact.normal[2]),
          m_distances(FourScalars::load(contact.distances)),
          m_a(a),
          m_b(b),
          m_manifold(manifold),
          m_threshold(manifold.getContactBreakingThreshold())
    {
        const btVector3& n = m_normal;
        const Points onB = {FourScalars::load(contact.points[0]), FourScalars::load(contact.points[1]),
                            FourScalars::load(contact.points[2])};
        m_localA = toLocal(a.getWorldTransform(), {onB.x + m_distances * n[0], onB.y + m_distances * n[1],
                                                   onB.z + m_distances * n[2]});
        m_localB = toLocal(b.getWorldTransform(), onB);
    }

    /// Finds the place of each point in the manifold; see btPersistentManifold::getCacheEntry(). In a full manifold, a
    /// point without a place takes that of the nearest point which the patch does not renew.
    [[gnu::always_inline]] void findPlaces()
    {
        if (areApart() && findPlacesAtOnce())
            return;
        while (!findPlacesOrEvict())
        {
        }
    }

    /// The points as they are after btPersistentManifold::refreshContactPoints().
    [[gnu::always_inline]] void write(const btManifoldResult& result)
    {
        const btVector3& n = m_normal;
        btManifoldPoint common(n, n, n, 0);
        findCommon(result, common);
        const Points onA = toWorld(m_a.getWorldTransform(), m_localA);
        const Points onB = toWorld(m_b.getWorldTransform(), m_localB);
        const Points apart = {onA.x - onB.x, onA.y - onB.y, onA.z - onB.z};
        const FourScalars distances = apart.x * n[0] + apart.y * n[1] + apart.z * n[2];
        const Points drift = {onB.x - (onA.x - distances * n[0]), onB.y - (onA.y - distances * n[1]),
                              onB.z - (onA.z - distances * n[2])};
        m_parted = (distances > FourScalars(m_threshold)).bits() |
                   (squaredLengths(drift) > FourScalars(m_threshold * m_threshold)).bits();
        const Rows localA(m_localA), localB(m_localB), rowsA(onA), rowsB(onB);
        m_manifold.setNumContacts(m_count);
        for (int i = 0; i < m_count; ++i)
        {
            btManifoldPoint& point = m_manifold.getContactPoint(i);
            const int lane = m_lanes[i];
            if (lane < 0)
            {
                refresh(point);
                continue;
            }
            i < m_before ? renew(point, common) : void(point = common);
            localA.copy(lane, point.m_localPointA);
            localB.copy(lane, point.m_localPointB);
            rowsA.copy(lane, point.m_positionWorldOnA);
            rowsB.copy(lane, point.m_positionWorldOnB);
            point.m_distance1 = distances[lane];
            ++point.m_lifeTime;
        }
    }

    void removeParted()
    {
        for (int i = m_count - 1; i >= 0; --i)
        {
            if (m_lanes[i] >= 0 ? (m_parted >> m_lanes[i] & 1u) != 0
                                : hasParted(m_manifold.getContactPoint(i)))
                m_manifold.removeContactPoint(i);
        }
    }

private:
    [[gnu::always_inline]] FourScalars squaresFrom(btScalar x, btScalar y, btScalar z) const
    {
        return squaredLengths({m_localA.x - x, m_localA.y - y, m_localA.z - z});
    }

    /// Whether no two points of the patch are so close that one would take the other's place. The lanes beyond the count
    /// repeat the first point.
    [[gnu::always_inline]] bool areApart() const
    {
        const Points &p = m_localA,
                     next = {p.x.lanes<1, 2, 3, 0>(), p.y.lanes<1, 2, 3, 0>(), p.z.lanes<1, 2, 3, 0>()};
        const Points other = {p.x.lanes<2, 3, 0, 1>(), p.y.lanes<2, 3, 0, 1>(), p.z.lanes<2, 3, 0, 1>()};
        const auto isNear = [&](const Points& q)
        {
            return (squaredLengths({p.x - q.x, p.y - q.y, p.z - q.z}) <=
                    FourScalars(m_threshold * m_threshold))
                .bits();
        };
        return m_contact.count == 1 || (m_contact.count == 4 && (isNear(next) | isNear(other)) == 0);
    }

    /// For points that areApart().
    ///
    /// @return false if two points have the same place, or there is none for one
    [[gnu::always_inline]] bool findPlacesAtOnce()
    {
        m_before = m_count = m_manifold.getNumContacts();
        FourScalars least(m_threshold * m_threshold), places(btScalar(-1));
        for (int i = 0; i < MANIFOLD_CACHE_SIZE; ++i)
        {
            m_lanes[i] = -1;
            if (i >= m_before)
                continue;
            const btVector3& p = m_manifold.getContactPoint(i).m_localPointA;
            const FourScalars squares = squaresFrom(p[0], p[1], p[2]);
            places = FourScalars::select(least > squares, FourScalars(btScalar(i)), places);
            least = FourScalars::smaller(squares, least);
        }
        for (int k = 0; k < m_contact.count; ++k)
        {
            const int found = static_cast<int>(places[k]);
            const int place = found >= 0 ? found : m_count++;
            if (place == MANIFOLD_CACHE_SIZE || m_lanes[place] >= 0)
                return false;
            m_lanes[place] = k;
        }
        return true;
    }

    /// @return false if a point of the manifold had to be removed first
    [[gnu::always_inline]] bool findPlacesOrEvict()
    {
        btScalar squares[MANIFOLD_CACHE_SIZE][4];
        m_before = m_count = m_manifold.getNumContacts();
        for (int i = 0; i < MANIFOLD_CACHE_SIZE; ++i)
            m_lanes[i] = -1;
        for (int i = 0; i < m_before; ++i)
        {
            const btVector3& p = m_manifold.getContactPoint(i).m_localPointA;
            squaresFrom(p[0], p[1], p[2]).store(squares[i]);
        }
        for (int k = 0; k < m_contact.count; ++k)
        {
            const int place = nearest(squares, k, m_threshold * m_threshold);
            if (place == MANIFOLD_CACHE_SIZE)
            {
                evict(squares, k);
                return false;
            }
            m_lanes[place] = k;
            m_count = place == m_count ? m_count + 1 : m_count;
            squaresFrom(m_localA.x[k], m_localA.y[k], m_localA.z[k]).store(squares[place]);
        }
        return true;
    }

    /// There is a point to remove, since those before this one take fewer than four places.
    void evict(btScalar (&squares)[MANIFOLD_CACHE_SIZE][4], int lane)
    {
        for (int i = 0; i < MANIFOLD_CACHE_SIZE; ++i)
        {
            if (m_lanes[i] >= 0)
                squares[i][lane] = BT_LARGE_FLOAT;
        }
        m_manifold.removeContactPoint(nearest(squares, lane, BT_LARGE_FLOAT) % MANIFOLD_CACHE_SIZE);
    }

    [[gnu::always_inline]] int nearest(const btScalar (&squares)[MANIFOLD_CACHE_SIZE][4], int lane,
                                       btScalar least) const
    {
        int found = m_count;
        for (int i = 0; i < m_count; ++i)
        {
            const bool isNearer = squares[i][lane] < least;
            found = isNearer ? i : found;
            least = isNearer ? squares[i][lane] : least;
        }
        return found;
    }

    void findCommon(const btManifoldResult& result, btManifoldPoint& point) const
    {
        const btCollisionObject &first = *result.getBody0Internal(), &second = *result.getBody1Internal();
        setMaterial(first, second, point);
        setNormal(m_normal, point);
        ShapeIds::copy(result, &first != &m_a, point);
    }

    /// A point that the patch does not renew.
    void refresh(btManifoldPoint& point) const
    {
        point.m_positionWorldOnA = m_a.getWorldTransform()(point.m_localPointA);
        point.m_positionWorldOnB = m_b.getWorldTransform()(point.m_localPointB);
        point.m_distance1 = (point.m_positionWorldOnA - point.m_positionWorldOnB).dot(point.m_normalWorldOnB);
        ++point.m_lifeTime;
    }

    bool hasParted(const btManifoldPoint& point) const
    {
        if (point.m_distance1 > m_threshold)
            return true;
        const btVector3 onPlane = point.m_positionWorldOnA - point.m_normalWorldOnB * point.m_distance1;
        const btVector3 drift = point.m_positionWorldOnB - onPlane;
        return drift.dot(drift) > m_threshold * m_threshold;
    }

    const BoxContact<btScalar>& m_contact;
    const btVector3 m_normal;
    const FourScalars m_distances;
    const btCollisionObject& m_a;
    const btCollisionObject& m_b;
    btPersistentManifold& m_manifold;
    const btScalar m_threshold;
    int m_before = 0;  ///< points in the manifold before the patch
    int m_count = 0;   ///< points in the manifold
    Points m_localA, m_localB;
    int m_lanes[MANIFOLD_CACHE_SIZE];  ///< of the point in each place; -1: an older point
    unsigned m_parted = 0;             ///< bit i: the point in lane i
};
}  // namespace

bool updateManifold(const BoxContact<btScalar>& contact, const btManifoldResult& result,
                    btPersistentManifold& manifold)
{
    const btCollisionObject &first = *result.getBody0Internal(), &second = *result.getBody1Internal();
    // That of a compound's child, if the compound is the second body.
    const bool isSwapped = manifold.getBody0() != &first;
    const btCollisionObject &a = isSwapped ? second : first, &b = isSwapped ? first : second;
    if (manifold.getBody0() != &a || manifold.getBody1() != &b ||
        (FourScalars::load(contact.distances) > FourScalars(manifold.getContactBreakingThreshold())).bits() !=
            0)
        return false;
    Update update(contact, a, b, manifold);
    update.findPlaces();
    if (needsBullet(a, b))
        return false;
    update.write(result);
    update.removeParted();
    return true;
}

bool PointUpdate::isPossible(const btManifoldResult& result)
{
    return !needsBullet(*result.getBody0Internal(), *result.getBody1Internal());
}

PointUpdate::PointUpdate(const btManifoldResult& result, btPersistentManifold& manifold)
    : m_result(result),
      m_manifold(manifold),
      m_isSwapped(manifold.getBody0() != result.getBody0Internal()),
      m_atA(manifold.getBody0()->getWorldTransform()),
      m_atB(manifold.getBody1()->getWorldTransform()),
      m_point(btVector3(0, 0, 0), btVector3(0, 0, 0), btVector3(0, 0, 0), 0)
{
    setMaterial(*result.getBody0Internal(), *result.getBody1Internal(), m_point);
}

void PointUpdate::add(const btVector3& normal, const btVector3& onB, btScalar distance)
{
    if (distance > m_manifold.getContactBreakingThreshold())
        return;
    // A point of the same triangle often has the same normal.
    if (!(normal == m_point.m_normalWorldOnB))
        setNormal(normal, m_point);
    ShapeIds::copy(m_result, m_isSwapped, m_point);
    m_point.m_positionWorldOnA = onB + normal * distance;
    m_point.m_positionWorldOnB = onB;
    m_point.m_localPointA = m_atA.invXform(m_point.m_positionWorldOnA);
    m_point.m_localPointB = m_atB.invXform(onB);
    m_point.m_distance1 = distance;
    const int place = placeOf(m_point.m_localPointA, m_manifold);
    if (place < 0)
    {
        m_manifold.addManifoldPoint(m_point);
        return;
    }
    btManifoldPoint& point = m_manifold.getContactPoint(place);
    renew(point, m_point);
    point.m_localPointA = m_point.m_localPointA;
    point.m_localPointB = m_point.m_localPointB;
    point.m_positionWorldOnA = m_point.m_positionWorldOnA;
    point.m_positionWorldOnB = onB;
    point.m_distance1 = distance;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
