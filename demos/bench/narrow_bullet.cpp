// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/bench/narrow_subject.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
btTransform transformOf(const Pose<btScalar>& pose)
{
    const auto& m = pose.basis;
    return btTransform(
        btMatrix3x3(m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)),
        btVector3(pose.origin.x(), pose.origin.y(), pose.origin.z()));
}

/// Bullet's detector as its convex algorithm calls it, with margin 0. It has one answer for all three queries.
class BulletNarrow : public NarrowSubject
{
public:
    explicit BulletNarrow(const NarrowRequest& request)
    {
        const Hull<btScalar>& hull = request.trajectories.hull();
        for (int v = 0; v < hull.vertexCount(); ++v)
            m_shape.addPoint(btVector3(hull.vertex(v).x(), hull.vertex(v).y(), hull.vertex(v).z()), false);
        m_shape.recalcLocalAabb();
        m_shape.setMargin(btScalar(0));
        for (const PairScene<btScalar>& scene : request.trajectories.scenes())
        {
            btGjkPairDetector::ClosestPointInput input;
            input.m_transformA = transformOf(scene.a);
            input.m_transformB = transformOf(scene.b);
            if (request.query == NarrowQuery::Contacts)
                input.m_maximumDistanceSquared = btScalar(kContactDistance * kContactDistance);
            m_inputs.push_back(input);
        }
    }

    void run(std::vector<NarrowAnswer>& answers) override
    {
        for (int i = 0; i < m_inputs.size(); ++i)
        {
            btVoronoiSimplexSolver simplex;
            btGjkEpaPenetrationDepthSolver depth;
            btGjkPairDetector detector(&m_shape, &m_shape, &simplex, &depth);
            btPointCollector out;
            detector.getClosestPoints(m_inputs[i], out, nullptr);
            answers[i] = {};
            if (!out.m_hasResult)
                continue;
            answers[i].isOverlapping = out.m_distance <= btScalar(0);
            answers[i].distance = out.m_distance;
        }
    }

private:
    btConvexHullShape m_shape;
    btAlignedObjectArray<btGjkPairDetector::ClosestPointInput> m_inputs;
};
}  // namespace

std::unique_ptr<NarrowSubject> makeBulletNarrow(const NarrowRequest& request)
{
    return std::make_unique<BulletNarrow>(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
