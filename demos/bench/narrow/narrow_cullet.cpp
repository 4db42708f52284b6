// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_subject.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Cache = GjkCache<btScalar>;
using Posed = PosedHull<btScalar>;

/// Counts pairs of support points.
struct CountingObserver
{
    void operator()(const Eigen::Vector3d&, double) { ++count; }
    std::int64_t count = 0;
};

class CulletNarrow : public NarrowSubject
{
public:
    explicit CulletNarrow(const NarrowRequest& request, const IsaGjkVariant& variant = {})
        : m_request(request), m_variant(variant)
    {
        m_pairs.reserve(request.trajectories.scenes().size());
        for (const PairScene<btScalar>& s : request.trajectories.scenes())
            m_pairs.push_back({Posed(*s.hullA, s.a.basis, s.a.origin, request.support),
                               Posed(*s.hullB, s.b.basis, s.b.origin, request.support)});
    }

    void run(std::vector<NarrowAnswer>& answers) override
    {
        NoObserver observer;
        runAll(answers, observer);
    }

    NarrowWork countWork() override
    {
        std::vector<NarrowAnswer> answers(m_request.trajectories.scenes().size());
        CountingObserver observer;
        const std::int64_t iterations = runAll(answers, observer);
        const double count = static_cast<double>(answers.size());
        return {static_cast<double>(iterations) / count, 2.0 * static_cast<double>(observer.count) / count};
    }

private:
    /// @return iterations
    template <class Observer>
    std::int64_t runAll(std::vector<NarrowAnswer>& answers, Observer& observer)
    {
        switch (m_request.query)
        {
            case NarrowQuery::Boolean:
                return runAllPairs([&](const Posed& a, const Posed& b, Cache& cache, NarrowAnswer& answer)
                                   { return answerBoolean(a, b, cache, answer, observer, m_variant); },
                                   answers);
            case NarrowQuery::Distance:
                return runAllPairs([&](const Posed& a, const Posed& b, Cache& cache, NarrowAnswer& answer)
                                   { return answerDistance(a, b, cache, answer, observer, m_variant.start); },
                                   answers);
            default:
                return runAllPairs([&](const Posed& a, const Posed& b, Cache& cache, NarrowAnswer& answer)
                                   { return answerContact(a, b, cache, answer, observer); },
                                   answers);
        }
    }

    template <class Answer>
    std::int64_t runAllPairs(const Answer& answer, std::vector<NarrowAnswer>& answers)
    {
        return m_request.isWarm ? runAllWarm(answer, answers) : runAllCold(answer, answers);
    }

    template <class Answer>
    std::int64_t runAllWarm(const Answer& answer, std::vector<NarrowAnswer>& answers) const
    {
        std::vector<Cache> caches(NarrowTrajectories::kPairs);
        std::int64_t iterations = 0;
        // Read once, since a query takes only a few dozen nanoseconds.
        const std::size_t count = m_pairs.size();
        for (std::size_t i = 0; i < count; ++i)
            iterations +=
                answer(m_pairs[i].a, m_pairs[i].b, caches[i % NarrowTrajectories::kPairs], answers[i]);
        return iterations;
    }

    template <class Answer>
    std::int64_t runAllCold(const Answer& answer, std::vector<NarrowAnswer>& answers) const
    {
        std::int64_t iterations = 0;
        const std::size_t count = m_pairs.size();
        for (std::size_t i = 0; i < count; ++i)
        {
            Cache cache;
            iterations += answer(m_pairs[i].a, m_pairs[i].b, cache, answers[i]);
        }
        return iterations;
    }

    template <class Observer>
    static std::int32_t answerBoolean(const Posed& a, const Posed& b, Cache& cache, NarrowAnswer& answer,
                                      Observer& observer, const IsaGjkVariant& variant)
    {
        const GjkResult<btScalar> result = isaGjk(a, b, btScalar(0), cache, observer, variant);
        answer.isOverlapping = result.state == GjkState::Overlapping;
        return result.iterations;
    }

    template <class Observer>
    static std::int32_t answerDistance(const Posed& a, const Posed& b, Cache& cache, NarrowAnswer& answer,
                                       Observer& observer, GjkStart start)
    {
        const GjkResult<btScalar> result =
            gjkDistance(a, b, std::numeric_limits<btScalar>::infinity(), cache, observer, start);
        answer.isOverlapping = result.state == GjkState::Overlapping;
        answer.distance = result.distance;
        return result.iterations;
    }

    /// Pairs that are too far apart end at the axis test, like most pairs of a world.
    template <class Observer>
    static std::int32_t answerContact(const Posed& a, const Posed& b, Cache& cache, NarrowAnswer& answer,
                                      Observer& observer)
    {
        answer = {};
        const GjkResult<btScalar> near = gjkDistance(a, b, btScalar(kContactDistance), cache, observer);
        if (near.state == GjkState::Near)
            answer.distance = near.distance;
        if (near.state != GjkState::Overlapping)
            return near.iterations;
        const PenetrationResult<btScalar> deep = penetration(a, b, cache);
        answer.isOverlapping = true;
        answer.distance = -deep.depth;
        return near.iterations + deep.iterations;
    }

    struct PosedPair
    {
        Posed a, b;
    };

    NarrowRequest m_request;
    IsaGjkVariant m_variant;
    /// Converted before the timing, as for every library.
    std::vector<PosedPair> m_pairs;
};

/// For near shapes, a fifth step hardly finds more axes; for overlapping ones, each step costs one support.
constexpr int kReflections = 4;

std::unique_ptr<NarrowSubject> makeFromStart(const NarrowRequest& request, GjkStart start)
{
    if (request.query != NarrowQuery::Boolean && request.query != NarrowQuery::Distance)
        return nullptr;
    return std::make_unique<CulletNarrow>(request, IsaGjkVariant{start, 0});
}
}  // namespace

std::unique_ptr<NarrowSubject> makeCulletNarrow(const NarrowRequest& request)
{
    if (request.query == NarrowQuery::Algorithm)
        return makeAlgorithmNarrow(request, true);
    if (isThroughDispatcher(request.query))
        return makeDispatcherNarrow(request, true);
    return std::make_unique<CulletNarrow>(request);
}

std::unique_ptr<NarrowSubject> makeCulletReflectedNarrow(const NarrowRequest& request)
{
    if (request.query != NarrowQuery::Boolean)
        return nullptr;
    return std::make_unique<CulletNarrow>(request, IsaGjkVariant{GjkStart::Memory, kReflections});
}

std::unique_ptr<NarrowSubject> makeCulletFromAxisNarrow(const NarrowRequest& request)
{
    return makeFromStart(request, GjkStart::Axis);
}

std::unique_ptr<NarrowSubject> makeCulletFromFourNarrow(const NarrowRequest& request)
{
    return makeFromStart(request, GjkStart::FourDirections);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
