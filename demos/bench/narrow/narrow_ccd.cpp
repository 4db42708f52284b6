// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_subject.h"

#include <ccd/ccd.h>
#include <ccd/quat.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// A posed hull for libccd's callbacks. The pose is a matrix, since libccd uses quaternions in its examples only.
struct CcdObject
{
    const std::vector<Eigen::Vector3d>* points;
    Eigen::Matrix3d basis;
    Eigen::Vector3d origin;
    std::int64_t* supports;
};

void support(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* point)
{
    const CcdObject& o = *static_cast<const CcdObject*>(object);
    ++*o.supports;
    const Eigen::Vector3d local = o.basis.transpose() * Eigen::Vector3d(direction->v);
    const Eigen::Vector3d* best = o.points->data();
    double height = local.dot(*best);
    for (const Eigen::Vector3d& p : *o.points)
    {
        const double h = local.dot(p);
        if (h > height)
        {
            height = h;
            best = &p;
        }
    }
    const Eigen::Vector3d world = o.basis * *best + o.origin;
    ccdVec3Set(point, world.x(), world.y(), world.z());
}

void centre(const void* object, ccd_vec3_t* point)
{
    const Eigen::Vector3d& origin = static_cast<const CcdObject*>(object)->origin;
    ccdVec3Set(point, origin.x(), origin.y(), origin.z());
}

class CcdNarrow : public NarrowSubject
{
public:
    explicit CcdNarrow(const NarrowRequest& request) : m_query(request.query)
    {
        const Hull<btScalar>& hull = request.trajectories.hull();
        for (int v = 0; v < hull.vertexCount(); ++v)
            m_points.push_back(hull.vertex(v).cast<double>());
        for (const PairScene<btScalar>& scene : request.trajectories.scenes())
        {
            m_a.push_back(place(scene.a));
            m_b.push_back(place(scene.b));
        }
        CCD_INIT(&m_ccd);
        m_ccd.support1 = m_ccd.support2 = support;
        m_ccd.center1 = m_ccd.center2 = centre;
        m_ccd.max_iterations = 1000;
    }

    void run(std::vector<NarrowAnswer>& answers) override
    {
        for (std::size_t i = 0; i < m_a.size(); ++i)
        {
            answers[i] = {};
            if (m_query == NarrowQuery::Boolean)
            {
                answers[i].isOverlapping = ccdGJKIntersect(&m_a[i], &m_b[i], &m_ccd) != 0;
                continue;
            }
            ccd_real_t depth;
            ccd_vec3_t normal, point;
            answers[i].isOverlapping =
                ccdMPRPenetration(&m_a[i], &m_b[i], &m_ccd, &depth, &normal, &point) == 0;
            if (answers[i].isOverlapping)
                answers[i].distance = -depth;
        }
    }

    NarrowWork countWork() override
    {
        std::vector<NarrowAnswer> answers(m_a.size());
        m_supports = 0;
        run(answers);
        return {-1.0, static_cast<double>(m_supports) / static_cast<double>(answers.size())};
    }

private:
    CcdObject place(const Pose<btScalar>& pose)
    {
        return {&m_points, pose.basis.cast<double>(), pose.origin.cast<double>(), &m_supports};
    }

    NarrowQuery m_query;
    std::vector<Eigen::Vector3d> m_points;
    std::vector<CcdObject> m_a, m_b;
    std::int64_t m_supports = 0;
    ccd_t m_ccd;
};
}  // namespace

std::unique_ptr<NarrowSubject> makeCcdNarrow(const NarrowRequest& request)
{
    // The library has no distance between disjoint shapes.
    if (request.query == NarrowQuery::Distance || isBulletsOwn(request.query))
        return nullptr;
    return std::make_unique<CcdNarrow>(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
