// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_subject.h"

#include <coal/narrowphase/narrowphase.h>
#include <coal/shape/convex.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Coal's solver without its object layer, in double. A warm pair keeps the final direction and vertices of the last
/// query.
class CoalNarrow : public NarrowSubject
{
public:
    explicit CoalNarrow(const NarrowRequest& request)
        : m_query(request.query),
          m_isWarm(request.isWarm),
          m_shape(shapeOf(request.trajectories.hull())),
          m_gjk(kIterations, kTolerance)
    {
        if (m_query == NarrowQuery::Boolean)
            m_gjk.setDistanceEarlyBreak(0.0);
        for (const PairScene<btScalar>& scene : request.trajectories.scenes())
        {
            m_a.push_back(place(scene.a));
            m_b.push_back(place(scene.b));
        }
    }

    void run(std::vector<NarrowAnswer>& answers) override { (void)runAll(answers); }

    NarrowWork countWork() override
    {
        if (m_query == NarrowQuery::Contacts)
            return {};
        std::vector<NarrowAnswer> answers(m_a.size());
        return {static_cast<double>(runAll(answers)) / static_cast<double>(answers.size()), -1.0};
    }

private:
    using Gjk = coal::details::GJK;

    static constexpr int kIterations = 128;
    static constexpr double kTolerance = 1e-6;  ///< Coal's defaults

    struct Memory
    {
        bool isFilled = false;
        coal::Vec3s ray = coal::Vec3s::Zero();
        coal::support_func_guess_t hint = coal::support_func_guess_t::Zero();
    };

    static coal::Convex<coal::Triangle> shapeOf(const Hull<btScalar>& hull)
    {
        const auto points = std::make_shared<std::vector<coal::Vec3s>>();
        for (int v = 0; v < hull.vertexCount(); ++v)
            points->push_back(hull.vertex(v).cast<double>());
        const auto triangles = std::make_shared<std::vector<coal::Triangle>>();
        for (std::size_t face = 0; face < hull.faces().size(); ++face)
        {
            const auto corners = hull.faceVertices(static_cast<std::int32_t>(face));
            for (std::int32_t i = 2; i < corners.size(); ++i)
                triangles->emplace_back(corners[0], corners[i - 1], corners[i]);
        }
        return {points, static_cast<unsigned>(points->size()), triangles,
                static_cast<unsigned>(triangles->size())};
    }

    static coal::Transform3s place(const Pose<btScalar>& pose)
    {
        return coal::Transform3s(coal::Matrix3s(pose.basis.cast<double>()),
                                 coal::Vec3s(pose.origin.cast<double>()));
    }

    /// @return iterations
    std::int64_t runAll(std::vector<NarrowAnswer>& answers)
    {
        std::vector<Memory> memories(NarrowTrajectories::kPairs);
        std::int64_t iterations = 0;
        for (std::size_t i = 0; i < m_a.size(); ++i)
        {
            if (m_query == NarrowQuery::Contacts)
            {
                answers[i] = contact(m_a[i], m_b[i]);
                continue;
            }
            Memory& memory = memories[i % NarrowTrajectories::kPairs];
            if (!m_isWarm)
                memory = Memory();
            answers[i] = ask(m_a[i], m_b[i], memory);
            iterations += static_cast<std::int64_t>(m_gjk.getNumIterations());
        }
        return iterations;
    }

    NarrowAnswer ask(const coal::Transform3s& a, const coal::Transform3s& b, Memory& memory)
    {
        m_difference.set<coal::details::SupportOptions::NoSweptSphere>(&m_shape, &m_shape, a, b);
        m_gjk.reset(kIterations, kTolerance);
        // The shapes' centres are near their origins.
        const coal::Vec3s guess = memory.isFilled ? memory.ray : coal::Vec3s(-m_difference.ot1);
        const Gjk::Status status = m_gjk.evaluate(m_difference, guess, memory.hint);
        memory = {true, m_gjk.ray, m_gjk.support_hint};
        NarrowAnswer answer;
        answer.isOverlapping = status == Gjk::Collision || status == Gjk::CollisionWithPenetrationInformation;
        if (m_query == NarrowQuery::Distance)
            answer.distance = answer.isOverlapping ? 0.0 : m_gjk.distance;
        return answer;
    }

    NarrowAnswer contact(const coal::Transform3s& a, const coal::Transform3s& b) const
    {
        coal::Vec3s pointA, pointB, normal;
        NarrowAnswer answer;
        answer.distance = m_solver.shapeDistance(m_shape, a, m_shape, b, true, pointA, pointB, normal);
        answer.isOverlapping = answer.distance <= 0.0;
        return answer;
    }

    NarrowQuery m_query;
    bool m_isWarm;
    coal::Convex<coal::Triangle> m_shape;
    Gjk m_gjk;
    coal::details::MinkowskiDiff m_difference;
    coal::GJKSolver m_solver;
    std::vector<coal::Transform3s> m_a, m_b;
};
}  // namespace

std::unique_ptr<NarrowSubject> makeCoalNarrow(const NarrowRequest& request)
{
    if (isBulletsOwn(request.query))
        return nullptr;
    return std::make_unique<CoalNarrow>(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
