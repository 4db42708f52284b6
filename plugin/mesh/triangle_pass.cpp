// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_pass.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Shows the result of a pair the triangle in place of its mesh, as contact callbacks expect it.
class ShownTriangle
{
public:
    ShownTriangle(btManifoldResult& result, const btCollisionObjectWrapper& mesh,
                  const btCollisionObjectWrapper& triangle)
        : m_result(result), m_isFirst(result.getBody0Internal() == mesh.getCollisionObject())
    {
        m_before = m_isFirst ? result.getBody0Wrap() : result.getBody1Wrap();
        if (m_isFirst)
        {
            result.setBody0Wrap(&triangle);
            result.setShapeIdentifiersA(triangle.m_partId, triangle.m_index);
        }
        else
        {
            result.setBody1Wrap(&triangle);
            result.setShapeIdentifiersB(triangle.m_partId, triangle.m_index);
        }
    }
    ~ShownTriangle()
    {
        if (m_isFirst)
            m_result.setBody0Wrap(m_before);
        else
            m_result.setBody1Wrap(m_before);
    }
    ShownTriangle(const ShownTriangle&) = delete;
    ShownTriangle& operator=(const ShownTriangle&) = delete;

private:
    btManifoldResult& m_result;
    const btCollisionObjectWrapper* m_before;
    bool m_isFirst;
};

Eigen::Vector3d toDouble(const std::array<float, 3>& v)
{
    return {double(v[0]), double(v[1]), double(v[2])};
}
}  // namespace

TrianglePass::TrianglePass(IsaGjkRegistration& isaGjk, MeshQuery& query,
                           const btCollisionObjectWrapper& convex, const btCollisionObjectWrapper& mesh,
                           const btDispatcherInfo& info, btManifoldResult& result)
    : m_isaGjk(isaGjk),
      m_query(query),
      m_convex(convex),
      m_mesh(mesh),
      m_side(*convex.getCollisionShape(), convex.getWorldTransform()),
      m_info(info),
      m_result(result),
      m_frame(convex.getWorldTransform(), mesh.getWorldTransform()),
      m_core(poseShape(m_side.shape, m_side.kind, btTransform::getIdentity(), query.hull, isaGjk.pass())),
      m_margin(mesh.getCollisionShape()->getMargin()),
      m_limit(double(m_side.margin) + double(m_margin) + double(query.manifold.getContactBreakingThreshold()))
{
}

void TrianglePass::run()
{
    // The box that Bullet asks for.
    const btTransform inMesh = m_mesh.getWorldTransform().inverse() * m_convex.getWorldTransform();
    m_side.shape.getAabb(inMesh, m_boxMin, m_boxMax);
    const btVector3 margin(m_margin, m_margin, m_margin);
    m_boxMin -= margin;
    m_boxMax += margin;
    m_query.next.clear();
    static_cast<const btConcaveShape*>(m_mesh.getCollisionShape())
        ->processAllTriangles(this, m_boxMin, m_boxMax);
    flush();
    storeAxes();
    m_query.known.swap(m_query.next);
}

void TrianglePass::processTriangle(btVector3* corners, int part, int index)
{
    if (!TestTriangleAgainstAabb2(corners, m_boxMin, m_boxMax))
        return;
    m_batch.add(corners, part, index);
    if (m_batch.isFull())
        flush();
}

/// What all triangles are compared with. Most bodies above a mesh have none in their boxes.
void TrianglePass::examineCore()
{
    m_bounds.emplace();
    for (int i = 0; i < 3; ++i)
    {
        m_bounds->high[i] = axisAlong(Eigen::Vector3d::Unit(i)).height;
        m_bounds->low[i] = -axisAlong(-Eigen::Vector3d::Unit(i)).height;
    }
    recallAxes();
}

void TrianglePass::flush()
{
    if (m_batch.count() == 0)
        return;
    if (!m_bounds)
        examineCore();
    m_batch.place(m_frame, m_limit, m_limit + double(m_core->size()));
    m_batch.dropOutside(m_bounds->low, m_bounds->high);
    useAxes();
    unsigned asked = 0;
    for (int i = 0; i < m_batch.count(); ++i)
    {
        if (!m_batch.isNear(i))
            continue;
        ++asked;
        ask(m_batch.triangle(i));
        learnAxis(i + 1);
    }
    m_isaGjk.counters().triangles.add(static_cast<std::uint64_t>(m_batch.count()));
    m_isaGjk.counters().trianglesAsked.add(asked);
    m_batch.clear();
}

void TrianglePass::ask(const TriangleBatch::Triangle& triangle)
{
    btTriangleShape shape(triangle.corners[0], triangle.corners[1], triangle.corners[2]);
    shape.setMargin(m_margin);
    const btCollisionObjectWrapper wrap(&m_mesh, &shape, m_mesh.getCollisionObject(),
                                        m_mesh.getWorldTransform(), triangle.part, triangle.index);
    if (const GjkCache<btScalar>* search = recall(triangle))
        m_query.triangles.beginAt(*search);
    {
        const ShownTriangle shown(m_result, m_mesh, wrap);
        m_query.triangles.processCollision(&m_convex, &wrap, m_info, &m_result);
    }
    remember(triangle);
}

/// @return null if the triangle was not asked in the last step
const GjkCache<btScalar>* TrianglePass::recall(const TriangleBatch::Triangle& triangle)
{
    const std::vector<TriangleMemory>& known = m_query.known;
    // Triangles come in the same order as in the last step, with some more and some fewer.
    for (std::size_t i = 0; i < known.size(); ++i)
    {
        const std::size_t wrapped = m_likely + i < known.size() ? 0 : known.size();
        const std::size_t place = m_likely + i - wrapped;
        if (known[place].index != triangle.index || known[place].part != triangle.part)
            continue;
        m_likely = place + 1;
        return &known[place].search;
    }
    return nullptr;
}

void TrianglePass::remember(const TriangleBatch::Triangle& triangle)
{
    if (!m_query.triangles.isSettled() || m_query.next.size() == MeshQuery::kMostKnown)
        return;
    try
    {
        m_query.next.push_back({triangle.part, triangle.index, m_query.triangles.lastSearch()});
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

/// Tries the axis of the last answer on the triangles that follow.
void TrianglePass::learnAxis(int next)
{
    const GjkCache<btScalar>& cache = m_query.triangles.lastSearch();
    if (cache.state != GjkState::Separated || next >= m_batch.count())
        return;
    // The cache's axis points from the triangle to the core, in the world.
    const Eigen::Vector3d direction = m_frame.turn * -toDouble(cache.axis);
    if (!(direction.squaredNorm() > 0.0))
        return;
    UsedAxis learned = {axisAlong(direction.normalized()), {}, 0};
    learned.dropped = m_batch.dropBeyond(learned.axis, next);
    if (learned.dropped == 0)
        return;
    const Eigen::Vector3d inMesh = m_frame.basis.transpose() * learned.axis.direction;
    for (int i = 0; i < 3; ++i)
        learned.inMesh[static_cast<std::size_t>(i)] = static_cast<float>(inMesh[i]);
    if (m_axisCount < m_axes.size())
        m_axes[m_axisCount++] = learned;
    else
        *std::min_element(m_axes.begin(), m_axes.end(),
                          [](const UsedAxis& a, const UsedAxis& b) { return a.dropped < b.dropped; }) =
            learned;
}

CoreAxis TrianglePass::axisAlong(const Eigen::Vector3d& direction) const
{
    return {direction, direction.dot(m_core->support(direction, -1).point + m_core->origin())};
}

void TrianglePass::recallAxes()
{
    for (std::size_t i = 0; i < m_query.axisCount; ++i)
    {
        const Eigen::Vector3d direction = m_frame.basis * toDouble(m_query.axes[i]);
        if (direction.squaredNorm() > 0.0)
            m_axes[m_axisCount++] = {axisAlong(direction.normalized()), m_query.axes[i], 0};
    }
}

void TrianglePass::storeAxes()
{
    m_query.axisCount = 0;
    for (std::size_t i = 0; i < m_axisCount; ++i)
    {
        if (m_axes[i].dropped > 0)
            m_query.axes[m_query.axisCount++] = m_axes[i].inMesh;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
