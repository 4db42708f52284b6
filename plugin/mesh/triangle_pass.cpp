// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_pass.h"

#include "cullet/plugin/contact/manifold_renewal.h"
#include "cullet/plugin/contact/manifold_update.h"
#include "cullet/plugin/mesh/face_touch.h"
#include "cullet/plugin/mesh/shown_triangle.h"
#include "cullet/plugin/mesh/triangle_source.h"

#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Hands on what Bullet's algorithm reports for a triangle, as points of the mesh.
template <class Add>
class Collector final : public btManifoldResult
{
public:
    Collector(const btCollisionObjectWrapper& convex, const btCollisionObjectWrapper& wrap,
              const TriangleBatch::Triangle& triangle, const CoreFrame& frame, const Add& add)
        : btManifoldResult(&convex, &wrap), m_triangle(triangle), m_frame(frame), m_add(add)
    {
    }

    void addContactPoint(const btVector3& normal, const btVector3& onMesh, btScalar distance) override
    {
        m_add({m_frame.ofWorld(onMesh + normal * distance),
               m_frame.turnedOfWorld(normal),
               double(distance),
               m_triangle,
               {}});
    }

private:
    const TriangleBatch::Triangle& m_triangle;
    const CoreFrame& m_frame;
    const Add& m_add;
};

Eigen::Vector3d toDouble(const std::array<float, 3>& v)
{
    return {double(v[0]), double(v[1]), double(v[2])};
}

/// As in Bullet, a sphere touches the triangles themselves.
btScalar marginOfMesh(const ConvexSide& convex, const btCollisionObjectWrapper& mesh)
{
    return convex.kind == ConvexKind::Sphere ? btScalar(0) : mesh.getCollisionShape()->getMargin();
}

std::array<float, 3> toFloat(const Eigen::Vector3d& v)
{
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

/// Puts a direction of any length into a cache.
void rememberDirection(const Eigen::Vector3d& direction, GjkCache<btScalar>& cache)
{
    const double largest = direction.cwiseAbs().maxCoeff();
    rememberAxis(Eigen::Vector3d(direction * (largest > 0.0 ? 1.0 / largest : 0.0)), cache);
}
}  // namespace

TrianglePass::TrianglePass(IsaGjkRegistration& isaGjk, MeshQuery& query, const btCollisionShape& core,
                           const btCollisionObjectWrapper& convex, const btCollisionObjectWrapper& mesh,
                           btDispatcher& dispatcher, const btDispatcherInfo& info, btManifoldResult& result,
                           MeshRegion* region)
    : m_isaGjk(isaGjk),
      m_query(query),
      m_convex(convex),
      m_mesh(mesh),
      m_side(core, convex.getWorldTransform()),
      m_dispatcher(dispatcher),
      m_info(info),
      m_result(result),
      m_frame(frameOf(region)),
      m_limits{marginOfMesh(m_side, mesh), query.manifold.getContactBreakingThreshold()},
      m_showsEveryPoint(showsEveryPoint()),
      m_reading(correctsEdges() ? Reading::Candidates : Reading::Batch),
      m_touches(double(m_limits.breakingThreshold)),
      m_points(double(m_limits.breakingThreshold)),
      m_region(region)
{
}

/// @param region null: none
CoreFrame TrianglePass::frameOf(MeshRegion* region) const
{
    const btTransform &core = m_convex.getWorldTransform(), &mesh = m_mesh.getWorldTransform();
    if (m_side.kind == ConvexKind::Sphere || m_side.kind == ConvexKind::Support)
        return CoreFrame(core, mesh, FrameAxes::World);
    return region != nullptr ? region->frameOf(core, mesh) : CoreFrame(core, mesh, FrameAxes::Core);
}

bool TrianglePass::showsEveryPoint() const
{
    const int flags =
        m_convex.getCollisionObject()->getCollisionFlags() | m_mesh.getCollisionObject()->getCollisionFlags();
    // Bullet's algorithm finds one point for a triangle; several steps fill the manifold.
    return m_side.kind == ConvexKind::Support ||
           (gContactAddedCallback != nullptr &&
            (flags & btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK) != 0);
}

bool TrianglePass::correctsEdges() const
{
    return m_isaGjk.options().activeEdges && !hasInternalEdges(*m_mesh.getCollisionShape());
}

void TrianglePass::run()
{
    // The box that Bullet asks for.
    const btTransform inMesh = m_mesh.getWorldTransform().inverse() * m_convex.getWorldTransform();
    m_convex.getCollisionShape()->getAabb(inMesh, m_boxMin, m_boxMax);
    const btScalar meshMargin = m_mesh.getCollisionShape()->getMargin();
    const btVector3 margin(meshMargin, meshMargin, meshMargin);
    m_boxMin -= margin;
    m_boxMax += margin;
    m_query.next.clear();
    readMesh();
    flush();
    storeAxes();
    m_query.known.swap(m_query.next);
    renewManifold();
}

void TrianglePass::readMesh()
{
    const auto& shape = *static_cast<const btConcaveShape*>(m_mesh.getCollisionShape());
    // A contact whose edges are corrected may be outside of the box by as much, and so may the neighbours there.
    const bool hasCandidates = m_reading == Reading::Candidates;
    const btScalar more = hasCandidates ? m_limits.breakingThreshold : btScalar(0);
    const btVector3 grown(more, more, more);
    m_readMin = m_boxMin - grown;
    m_readMax = m_boxMax + grown;
    m_query.candidates.clear();
    if (m_region != nullptr && m_region->covers(m_readMin, m_readMax))
        m_region->forEachTriangle(*this, m_readMin, m_readMax);
    else
        forEachTriangle(shape, *this, m_readMin, m_readMax);
    if (hasCandidates)
        readCandidates();
}

void TrianglePass::processTriangle(btVector3* corners, int part, int index)
{
    if (m_hash)
        m_hash->add(corners, part, index);
    if (m_reading == Reading::Batch)
        return addToBatch(corners, part, index);
    try
    {
        m_query.candidates.push_back({{corners[0], corners[1], corners[2]}, part, index});
    }
    catch (const std::bad_alloc&)
    {
        // No triangle is lost; edges are those of Bullet.
        m_reading = Reading::Batch;
        readCandidates();
        m_query.candidates.clear();
        addToBatch(corners, part, index);
    }
}

void TrianglePass::storeTriangles(KeptMeshContacts& kept) const
{
    kept.setTriangles(*static_cast<const btConcaveShape*>(m_mesh.getCollisionShape()), m_readMin, m_readMax,
                      m_hash ? &*m_hash : nullptr);
}

void TrianglePass::readCandidates()
{
    for (const TriangleBatch::Triangle& triangle : m_query.candidates)
        addToBatch(triangle.corners, triangle.part, triangle.index);
}

void TrianglePass::addToBatch(const btVector3* corners, int part, int index)
{
    if (!TestTriangleAgainstAabb2(corners, m_boxMin, m_boxMax))
        return;
    m_batch.add(corners, part, index);
    if (m_batch.isFull())
        flush();
}

/// What all triangles are compared with. Most bodies above a mesh have none in their boxes.
///
/// @return false for a core without points, or without memory
bool TrianglePass::examineCore()
{
    // Bounds along the core's own axes are tight. Fewer triangles are not compared with bounds.
    if (m_side.kind == ConvexKind::Support && m_batch.count() > kMostPatches)
        m_frame = CoreFrame(m_convex.getWorldTransform(), m_mesh.getWorldTransform(), FrameAxes::Core);
    m_search.emplace(m_isaGjk, m_side, m_frame, m_query.hulls, m_limits);
    return m_search->isPossible();
}

void TrianglePass::flush()
{
    if (m_batch.count() == 0)
        return;
    const bool isPossible = m_search ? m_search->isPossible() : examineCore();
    if (isPossible)
    {
        m_isaGjk.counters().triangles.add(static_cast<std::uint64_t>(m_batch.count()));
        placeBatch();
        unsigned asked = 0;
        for (int i = 0; i < m_batch.count(); ++i)
        {
            if (!m_batch.isNear(i))
                continue;
            ++asked;
            ask(i);
        }
        m_isaGjk.counters().trianglesAsked.add(asked);
    }
    m_batch.clear();
}

void TrianglePass::placeBatch()
{
    if (!m_bounds && m_batch.count() <= kMostPatches)
        return m_batch.placeAll(m_frame);
    if (!m_bounds)
    {
        m_bounds = m_search->bounds();
        recallAxes();
    }
    const double limit = double(m_search->limit());
    m_batch.place(m_frame, *m_bounds, limit, limit + m_search->size());
    useAxes();
}

/// @return the result for a triangle; an axis that separates it has been tried on those that follow
ContactSearchResult TrianglePass::search(int i, const TriangleSearch::Corners& corners)
{
    if (!m_bounds && m_search->isFar(corners))
        return {GjkState::Separated, false};
    std::optional<ContactSearchResult> found = m_search->answerAtOnce(corners);
    Eigen::Vector3d axis = m_search->normal();  // from the triangle to the core
    if (!found)
    {
        const TriangleBatch::Triangle triangle = m_batch.triangle(i);
        GjkCache<btScalar> cache = recall(triangle);
        found = m_search->search(cache);
        if (found->isSettled)
            remember(triangle, cache);
        axis = toDouble(cache.axis);
    }
    if (found->state == GjkState::Separated && m_bounds)
        learnAxis(-axis, i + 1);
    return *found;
}

void TrianglePass::ask(int i)
{
    const TriangleSearch::Corners corners = {m_batch.corner(i, 0), m_batch.corner(i, 1),
                                             m_batch.corner(i, 2)};
    const ContactSearchResult found = search(i, corners);
    switch (found.state)
    {
        case GjkState::Separated:
            return;
        case GjkState::NotConverged:
            askBullet(m_batch.triangle(i));
            break;
        default:
            if (m_reading == Reading::Candidates && !correct(corners, m_batch.triangle(i)))
                return;
            addTouch(i, corners);
            if (m_reading == Reading::Batch && found.state == GjkState::Near && found.isSettled &&
                !m_showsEveryPoint)
                m_batch.dropRepeats(i, m_search->normal(), m_search->touchedPoint());
    }
    if (m_showsEveryPoint)
        showPoints();
}

void TrianglePass::askBullet(const TriangleBatch::Triangle& triangle)
{
    const WrappedTriangle wrapped(m_mesh, triangle);
    if (m_side.kind == ConvexKind::Support && m_reading == Reading::Batch)
    {
        // The manifold gets every point as it is.
        const ShownTriangle shown(m_result, m_mesh, wrapped.wrap());
        return askBullet(wrapped.wrap(), m_result);
    }
    const auto add = [&](MeshPoint point)
    {
        if (m_reading == Reading::Batch || correct(point))
            m_points.add(point);
    };
    Collector<decltype(add)> result(m_convex, wrapped.wrap(), triangle, m_frame, add);
    askBullet(wrapped.wrap(), result);
}

void TrianglePass::askBullet(const btCollisionObjectWrapper& triangle, btManifoldResult& result)
{
    const btCollisionAlgorithmConstructionInfo construction(&m_dispatcher, 0);
    btConvexConvexAlgorithm algorithm(&m_query.manifold, construction, &m_convex, &triangle,
                                      m_isaGjk.stock().m_pdSolver, 0, 0);
    algorithm.processCollision(&m_convex, &triangle, m_info, &result);
}

/// Adds what the last search has found.
void TrianglePass::addTouch(int i, const TriangleSearch::Corners& corners)
{
    const TriangleBatch::Triangle triangle = m_batch.triangle(i);
    if (m_search->isTouchAlone())
        return m_search->addTouch(m_search->placeOnConvex(), triangle, m_points);
    // Of few triangles, each has its patch, and the search is still there.
    if (!m_bounds)
        return m_search->addPatch(triangle, corners, m_touches);
    m_search->addTouch(m_batch.middleWithin(i, *m_bounds), triangle, m_touches);
}

void TrianglePass::makePatches()
{
    if (!m_bounds)
    {
        // Points without a patch come first, and are rare.
        if (m_points.count() > 0)
            m_points.take(m_touches);
        m_found = m_points.count() > 0 ? &m_points : &m_touches;
        return;
    }
    if (m_touches.count() > kMostPatches)
        m_touches.reduce(kMostPatches);
    for (int i = 0; i < m_touches.count(); ++i)
    {
        const TriangleBatch::Triangle& triangle = m_touches[i].triangle;
        m_search->returnTo(m_touches[i].touch);
        m_search->addPatch(triangle,
                           {m_frame.ofMesh(triangle.corners[0]), m_frame.ofMesh(triangle.corners[1]),
                            m_frame.ofMesh(triangle.corners[2])},
                           m_points);
    }
    m_touches.clear();
}

/// Gives the manifold all points of the last triangle.
void TrianglePass::showPoints()
{
    makePatches();
    addToManifold([] {});
    m_found->clear();
}

/// What is known of a triangle from the last step, which came in the same order, with some more and some fewer.
GjkCache<btScalar> TrianglePass::recall(const TriangleBatch::Triangle& triangle)
{
    const std::vector<TriangleMemory>& known = m_query.known;
    for (std::size_t i = 0; i < known.size(); ++i)
    {
        const std::size_t wrapped = m_likely + i < known.size() ? 0 : known.size();
        const std::size_t place = m_likely + i - wrapped;
        if (known[place].index != triangle.index || known[place].part != triangle.part)
            continue;
        m_likely = place + 1;
        GjkCache<btScalar> search = known[place].search;
        rememberDirection(m_frame.meshBasis() * toDouble(search.axis), search);
        return search;
    }
    return {};
}

void TrianglePass::remember(const TriangleBatch::Triangle& triangle, GjkCache<btScalar> search)
{
    if (m_query.next.size() == MeshQuery::kMostKnown)
        return;
    rememberDirection(m_frame.meshBasis().transpose() * toDouble(search.axis), search);
    try
    {
        m_query.next.push_back({triangle.part, triangle.index, search});
    }
    catch (const std::bad_alloc&)
    {
        // Then the next search for this triangle begins anywhere.
    }
}

void TrianglePass::useAxes()
{
    for (std::size_t i = 0; i < m_axisCount; ++i)
        m_axes[i].dropped += m_batch.dropBeyond(m_axes[i].axis, 0);
}

/// Tries an axis on the triangles that follow, and keeps it if it drops any.
void TrianglePass::learnAxis(const Eigen::Vector3d& direction, int next)
{
    if (next >= m_batch.count() || !(direction.squaredNorm() > 0.0))
        return;
    UsedAxis tried = {axisAlong(direction.normalized()), {}, 0};
    tried.dropped = m_batch.dropBeyond(tried.axis, next);
    if (tried.dropped == 0)
        return;
    tried.inMesh = toFloat(m_frame.meshBasis().transpose() * tried.axis.direction);
    if (m_axisCount < m_axes.size())
        m_axes[m_axisCount++] = tried;
    else
        *std::min_element(m_axes.begin(), m_axes.end(),
                          [](const UsedAxis& a, const UsedAxis& b) { return a.dropped < b.dropped; }) = tried;
}

CoreAxis TrianglePass::axisAlong(const Eigen::Vector3d& direction) const
{
    return {direction, m_search->heightAlong(direction)};
}

void TrianglePass::recallAxes()
{
    for (std::size_t i = 0; i < m_query.axisCount; ++i)
    {
        const Eigen::Vector3d direction = m_frame.meshBasis() * toDouble(m_query.axes[i]);
        if (direction.squaredNorm() > 0.0)
            m_axes[m_axisCount++] = {axisAlong(direction.normalized()), m_query.axes[i], 0};
    }
}

void TrianglePass::storeAxes()
{
    if (!m_bounds)
        return;
    m_query.axisCount = 0;
    for (std::size_t i = 0; i < m_axisCount; ++i)
    {
        if (m_axes[i].dropped > 0)
            m_query.axes[m_query.axisCount++] = m_axes[i].inMesh;
    }
}

/// Replaces the points of the manifold by those of this call that carry the contact.
void TrianglePass::renewManifold()
{
    makePatches();
    m_found->reduce(m_isaGjk.options().patchPoints);
    ManifoldRenewal renewal(m_query.manifold);
    if (m_found->count() > 0 && m_query.manifold.getNumContacts() > 0)
    {
        for (int i = 0; i < m_found->count(); ++i)
            renewal.renew(m_frame.toWorld((*m_found)[i].place));
        renewal.removeOthers();
    }
    if (m_found->count() > 0 && !m_showsEveryPoint && PointUpdate::isPossible(m_result))
        addAtOnce(renewal);
    else
        addToManifold([&] { renewal.removeFirst(); });
}

/// addToManifold() where nobody sees the triangle of a point.
void TrianglePass::addAtOnce(ManifoldRenewal& renewal)
{
    PointUpdate update(m_result, m_query.manifold);
    for (int i = 0; i < m_found->count(); ++i)
    {
        const MeshPoint& point = (*m_found)[i];
        identify(m_result, m_mesh, point.triangle.part, point.triangle.index);
        update.add(m_frame.turnedToWorld(point.normal),
                   m_frame.toWorld(point.place - point.distance * point.normal),
                   static_cast<btScalar>(point.distance));
        renewal.removeFirst();
    }
}

/// Adds all points.
///
/// @param afterEach called after each of them
template <class AfterEach>
void TrianglePass::addToManifold(const AfterEach& afterEach)
{
    for (int i = 0; i < m_found->count();)
    {
        const TriangleBatch::Triangle& triangle = (*m_found)[i].triangle;
        const WrappedTriangle wrapped(m_mesh, triangle);
        const ShownTriangle shown(m_result, m_mesh, wrapped.wrap());
        do
        {
            const MeshPoint& point = (*m_found)[i];
            m_result.addContactPoint(m_frame.turnedToWorld(point.normal),
                                     m_frame.toWorld(point.place - point.distance * point.normal),
                                     static_cast<btScalar>(point.distance));
            afterEach();
            ++i;
        } while (i < m_found->count() && areSame((*m_found)[i].triangle, triangle));
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
