// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_shape.h"
#include "cullet/demos/bench/narrow/narrow_subject.h"

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
/// Bullet's detector, called as by its convex algorithm, with margin 0. It answers all three queries at once.
class BulletNarrow : public NarrowSubject
{
public:
    explicit BulletNarrow(const NarrowRequest& request)
    {
        fillShape(request.trajectories.hull(), m_shape);
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
    if (request.query == NarrowQuery::Algorithm)
        return makeAlgorithmNarrow(request, false);
    if (isThroughDispatcher(request.query))
        return makeDispatcherNarrow(request, false);
    return std::make_unique<BulletNarrow>(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
