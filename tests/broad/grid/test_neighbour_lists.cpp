// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Wandering boxes with neighbour lists among resting ones, against the oracle.

#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <ostream>
#include <string>

namespace cullet::test
{
namespace
{
struct WandererCase
{
    const char* name;
    float margin;
    bool useFilter;
    int threads;
    float fastest;  ///< wanderer
};

std::ostream& operator<<(std::ostream& out, const WandererCase& wandererCase)
{
    return out << wandererCase.name;
}

/// Resting boxes, one of them unbounded, and wanderers: most move a little in each step, some are fast or stop at
/// times.
class Wanderers
{
public:
    static constexpr std::uint32_t kResting = 500;
    static constexpr std::uint32_t kWandering = 60;
    static constexpr float kSide = 10;

    Wanderers(BackendSession& session, float fastest) : m_session(session), m_fastest(fastest)
    {
        for (std::uint32_t i = 0; i < kResting; ++i)
        {
            const Filter filter = randomFilter();
            m_resting.push_back(session.add(i == 0 ? endless() : randomBox(), filter));
        }
        for (std::uint32_t i = 0; i < kWandering; ++i)
            m_wandering.push_back(newcomer());
    }

    /// @param isCalm only the wanderers change
    void step(bool isCalm)
    {
        for (Wanderer& wanderer : m_wandering)
            go(wanderer, isCalm);
        if (isCalm)
            return;
        // Some resting boxes teleport, or move within their skins; some are destroyed, and others created.
        for (int i = 0; i < 2; ++i)
        {
            const Aabb box = randomBox();
            m_session.table.setBox(m_resting[1 + m_random.below(kResting - 1)], box);
        }
        if (m_random.chance(0.3f))
        {
            ProxyId& one = m_resting[1 + m_random.below(kResting - 1)];
            m_session.table.destroy(one);
            const Filter filter = randomFilter();
            one = m_session.add(randomBox(), filter);
        }
        if (m_random.chance(0.3f))
        {
            Wanderer& one = m_wandering[m_random.below(kWandering)];
            m_session.table.destroy(one.row);
            one = newcomer();
        }
        // Held pairs stay with any filter words.
        if (m_random.chance(0.1f))
        {
            for (const Wanderer& wanderer : m_wandering)
                m_session.table.setFilter(wanderer.row, randomFilter());
        }
    }

private:
    struct Wanderer
    {
        ProxyId row;
        std::array<float, 3> velocity;
        bool stops;
    };

    static Aabb endless() { return {{2, -kInfinity, 5}, {4, kInfinity, 7}}; }

    Aabb randomBox()
    {
        Aabb box = boxAt(m_random.point(0, kSide));
        // Some boxes are points and plates.
        if (m_random.chance(0.1f))
            box.max[m_random.below(3)] = kSide;
        if (m_random.chance(0.1f))
        {
            const std::uint32_t axis = m_random.below(3);
            box.max[axis] = box.min[axis];
        }
        return box;
    }

    Filter randomFilter()
    {
        const int group = 1 << m_random.below(3);
        return {group, m_random.chance(0.7f) ? -1 : ~group};
    }

    Wanderer newcomer()
    {
        constexpr float kSpeeds[] = {0.01f, 0.05f, 0.1f, 0.1f, 0.5f, 3.0f};
        const float speed = std::min(kSpeeds[m_random.below(6)], m_fastest);
        const Filter filter = randomFilter();
        Wanderer wanderer = {m_session.add(randomBox(), filter), {}, m_random.chance(0.2f)};
        for (float& component : wanderer.velocity)
            component = m_random.between(-speed, speed);
        return wanderer;
    }

    void go(Wanderer& wanderer, bool isCalm)
    {
        if (wanderer.stops && m_random.chance(0.5f))
            return;
        Aabb box = m_session.table.box(wanderer.row);
        // Empty boxes become valid again, and some unbounded ones bounded.
        if (!isValid(box) || (!isCalm && m_random.chance(0.01f)))
        {
            const bool isOdd = m_random.chance(0.3f);
            m_session.table.setBox(wanderer.row, !isOdd                  ? randomBox()
                                                 : m_random.chance(0.5f) ? kEmptyAabb
                                                                         : endless());
            return;
        }
        for (int axis = 0; axis < 3; ++axis)
        {
            float& velocity = wanderer.velocity[static_cast<std::size_t>(axis)];
            if ((box.min[axis] < 0 && velocity < 0) || (box.max[axis] > kSide + 1 && velocity > 0))
                velocity = -velocity;
            box.min[axis] += velocity;
            box.max[axis] += velocity;
        }
        m_session.table.setBox(wanderer.row, box);
    }

    BackendSession& m_session;
    float m_fastest;
    Random m_random{61};
    std::vector<ProxyId> m_resting;
    std::vector<Wanderer> m_wandering;
};

class NeighbourLists : public testing::TestWithParam<WandererCase>
{
};

TEST_P(NeighbourLists, MatchOracleWhenBoxesWanderAmongRestingOnes)
{
    GridOptions options;
    options.threads = GetParam().threads;
    options.rebuildFraction = 1;  // enters the resting mode at once, and stays in it
    BackendSession session{std::make_unique<ColumnGridBackend>(options)};
    session.margin = GetParam().margin;
    session.useFilter = GetParam().useFilter;
    Wanderers wanderers(session, GetParam().fastest);
    std::map<std::string, int> paths;
    for (int step = 0; step < 300; ++step)
    {
        SCOPED_TRACE("seed 61, step " + std::to_string(step));
        ASSERT_TRUE(session.step());
        ++paths[session.backend().stats().path];
        wanderers.step(step % 60 >= 20);
    }
    EXPECT_GT(paths["incremental"], 150);
    EXPECT_GT(session.addedTotal(), 1500u);
    EXPECT_GT(session.removedTotal(), 1000u);
}

INSTANTIATE_TEST_SUITE_P(All, NeighbourLists,
                         testing::Values(WandererCase{"NoMargin", 0.0f, false, 1, 3.0f},
                                         WandererCase{"Margin", 0.0625f, false, 1, 3.0f},
                                         WandererCase{"WideMargin", 1.5f, false, 1, 3.0f},
                                         WandererCase{"Slow", 0.0f, false, 1, 0.05f},
                                         WandererCase{"SlowWithMargin", 0.0625f, true, 1, 0.05f},
                                         WandererCase{"Filter", 0.0625f, true, 1, 3.0f},
                                         WandererCase{"FourThreads", 0.0625f, true, 4, 3.0f}),
                         [](const auto& wandererCase) { return wandererCase.param.name; });
}  // namespace
}  // namespace cullet::test
