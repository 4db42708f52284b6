// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_shape.h"
#include "cullet/demos/bench/narrow/narrow_subject.h"
#include "cullet/plugin/isa_gjk.h"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Adds points to the manifold, as in a step, and stores the deepest one. Cullet distinguishes it by its class from the
/// result of a step; so it is used outside of the timing only.
class RecordingResult final : public btManifoldResult
{
public:
    using btManifoldResult::btManifoldResult;

    void addContactPoint(const btVector3& normal, const btVector3& point, btScalar depth) override
    {
        if (depth <= btScalar(kContactDistance))
            deepest = std::min(deepest, depth);
        btManifoldResult::addContactPoint(normal, point, depth);
    }

    btScalar deepest = BT_LARGE_FLOAT;
};

/// Two bodies and their algorithm, created and called as by btCollisionDispatcher's near callback.
class AlgorithmPair
{
public:
    AlgorithmPair(btCollisionDispatcher& dispatcher, btCollisionShape& shape) : m_dispatcher(dispatcher)
    {
        m_a.setCollisionShape(&shape);
        m_b.setCollisionShape(&shape);
    }
    ~AlgorithmPair() { forget(); }
    AlgorithmPair(const AlgorithmPair&) = delete;
    AlgorithmPair& operator=(const AlgorithmPair&) = delete;

    void forget()
    {
        if (m_algorithm == nullptr)
            return;
        m_algorithm->~btCollisionAlgorithm();
        m_dispatcher.freeCollisionAlgorithm(m_algorithm);
        m_algorithm = nullptr;
    }

    template <class Result>
    NarrowAnswer ask(const btTransform& a, const btTransform& b)
    {
        m_a.setWorldTransform(a);
        m_b.setWorldTransform(b);
        const btCollisionObjectWrapper wrapA(nullptr, m_a.getCollisionShape(), &m_a, a, -1, -1);
        const btCollisionObjectWrapper wrapB(nullptr, m_b.getCollisionShape(), &m_b, b, -1, -1);
        if (m_algorithm == nullptr)
            m_algorithm = m_dispatcher.findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
        Result result(&wrapA, &wrapB);
        m_algorithm->processCollision(&wrapA, &wrapB, m_info, &result);
        return answerOf(result);
    }

private:
    static NarrowAnswer answerOf(const btManifoldResult&) { return {}; }
    static NarrowAnswer answerOf(const RecordingResult& result)
    {
        NarrowAnswer answer;
        if (result.deepest == BT_LARGE_FLOAT)
            return answer;
        answer.isOverlapping = result.deepest <= btScalar(0);
        answer.distance = result.deepest;
        return answer;
    }

    btCollisionDispatcher& m_dispatcher;
    btDispatcherInfo m_info;
    btCollisionObject m_a, m_b;
    btCollisionAlgorithm* m_algorithm = nullptr;
};

class AlgorithmNarrow : public NarrowSubject
{
public:
    AlgorithmNarrow(const NarrowRequest& request, bool isIsaGjk)
        : m_dispatcher(&m_configuration), m_remembers(request.isWarm || !isIsaGjk)
    {
        // One contact distance for all shapes, as in the other queries.
        m_dispatcher.setDispatcherFlags(m_dispatcher.getDispatcherFlags() &
                                        ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
        if (isIsaGjk)
            registerIsaGjk(m_dispatcher);
        fillShape(request.trajectories.hull(), m_shape);
        for (const PairScene<btScalar>& scene : request.trajectories.scenes())
            m_places.push_back({transformOf(scene.a), transformOf(scene.b)});
        for (int i = 0; i < NarrowTrajectories::kPairs; ++i)
            m_pairs.push_back(std::make_unique<AlgorithmPair>(m_dispatcher, m_shape));
    }

    void run(std::vector<NarrowAnswer>& answers) override { queryAll<btManifoldResult>(answers); }
    void completeAnswers(std::vector<NarrowAnswer>& answers) override { queryAll<RecordingResult>(answers); }

private:
    template <class Result>
    void queryAll(std::vector<NarrowAnswer>& answers)
    {
        for (const auto& pair : m_pairs)
            pair->forget();
        for (std::size_t i = 0; i < m_places.size(); ++i)
        {
            AlgorithmPair& pair = *m_pairs[i % m_pairs.size()];
            if (!m_remembers)
                pair.forget();
            answers[i] = pair.ask<Result>(m_places[i].a, m_places[i].b);
        }
    }

    struct Places
    {
        btTransform a, b;
    };

    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher;
    btConvexHullShape m_shape;
    bool m_remembers;
    std::vector<Places> m_places;
    std::vector<std::unique_ptr<AlgorithmPair>> m_pairs;
};
}  // namespace

std::unique_ptr<NarrowSubject> makeAlgorithmNarrow(const NarrowRequest& request, bool isIsaGjk)
{
    return std::make_unique<AlgorithmNarrow>(request, isIsaGjk);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
