// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_subject.h"

#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/detail/gjk_solver_indep.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// FCL's solver without its object layer, in double, the precision that its packages are built for.
class FclNarrow : public NarrowSubject
{
public:
    explicit FclNarrow(const NarrowRequest& request) : m_query(request.query)
    {
        const Hull<btScalar>& hull = request.trajectories.hull();
        const auto vertices = std::make_shared<std::vector<Eigen::Vector3d>>();
        // FCL refuses vertices that are no corner of a face.
        std::vector<int> cornerOf;
        for (int v = 0; v < hull.vertexCount(); ++v)
        {
            cornerOf.push_back(static_cast<int>(vertices->size()));
            if (hull.facesOf(v).size() > 0)
                vertices->push_back(hull.vertex(v).cast<double>());
        }
        const auto faces = std::make_shared<std::vector<int>>();
        for (std::size_t face = 0; face < hull.faces().size(); ++face)
        {
            const auto corners = hull.faceVertices(static_cast<std::int32_t>(face));
            faces->push_back(corners.size());
            for (const std::int32_t v : corners)
                faces->push_back(cornerOf[static_cast<std::size_t>(v)]);
        }
        m_shape =
            std::make_unique<fcl::Convexd>(vertices, static_cast<int>(hull.faces().size()), faces, true);
        for (const PairScene<btScalar>& scene : request.trajectories.scenes())
        {
            m_a.push_back(place(scene.a));
            m_b.push_back(place(scene.b));
        }
    }

    void run(std::vector<NarrowAnswer>& answers) override
    {
        for (std::size_t i = 0; i < m_a.size(); ++i)
            answers[i] = ask(m_a[i], m_b[i]);
    }

private:
    static fcl::Transform3d place(const Pose<btScalar>& pose)
    {
        fcl::Transform3d transform = fcl::Transform3d::Identity();
        transform.linear() = pose.basis.cast<double>();
        transform.translation() = pose.origin.cast<double>();
        return transform;
    }

    NarrowAnswer ask(const fcl::Transform3d& a, const fcl::Transform3d& b) const
    {
        NarrowAnswer answer;
        if (m_query == NarrowQuery::Distance)
        {
            double distance = 0.0;
            answer.isOverlapping = !m_solver.shapeDistance(*m_shape, a, *m_shape, b, &distance);
            answer.distance = answer.isOverlapping ? 0.0 : distance;
            return answer;
        }
        std::vector<fcl::ContactPointd> contacts;
        const bool wantsContact = m_query == NarrowQuery::Contacts;
        answer.isOverlapping =
            m_solver.shapeIntersect(*m_shape, a, *m_shape, b, wantsContact ? &contacts : nullptr);
        if (!contacts.empty())
            answer.distance = -contacts.front().penetration_depth;
        return answer;
    }

    NarrowQuery m_query;
    std::unique_ptr<fcl::Convexd> m_shape;
    fcl::detail::GJKSolver_indepd m_solver;
    std::vector<fcl::Transform3d> m_a, m_b;
};
}  // namespace

std::unique_ptr<NarrowSubject> makeFclNarrow(const NarrowRequest& request)
{
    if (isBulletsOwn(request.query))
        return nullptr;
    return std::make_unique<FclNarrow>(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
