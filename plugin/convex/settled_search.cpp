// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/settled_search.h"

#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/plugin/contact/contact_patch.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class SettledSearch
{
public:
    SettledSearch(const SearchSetup& setup, ConvexCores& cores, btScalar limit, GjkCache<btScalar>& cache,
                  Touch& touch)
        : m_setup(setup), m_cores(cores), m_limit(limit), m_cache(cache), m_touch(touch)
    {
    }

    ContactSearchResult run(const AxisTest<btScalar>& failed, bool wasSettled)
    {
        const bool wasNear = m_cache.state == GjkState::Near || m_cache.state == GjkState::Overlapping;
        // If the last result depended on its start, this one probably does too.
        if (wasNear && !wasSettled)
            forget();
        bool isColdStart =
            m_cache.state == GjkState::NotConverged && !remembersAxis(m_cache) && !remembersDepth();
        bool mayBuild = m_cores.hasCloud();
        AxisTest<btScalar> test = failed;
        for (;;)
        {
            const ContactSearchResult found = searchOnce(isColdStart || !wasNear, test);
            const bool isDone =
                found.isSettled && (!mayBuild || found.state == GjkState::Separated || findsFaces() ||
                                    !m_cores.mayBuildGraphs(m_setup.pair, m_setup.hulls));
            if (isDone && mayBuild && found.state != GjkState::Separated)
                countContact();
            if (isDone || (isColdStart && !mayBuild))
                return found;
            // A search from scratch is often settled where one from the features of edited points is not.
            const bool needsGraph = mayBuild && (isColdStart || found.isSettled);
            if (needsGraph && !m_cores.buildGraphs(m_setup.pair, m_setup.hulls, m_setup.pass))
                return {GjkState::NotConverged, found.isSettled};
            mayBuild = mayBuild && !needsGraph;
            forget();
            test = AxisTest<btScalar>();
            isColdStart = true;
        }
    }

private:
    ContactSearchResult searchOnce(bool mayBeSeparated, const AxisTest<btScalar>& test)
    {
        const btScalar paddedLimit = padLimit(m_setup.pair, m_cores, m_limit);
        GjkState state = GjkState::Near;
        if (mayBeSeparated)
            state = testSeparation(m_setup.pair, m_cores, paddedLimit, test, m_cache);
        if (state == GjkState::Near || state == GjkState::Overlapping)
            return measure(m_cores, m_limit, paddedLimit, m_cache, m_setup.depthCache, m_touch,
                           m_setup.exactTotal);
        return {state, state == GjkState::Separated};
    }

    /// Whether a patch can be made from the faces around the support vertices of hulls without graphs. If not, the faces
    /// that were found are forgotten. A lone corner needs none.
    bool findsFaces()
    {
        if (!m_setup.makesPatch || isLoneCorner(*m_cores.a, *m_cores.b, m_touch) ||
            m_cores.findFans(m_touch.normal, m_touch.vertexA, m_touch.vertexB))
            return true;
        m_cores.forgetFans();
        return false;
    }

    void countContact()
    {
        for (HullUse& use : m_setup.hulls)
            use.countContact();
    }

    bool remembersDepth() const
    {
        return m_setup.depthCache != nullptr && m_setup.depthCache->vertexCount > 0;
    }

    void forget()
    {
        m_cache = GjkCache<btScalar>();
        if (m_setup.depthCache != nullptr)
            m_setup.depthCache->vertexCount = 0;
    }

    const SearchSetup& m_setup;
    ConvexCores& m_cores;
    const btScalar m_limit;
    GjkCache<btScalar>& m_cache;
    Touch& m_touch;
};
}  // namespace

ContactSearchResult searchSettled(const SearchSetup& setup, ConvexCores& cores, btScalar limit,
                                  const AxisTest<btScalar>& failed, bool wasSettled,
                                  GjkCache<btScalar>& cache, Touch& touch)
{
    return SettledSearch(setup, cores, limit, cache, touch).run(failed, wasSettled);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
