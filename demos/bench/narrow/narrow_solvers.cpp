// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_subject.h"
#include "cullet/demos/bench/narrow/simplex_johnson.h"
#include "cullet/demos/bench/narrow/simplex_signed_volumes.h"
#include "cullet/narrow/gjk/gjk_search.h"
#include "cullet/narrow/math/simplex.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
struct Simplex
{
    SimplexPoints points;
    int count;
};

/// The simplices that GJK gives to its solver in each query of some trajectories; the newest point is the last.
class SimplexRecord
{
public:
    explicit SimplexRecord(const NarrowTrajectories& trajectories)
    {
        for (const PairScene<btScalar>& scene : trajectories.scenes())
        {
            record(scene.posedA(), scene.posedB());
            m_ends.push_back(m_simplices.size());
        }
    }

    const std::vector<Simplex>& simplices() const { return m_simplices; }
    /// End index of the simplices of each query.
    const std::vector<std::size_t>& ends() const { return m_ends; }

private:
    using Posed = PosedHull<btScalar>;

    void record(const Posed& a, const Posed& b)
    {
        GjkSearch<Posed, Posed> search(a, b);
        const auto first = search.supportAgainst(search.centreDifference());
        search.start(first);
        add(search, 0, first.w);
        while (!search.isTouching())
        {
            const auto s = search.supportAgainst(search.closest());
            if (search.has(s))
                return;
            add(search, search.count(), s.w);
            if (!search.advance(s))
                return;
        }
    }

    void add(const GjkSearch<Posed, Posed>& search, int count, const Eigen::Vector3d& newest)
    {
        Simplex simplex = {{newest, newest, newest, newest}, count + 1};
        std::copy_n(search.points().begin(), count, simplex.points.begin());
        m_simplices.push_back(simplex);
    }

    std::vector<Simplex> m_simplices;
    std::vector<std::size_t> m_ends;
};

/// One solver on the recorded simplices; the last simplex of a query gives its answer.
template <ClosestOnSimplex (*kSolve)(const SimplexPoints&, int)>
class SolverNarrow : public NarrowSubject
{
public:
    explicit SolverNarrow(const NarrowTrajectories& trajectories) : m_record(trajectories) {}

    void run(std::vector<NarrowAnswer>& answers) override
    {
        std::size_t i = 0;
        for (std::size_t query = 0; query < answers.size(); ++query)
        {
            ClosestOnSimplex closest = {};
            for (; i < m_record.ends()[query]; ++i)
                closest = kSolve(m_record.simplices()[i].points, m_record.simplices()[i].count);
            answers[query] = answerOf(m_record.simplices()[i - 1], closest);
        }
    }

    NarrowWork countWork() override
    {
        const double simplices = static_cast<double>(m_record.simplices().size());
        return {simplices / static_cast<double>(m_record.ends().size()), -1.0};
    }

private:
    static NarrowAnswer answerOf(const Simplex& simplex, const ClosestOnSimplex& closest)
    {
        double size2 = 0.0;
        for (int k = 0; k < simplex.count; ++k)
            size2 = std::max(size2, simplex.points[k].squaredNorm());
        const bool isOverlapping = closest.isInside || closest.length2 <= 1e-20 * size2;
        return {isOverlapping, isOverlapping ? 0.0 : std::sqrt(closest.length2)};
    }

    SimplexRecord m_record;
};

template <ClosestOnSimplex (*kSolve)(const SimplexPoints&, int)>
std::unique_ptr<NarrowSubject> makeSolver(const NarrowRequest& request)
{
    return std::make_unique<SolverNarrow<kSolve>>(request.trajectories);
}
}  // namespace

std::unique_ptr<NarrowSubject> makeVoronoiSolver(const NarrowRequest& request)
{
    return makeSolver<closestOnSimplexNewest>(request);
}

std::unique_ptr<NarrowSubject> makeFullVoronoiSolver(const NarrowRequest& request)
{
    return makeSolver<closestOnSimplex>(request);
}

std::unique_ptr<NarrowSubject> makeJohnsonSolver(const NarrowRequest& request)
{
    return makeSolver<closestByJohnson>(request);
}

std::unique_ptr<NarrowSubject> makeSignedVolumesSolver(const NarrowRequest& request)
{
    return makeSolver<closestBySignedVolumes>(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
