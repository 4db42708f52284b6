// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/isa_gjk_algorithm.h"

#include "cullet/narrow/gjk/gjk_search.h"
#include "cullet/plugin/contact/contact_patch.h"
#include "cullet/plugin/contact/manifold_renewal.h"
#include "cullet/plugin/contact/manifold_update.h"
#include "cullet/plugin/convex/contact_search.h"
#include "cullet/plugin/convex/convex_pair.h"
#include "cullet/plugin/convex/manifold_record.h"
#include "cullet/plugin/convex/settled_search.h"
#include "cullet/plugin/convex/triangle_touch.h"
#include "cullet/plugin/core/dynamic_type.h"

#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <exception>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
[[gnu::always_inline]] inline void count(ThreadCounter& counter)
{
    counter.add(1);
}

/// In a step Bullet drops points above the breaking threshold; a query gets every point of Bullet's detector.
bool isOfStep(const btManifoldResult& result)
{
    return isExactly<btManifoldResult>(result);
}

/// The largest distance of the cores at which there may be a contact.
btScalar limitOf(const ConvexPair& pair, btScalar breakingThreshold, const btManifoldResult& result,
                 bool isStep)
{
    return pair.margins() + breakingThreshold +
           (isStep ? btScalar(0) : pair.margins() + result.m_closestPointDistanceThreshold);
}

/// The points of a patch in world space.
///
/// @param onB     the touch's point of B, with margins
/// @param margins of both shapes
BoxContact<btScalar> contactOf(const ContactPatch& patch, const btVector3& normal, const btVector3& onB,
                               btScalar margins)
{
    BoxContact<btScalar> contact;
    contact.count = patch.count;
    for (int i = 0; i < 3; ++i)
        contact.normal[i] = normal[i];
    for (int lane = 0; lane < 4; ++lane)
    {
        const ContactPoint& point = patch.points[static_cast<std::size_t>(lane < patch.count ? lane : 0)];
        const btVector3 place = onB + point.fromTouch;
        for (int i = 0; i < 3; ++i)
            contact.points[i][lane] = place[i];
        contact.distances[lane] = point.distance - margins;
    }
    return contact;
}

/// Whether a hull takes the place of a shape. Faces that the application had computed are those of the shape itself.
bool becomesHull(const btCollisionShape& shape)
{
    return ConvexMeshHull::isPossible(shape) &&
           static_cast<const btConvexTriangleMeshShape&>(shape).getConvexPolyhedron() == nullptr;
}

/// Whether Bullet would use its separating axis test instead of GJK.
bool usesSeparatingAxisTest(const ConvexPair& pair, const btDispatcherInfo& info)
{
    return info.m_enableSatConvex && pair.a.features() != nullptr &&
           (pair.b.features() != nullptr || pair.b.kind == ConvexKind::Triangle);
}

}  // namespace

IsaGjkAlgorithm::IsaGjkAlgorithm(IsaGjkRegistration& isaGjk, btPersistentManifold* manifold,
                                 const btCollisionAlgorithmConstructionInfo& info,
                                 const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                                 bool closestOnly)
    : btActivatingCollisionAlgorithm(info, a, b),
      m_ownsManifold(false),
      m_closestOnly(closestOnly),
      m_hasContacts(false),
      m_isSettled(true),
      m_isRefreshed(false),
      m_keeper(isaGjk),
      m_manifold(manifold)
{
    touch();
}

IsaGjkAlgorithm::~IsaGjkAlgorithm()
{
    if (m_ownsManifold)
        m_dispatcher->releaseManifold(m_manifold);
    touch();
    untrack();
    isaGjk().leave();
}

/// Marks the algorithm of a pair. That of a triangle, whose manifold is its parent's, of a child of a compound, or of a
/// query outside of a step is in no array of pairs, and may be created on any thread.
void IsaGjkAlgorithm::touch() noexcept
{
    const bool isOfTriangle = m_manifold != nullptr && !m_ownsManifold;
    if (!m_closestOnly && !isOfTriangle && !Recording::isInJob(m_dispatcher))
        isaGjk().motions().pairs().touch(*this);
}

void IsaGjkAlgorithm::track(const btCollisionObject& a, const btCollisionObject& b)
{
    untrack();
    BodyMotions& motions = isaGjk().motions();
    std::uint32_t placeA = BodyMotions::kNone;
    try
    {
        placeA = motions.acquire(a);
        m_places[1] = motions.acquire(b);
        m_places[0] = placeA;
        motions.pairs().add();
    }
    catch (const std::exception&)
    {
        // Without memory the pair stays untracked, and every dispatch tests it.
        if (placeA != BodyMotions::kNone)
            motions.release(placeA);
    }
}

void IsaGjkAlgorithm::untrack() noexcept
{
    m_budget.forget();
    if (!isTracking())
        return;
    BodyMotions& motions = isaGjk().motions();
    if (!motions.isAbandoned(m_places[0]))
        motions.pairs().remove();
    for (std::uint32_t& place : m_places)
    {
        motions.release(place);
        place = BodyMotions::kNone;
    }
}

void IsaGjkAlgorithm::getAllContactManifolds(btManifoldArray& manifolds)
{
    if (!m_ownsManifold)
        return;
    // Bullet's importer calls this to put saved points into the manifold, which the next step must refresh.
    m_hasContacts = true;
    m_budget.forget();
    manifolds.push_back(m_manifold);
}

void IsaGjkAlgorithm::makeManifold(const btCollisionObject& a, const btCollisionObject& b)
{
    if (m_manifold != nullptr)
        return;
    m_manifold = m_dispatcher->getNewManifold(&a, &b);
    m_ownsManifold = m_manifold != nullptr;
}

void IsaGjkAlgorithm::processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                                       const btDispatcherInfo& info, btManifoldResult* result)
{
    m_budget.forget();
    makeManifold(*a->getCollisionObject(), *b->getCollisionObject());
    result->setPersistentManifold(m_manifold);
    // The dispatcher's pool is full, and dynamic allocation is disabled.
    if (m_manifold == nullptr)
        return;
    m_breakingThreshold = m_manifold->getContactBreakingThreshold();
    // What is asked once only, as the triangles of a mesh and queries, is not worth a hull.
    const bool isAskedOften = m_ownsManifold && !m_closestOnly;
    if (isAskedOften && (becomesHull(*a->getCollisionShape()) || becomesHull(*b->getCollisionShape())))
        processHulls(*a, *b, info, *result);
    else
        process(*a, *b, info, *result);
}

/// Processes hulls in place of meshes; or the shapes as they are, if one has no hull.
void IsaGjkAlgorithm::processHulls(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                                   const btDispatcherInfo& info, btManifoldResult& result)
{
    PairOfMeshHulls* const hulls = m_keeper.meshHulls();
    if (hulls == nullptr)
        return process(a, b, info, result);
    const auto shapeOf = [](const btCollisionObjectWrapper& body, ConvexMeshHull& hull)
    {
        const btCollisionShape* const shape = body.getCollisionShape();
        return becomesHull(*shape) ? hull.hullOf(static_cast<const btConvexTriangleMeshShape&>(*shape))
                                   : shape;
    };
    const btCollisionShape *const shapeA = shapeOf(a, (*hulls)[0]), *const shapeB = shapeOf(b, (*hulls)[1]);
    if (shapeA == nullptr || shapeB == nullptr)
        return process(a, b, info, result);
    const btCollisionObjectWrapper hullA(&a, shapeA, a.getCollisionObject(), a.getWorldTransform(),
                                         a.m_partId, a.m_index);
    const btCollisionObjectWrapper hullB(&b, shapeB, b.getCollisionObject(), b.getWorldTransform(),
                                         b.m_partId, b.m_index);
    process(hullA, hullB, info, result);
}

/// processCollision() after the manifold was set.
void IsaGjkAlgorithm::process(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                              const btDispatcherInfo& info, btManifoldResult& result)
{
    if (m_hasContacts && m_ownsManifold &&
        m_keeper.keep({isaGjk(), a, b, info, result, *m_manifold, m_hulls}))
    {
        m_hasContacts = m_manifold->getNumContacts() > 0;
        return;
    }
    FailedProof failed;
    bool isSeparated;
    {
        // In a block of its own, so that the compiler can keep it in registers.
        const ConvexPair pair(a, b);
        const bool isStep = isOfStep(result);
        // Returns false for invalid shapes and transforms.
        isSeparated = axisStillSeparates(pair, limitOf(pair, m_breakingThreshold, result, isStep),
                                         passOf(isStep), failed);
    }
    if (!isSeparated)
        return collideAndRefresh(ConvexPair(a, b), info, failed, result);
    count(isaGjk().counters().separated);
    m_hasContacts = m_manifold->getNumContacts() > 0;
    m_isRefreshed = false;
    if (m_hasContacts)
        refresh(result);
}

/// Refreshes the points of a manifold after its pair has moved.
void IsaGjkAlgorithm::refresh(btManifoldResult& result)
{
    if (m_ownsManifold && !m_isRefreshed)
        result.refreshContactPoints();
    m_hasContacts = m_manifold->getNumContacts() > 0;
}

/// @param failed result of the cached axis, which did not separate the cores
void IsaGjkAlgorithm::collideAndRefresh(const ConvexPair& pair, const btDispatcherInfo& info,
                                        FailedProof& failed, btManifoldResult& result)
{
    // True until the points are counted: a contact callback that throws leaves points behind.
    m_hasContacts = true;
    m_isRefreshed = false;
    const bool isAnswered = collide(pair, info, failed, result);
    if (isAnswered && m_cache.state == GjkState::Separated && m_manifold->getNumContacts() == 0)
    {
        m_hasContacts = false;
        return;
    }
    const btConvexConvexAlgorithm::CreateFunc& stock = isaGjk().stock();
    const bool needsPerturbation = stock.m_numPerturbationIterations > 0 &&
                                   m_cache.state != GjkState::Separated && !m_closestOnly &&
                                   m_manifold->getNumContacts() < stock.m_minimumPointsPerturbationThreshold;
    if (!isAnswered || needsPerturbation)
    {
        m_isRefreshed = false;
        runBulletAlgorithm(pair, info, result);
    }
    else if (m_ownsManifold && !m_closestOnly && m_cache.state != GjkState::Separated)
        m_keeper.store({isaGjk(), *pair.wrapA, *pair.wrapB, info, result, *m_manifold, m_hulls});
    // Bullet's algorithm itself refreshes the manifold of two round shapes, even if it does not own it.
    const bool isRefreshed = !isAnswered && pair.a.isRound() && pair.b.isRound() &&
                             (pair.a.kind == ConvexKind::Capsule || pair.b.kind == ConvexKind::Capsule);
    if (isRefreshed)
        m_hasContacts = m_manifold->getNumContacts() > 0;
    else
        refresh(result);
}

/// See HullCache::hullOf().
std::uint64_t IsaGjkAlgorithm::passOf(bool isStep) const
{
    return isStep ? isaGjk().pass() : isaGjk().queryPass();
}

/// Whether the cached axis still separates the cores.
[[gnu::always_inline]] inline bool IsaGjkAlgorithm::axisStillSeparates(const ConvexPair& pair, btScalar limit,
                                                                       std::uint64_t pass,
                                                                       FailedProof& failed,
                                                                       AxisSurplus* surplus)
{
    StretchedHull a, b;
    if (m_cache.state != GjkState::Separated ||
        !stretchShape(pair.a.shape, pair.a.transform, m_hulls[0], pass, a))
        return false;
    if (pair.sharesHullShape())
        b = {a.hull, a.stretch, &pair.b.transform};
    else if (!stretchShape(pair.b.shape, pair.b.transform, m_hulls[1], pass, b))
        return false;
    failed.hulls = {a.hull, b.hull};
    return staysSeparated(a, b, limit, m_cache, surplus, &failed.axis);
}

bool IsaGjkAlgorithm::isIdle(const btCollisionObject& a, const btCollisionObject& b)
{
    m_budget.forget();
    const bool isNew = m_manifold == nullptr && m_cache.state == GjkState::NotConverged;
    if (m_hasContacts || m_breakingThreshold < 0 || (m_cache.state != GjkState::Separated && !isNew))
        return false;
    // A kinematic body needs a manifold; see isIdle() in the header.
    if (m_manifold == nullptr && (a.isKinematicObject() || b.isKinematicObject()))
        return false;
    const bool usesBudget = canUseBudget();
    FailedProof failed;
    {
        // In a block of its own, so that the compiler can keep it in registers.
        const ConvexPair pair(a, b);
        AxisSurplus surplus;
        if (axisStillSeparates(pair, pair.margins() + m_breakingThreshold, isaGjk().pass(), failed,
                               usesBudget ? &surplus : nullptr))
        {
            if (usesBudget)
                m_budget.set(surplus);
            return true;
        }
    }
    return findsSeparatingAxis(a, b, failed, usesBudget);
}

/// Whether a search finds another axis that separates the cores.
bool IsaGjkAlgorithm::findsSeparatingAxis(const btCollisionObject& a, const btCollisionObject& b,
                                          FailedProof& failed, bool usesBudget)
{
    const ConvexPair pair(a, b);
    const btScalar limit = pair.margins() + m_breakingThreshold;
    if (pair.isLeftToBullet() || !canRunConcurrently(pair.a.shape.getShapeType()) ||
        !canRunConcurrently(pair.b.shape.getShapeType()))
        return false;
    const ConvexCores cores(pair, failed.hulls, m_hulls, isaGjk().pass());
    if (!cores.haveCores(pair) || testSeparation(pair, cores, padLimit(pair, cores, limit), failed.axis,
                                                 m_cache) != GjkState::Separated)
        return false;
    AxisSurplus surplus;
    FailedProof unused;
    if (usesBudget && axisStillSeparates(pair, limit, isaGjk().pass(), unused, &surplus))
        m_budget.set(surplus);
    return true;
}

/// @param extraDistance added to the breaking threshold, up to which points of a patch are reported
[[gnu::always_inline]] inline void IsaGjkAlgorithm::report(const ConvexPair& pair, const ConvexCores& cores,
                                                           const Touch& touch, btScalar extraDistance,
                                                           btManifoldResult& result)
{
    // As in Bullet: if the application had faces computed for both shapes, hulls touch without their margins.
    const bool isBare = pair.a.features() != nullptr && pair.b.features() != nullptr;
    const double marginA = isBare && pair.a.kind != ConvexKind::Box ? 0.0 : double(pair.a.margin);
    const double marginB = isBare && pair.b.kind != ConvexKind::Box ? 0.0 : double(pair.b.margin);
    const btVector3 normal = toBullet(touch.normal);
    const btVector3 onB = toBullet(cores.a->origin() + touch.onB + marginB * touch.normal + cores.anchor);
    const btScalar margins = static_cast<btScalar>(marginA + marginB);
    const double limit = marginA + marginB + double(m_breakingThreshold) + double(extraDistance);
    if (m_closestOnly || touch.distance > limit)
        return result.addContactPoint(normal, onB, static_cast<btScalar>(touch.distance - marginA - marginB));
    const ContactPatch patch = makeContactPatch(
        *cores.a, *cores.b, touch, {limit, m_breakingThreshold, isaGjk().options().patchPoints},
        {cores.fanA ? &*cores.fanA : nullptr, cores.fanB ? &*cores.fanB : nullptr});
    ManifoldRenewal renewal(*m_manifold);
    // A parent's manifold has points of other pairs; the result of a query has no points of this pair yet.
    const bool isOwnStep = m_ownsManifold && isOfStep(result);
    if (isOwnStep && m_manifold->getNumContacts() > 0)
    {
        for (int i = 0; i < patch.count; ++i)
        {
            const ContactPoint& point = patch.points[static_cast<std::size_t>(i)];
            renewal.renew(onB + point.fromTouch + normal * (point.distance - margins));
        }
        renewal.removeOthers();
    }
    if (isOwnStep && !renewal.isFirstStale() &&
        updateManifold(contactOf(patch, normal, onB, margins), result, *m_manifold))
    {
        m_isRefreshed = true;
        return;
    }
    for (int i = 0; i < patch.count; ++i)
    {
        const ContactPoint& point = patch.points[static_cast<std::size_t>(i)];
        result.addContactPoint(normal, onB + point.fromTouch, point.distance - margins);
        renewal.removeFirst();
    }
}

/// Reports the touch of two triangles, if they are near.
void IsaGjkAlgorithm::reportTriangles(const ConvexPair& pair, const TriangleTouch& triangles,
                                      btScalar extraDistance, btManifoldResult& result)
{
    IsaGjkRegistration::Counters& counters = isaGjk().counters();
    m_cache = {};
    m_isSettled = true;
    GjkSearch<PosedShape, PosedShape>::rememberAxis(triangles.normal(), -1, -1, m_cache);
    if (triangles.state() == TrianglePairState::Apart)
    {
        m_cache.state = GjkState::Separated;
        return count(counters.separated);
    }
    m_cache.state = GjkState::Near;
    count(counters.touching);
    const ConvexCores cores(pair, {}, m_hulls, isaGjk().queryPass());
    report(pair, cores, triangles.touchOf(cores), extraDistance, result);
}

/// @return false if Bullet's own algorithm must answer
bool IsaGjkAlgorithm::collide(const ConvexPair& pair, const btDispatcherInfo& info, FailedProof& failed,
                              btManifoldResult& result)
{
    bool isReporting = false;
    try
    {
        return collideOrThrow(pair, info, failed, result, isReporting);
    }
    catch (const std::exception&)
    {
        // Exceptions of contact callbacks are passed on to the application.
        if (isReporting)
            throw;
        count(isaGjk().counters().notConverged);
        return false;
    }
}

/// @param isReporting [out] contact callbacks may be running
[[gnu::always_inline]] inline bool IsaGjkAlgorithm::collideOrThrow(const ConvexPair& pair,
                                                                   const btDispatcherInfo& info,
                                                                   FailedProof& failed,
                                                                   btManifoldResult& result,
                                                                   bool& isReporting)
{
    IsaGjkRegistration::Counters& counters = isaGjk().counters();
    const bool isStep = isOfStep(result);
    const btScalar limit = limitOf(pair, m_breakingThreshold, result, isStep);
    if (!pair.isConvex() || !pair.a.isFinite() || !pair.b.isFinite())
        return true;
    if (pair.isLeftToBullet())
    {
        count(counters.delegated);
        return false;
    }
    if (areFiniteTriangles(pair) && !usesSeparatingAxisTest(pair, info))
    {
        const TriangleTouch triangles(pair, limit);
        if (triangles.state() != TrianglePairState::Unknown)
        {
            isReporting = true;
            reportTriangles(pair, triangles, isStep ? btScalar(0) : result.m_closestPointDistanceThreshold,
                            result);
            return true;
        }
    }
    ConvexCores cores(pair, failed.hulls, m_hulls, passOf(isStep));
    if (!cores.haveCores(pair))
    {
        if (!pair.a.hasPoints() || !pair.b.hasPoints())
            return true;
        count(counters.notConverged);
        return false;
    }
    const bool arePolytopes = cores.a && cores.b;
    Touch touch;
    GjkState state;
    if (arePolytopes && !usesSeparatingAxisTest(pair, info))
        state = search(pair, cores, limit, failed.axis, passOf(isStep), touch);
    else
    {
        // Bullet handles all other shapes that touch, and detects as well when they separate.
        const bool isBulletContact = !arePolytopes && m_ownsManifold && m_manifold->getNumContacts() > 0;
        state = isBulletContact
                    ? GjkState::Near
                    : testSeparation(pair, cores, padLimit(pair, cores, limit), failed.axis, m_cache);
        if (state == GjkState::Near || state == GjkState::Overlapping)
        {
            count(counters.delegated);
            return false;
        }
    }
    if (state == GjkState::Separated || state == GjkState::NotConverged)
    {
        count(state == GjkState::Separated ? counters.separated : counters.notConverged);
        return state == GjkState::Separated;
    }
    count(counters.touching);
    if (state == GjkState::Overlapping)
        count(counters.depths);
    isReporting = true;
    report(pair, cores, touch, isStep ? btScalar(0) : result.m_closestPointDistanceThreshold, result);
    return true;
}

/// See searchSettled().
GjkState IsaGjkAlgorithm::search(const ConvexPair& pair, ConvexCores& cores, btScalar limit,
                                 const AxisTest<btScalar>& failed, std::uint64_t pass, Touch& touch)
{
    // The algorithm of a mesh's triangle exists for one query only.
    const bool isPersistentPair = pair.a.kind != ConvexKind::Triangle && pair.b.kind != ConvexKind::Triangle;
    const bool makesPatch = !m_closestOnly && isaGjk().options().patchPoints > 1;
    const SearchSetup setup = {
        pair, m_hulls, pass, isPersistentPair ? &m_epaCache : nullptr, makesPatch, isaGjk().counters().exact};
    const ContactSearchResult found = searchSettled(setup, cores, limit, failed, m_isSettled, m_cache, touch);
    m_isSettled = found.isSettled;
    return found.state;
}

void IsaGjkAlgorithm::runBulletAlgorithm(const ConvexPair& pair, const btDispatcherInfo& info,
                                         btManifoldResult& result)
{
    // With a given manifold, Bullet's algorithm owns nothing, and its construction costs next to nothing.
    const btCollisionAlgorithmConstructionInfo construction(m_dispatcher, 0);
    const btConvexConvexAlgorithm::CreateFunc& stock = isaGjk().stock();
    btConvexConvexAlgorithm algorithm(m_manifold, construction, pair.wrapA, pair.wrapB, stock.m_pdSolver,
                                      stock.m_numPerturbationIterations,
                                      stock.m_minimumPointsPerturbationThreshold);
    algorithm.processCollision(pair.wrapA, pair.wrapB, info, &result);
}

btScalar IsaGjkAlgorithm::calculateTimeOfImpact(btCollisionObject* a, btCollisionObject* b,
                                                const btDispatcherInfo& info, btManifoldResult* result)
{
    const btCollisionAlgorithmConstructionInfo construction(m_dispatcher, 0);
    btConvexConvexAlgorithm algorithm(m_manifold, construction, nullptr, nullptr, isaGjk().stock().m_pdSolver,
                                      0, 0);
    return algorithm.calculateTimeOfImpact(a, b, info, result);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
