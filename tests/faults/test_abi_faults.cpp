// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The C interface, for which an allocation fails once: CULLET_ERROR_MEMORY, nothing done, nothing written, no leak, and
// the same call succeeds when it is made again.
#include "cullet/abi/cullet.h"
#include "cullet/tests/faults/support/sweep.h"

#include <btBulletCollisionCommon.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
/// Makes a call that may find no memory, and makes it again where it did.
///
/// @return the status of the call that succeeded
template <class Call>
cullet_status succeed(FaultRun& run, const Call& call)
{
    cullet_status status = CULLET_OK;
    run.certain([&] { status = call(); });
    if (status >= 0)
        return status;
    EXPECT_EQ(status, CULLET_ERROR_MEMORY) << cullet_last_error();
    EXPECT_NE(std::string(cullet_last_error()).find("out of memory"), std::string::npos);
    EXPECT_TRUE(hasFaultHappened());
    run.certain([&] { status = call(); });
    EXPECT_GE(status, 0) << cullet_last_error();
    return status;
}

using Box = std::array<float, 6>;

Box boxAtX(float x)
{
    return {x, 0, 0, x + 1, 1, 1};
}

/// A set of boxes in a row, with the pairs that a program keeps by the reported changes.
class BoxSetLife
{
public:
    BoxSetLife(FaultRun& run, std::int32_t backend) : m_run(run)
    {
        cullet_box_set_options options{};
        options.size = sizeof options;
        options.backend = backend;
        options.threads = 1;
        succeed(m_run,
                [&]
                {
                    const cullet_status status = cullet_box_set_create(&options, &m_set);
                    EXPECT_EQ(m_set != nullptr, status == CULLET_OK) << "an out-parameter of a failed call";
                    return status;
                });
    }
    ~BoxSetLife()
    {
        m_run.certain([&] { cullet_box_set_destroy(m_set); });
    }
    BoxSetLife(const BoxSetLife&) = delete;
    BoxSetLife& operator=(const BoxSetLife&) = delete;

    void live()
    {
        for (int round = 0; round < 3; ++round)
        {
            add(25, 0.8f);
            update();
            move(0.1f * float(round));
            update();
            removeEveryThird();
            update();
        }
        filterAll();
        move(50);
        update();
        move(0);
        update();
    }

private:
    void add(std::uint32_t count, float step)
    {
        std::vector<Box> boxes;
        for (std::uint32_t i = 0; i < count; ++i)
            boxes.push_back(boxAtX(step * float(m_ids.size() + i)));
        std::vector<std::uint32_t> ids(count);
        succeed(m_run,
                [&]
                {
                    const cullet_status status =
                        cullet_box_set_add(m_set, boxes[0].data(), 0, count, ids.data());
                    EXPECT_EQ(ids[0] != 0, status >= 0) << "an out-parameter of a failed call";
                    return status;
                });
        m_ids.insert(m_ids.end(), ids.begin(), ids.end());
        m_boxes.insert(m_boxes.end(), boxes.begin(), boxes.end());
    }

    void move(float by)
    {
        for (std::size_t i = 0; i < m_boxes.size(); ++i)
            m_boxes[i] = boxAtX(0.8f * float(i) + (i % 2 == 0 ? by : 0));
        succeed(m_run,
                [&] { return cullet_box_set_move(m_set, m_ids.data(), m_boxes[0].data(), 0, count()); });
    }

    void removeEveryThird()
    {
        std::vector<std::uint32_t> gone;
        std::vector<std::uint32_t> ids;
        std::vector<Box> boxes;
        for (std::size_t i = 0; i < m_ids.size(); ++i)
        {
            (i % 3 == 0 ? gone : ids).push_back(m_ids[i]);
            if (i % 3 != 0)
                boxes.push_back(m_boxes[i]);
        }
        succeed(
            m_run, [&]
            { return cullet_box_set_remove(m_set, gone.data(), static_cast<std::uint32_t>(gone.size())); });
        m_ids = ids;
        m_boxes = boxes;
    }

    void filterAll()
    {
        const std::vector<cullet_filter> filters(m_ids.size(), cullet_filter{1, -1});
        succeed(m_run, [&] { return cullet_box_set_filter(m_set, m_ids.data(), filters.data(), count()); });
    }

    void update()
    {
        cullet_pairs added{}, removed{};
        succeed(m_run,
                [&]
                {
                    const cullet_status status = cullet_box_set_update(m_set, &added, &removed);
                    if (status < 0)
                    {
                        EXPECT_TRUE(added.data == nullptr && removed.data == nullptr);
                        expectSame(m_pairs);
                    }
                    return status;
                });
        apply(added, removed);
        EXPECT_EQ(m_pairs, bruteForce());
        expectSame(m_pairs);
    }

    using IdPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

    static IdPairs toIds(const cullet_pairs& pairs)
    {
        IdPairs ids;
        for (std::uint64_t i = 0; i < pairs.count; ++i)
            ids.emplace_back(pairs.data[i].first, pairs.data[i].second);
        return ids;
    }

    void expectSame(const IdPairs& expected)
    {
        const FaultPause pause;
        cullet_pairs all{};
        EXPECT_EQ(cullet_box_set_pairs(m_set, &all), CULLET_OK);
        EXPECT_EQ(toIds(all), expected);
    }

    void apply(const cullet_pairs& added, const cullet_pairs& removed)
    {
        const IdPairs in = toIds(added), out = toIds(removed);
        IdPairs stayed, pairs;
        std::set_difference(m_pairs.begin(), m_pairs.end(), out.begin(), out.end(),
                            std::back_inserter(stayed));
        std::merge(stayed.begin(), stayed.end(), in.begin(), in.end(), std::back_inserter(pairs));
        m_pairs = pairs;
    }

    IdPairs bruteForce() const
    {
        IdPairs pairs;
        for (std::size_t a = 0; a < m_ids.size(); ++a)
            for (std::size_t b = 0; b < m_ids.size(); ++b)
                if (m_ids[a] < m_ids[b] && m_boxes[a][0] <= m_boxes[b][3] && m_boxes[b][0] <= m_boxes[a][3])
                    pairs.emplace_back(m_ids[a], m_ids[b]);
        std::sort(pairs.begin(), pairs.end());
        return pairs;
    }

    std::uint32_t count() const { return static_cast<std::uint32_t>(m_ids.size()); }

    FaultRun& m_run;
    cullet_box_set* m_set = nullptr;
    std::vector<std::uint32_t> m_ids;
    std::vector<Box> m_boxes;
    IdPairs m_pairs;
};

/// A ball of points, with radius 1.
std::vector<double> ballOf(int count)
{
    std::vector<double> points;
    for (int i = 0; i < count; ++i)
    {
        const double z = 2.0 * (i + 0.5) / count - 1, turn = 2.4 * i, radius = std::sqrt(1 - z * z);
        points.insert(points.end(), {radius * std::cos(turn), radius * std::sin(turn), z});
    }
    return points;
}

/// A ball at 40 places, against itself: enough for two threads.
void queryBatch(FaultRun& run, const cullet_hull* hull)
{
    constexpr std::uint32_t kCount = 40;
    const std::vector<const cullet_hull*> hulls(kCount, hull);
    std::vector<cullet_pose> poses;
    for (std::uint32_t i = 0; i < kCount; ++i)
        poses.push_back({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.0625 * i, 0, 0}});
    cullet_hull_batch batch{};
    batch.size = sizeof batch;
    batch.query = CULLET_QUERY_CONTACT;
    batch.a = {hulls.data(), nullptr, 1, 0};
    batch.b = {hulls.data(), poses.data(), kCount, 0};
    batch.pair_count = kCount;
    batch.max_distance = 10;
    batch.threads = 2;
    std::vector<std::int32_t> states(kCount, -1);
    cullet_hull_results results{};
    results.size = sizeof results;
    results.states = states.data();
    succeed(run, [&] { return cullet_hull_query_batch(&batch, &results); });
    for (std::uint32_t i = 0; i < kCount; ++i)
        EXPECT_EQ(states[i], i < 31 ? CULLET_OVERLAPPING : i > 32 ? CULLET_NEAR : states[i]);
}

void liveWithHulls(FaultRun& run)
{
    const std::vector<double> points = ballOf(120);
    cullet_hull* hull = nullptr;
    cullet_hull_cache* cache = nullptr;
    succeed(run, [&] { return cullet_hull_create(points.data(), 0, 120, &hull); });
    succeed(run, [&] { return cullet_hull_cache_create(&cache); });
    for (const double x : {5.0, 2.001, 1.2, 0.0, 1e-9})
    {
        const cullet_pose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {x, 0, 0}};
        std::int32_t overlaps = -1;
        succeed(run,
                [&] { return cullet_hull_overlap(hull, nullptr, hull, &pose, cache, &overlaps, nullptr); });
        EXPECT_EQ(overlaps, x < 1.9 ? 1 : 0);
        cullet_hull_result near{};
        near.size = sizeof near;
        succeed(run, [&] { return cullet_hull_distance(hull, nullptr, hull, &pose, 10, cache, &near); });
        EXPECT_EQ(near.state, x < 1.9 ? CULLET_OVERLAPPING : CULLET_NEAR);
        cullet_hull_result deep{};
        deep.size = sizeof deep;
        succeed(run, [&] { return cullet_hull_penetration(hull, nullptr, hull, &pose, cache, &deep); });
        EXPECT_EQ(deep.state, x < 1.9 ? CULLET_OVERLAPPING : CULLET_SEPARATED);
    }
    queryBatch(run, hull);
    run.certain(
        [&]
        {
            cullet_hull_cache_destroy(cache);
            cullet_hull_destroy(hull);
        });
}

void liveWithBullet(FaultRun& run)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    cullet_isa_gjk* isaGjk = nullptr;
    succeed(run, [&] { return cullet_isa_gjk_register(sizeof(btScalar), &dispatcher, nullptr, &isaGjk); });
    cullet_broadphase* broadphase = nullptr;
    succeed(run, [&] { return cullet_broadphase_create(sizeof(btScalar), nullptr, &broadphase); });
    cullet_broadphase_stats stats{};
    stats.size = sizeof stats;
    succeed(run, [&] { return cullet_broadphase_get_stats(broadphase, &stats); });
    cullet_solver* solver = nullptr;
    succeed(run, [&] { return cullet_solver_create(sizeof(btScalar), nullptr, &solver); });
    run.certain(
        [&]
        {
            cullet_solver_destroy(solver);
            cullet_broadphase_destroy(broadphase);
        });
}

TEST(AbiFaults, ReportMemoryAndChangeNothingWhenAllocationOfBoxSetFails)
{
    for (const std::int32_t backend : {CULLET_BACKEND_GRID, CULLET_BACKEND_BRUTE})
    {
        const char* name =
            backend == CULLET_BACKEND_GRID ? "C interface, boxes in the grid" : "C interface, boxes";
        const auto live = [&](FaultRun& run) { BoxSetLife(run, backend).live(); };
        EXPECT_GE(sweepFaults(name, FaultKind::New, live).injected, 60u);
    }
}

TEST(AbiFaults, ReportMemoryAndChangeNothingWhenAllocationOfHullFails)
{
    EXPECT_GE(sweepFaults("C interface, hulls", FaultKind::New, liveWithHulls).injected, 50u);
}

TEST(AbiFaults, ReportMemoryAndChangeNothingWhenAllocationForBulletFails)
{
    EXPECT_GE(sweepFaults("C interface, Bullet", FaultKind::New, liveWithBullet, kEveryOfMost,
                          liveBesideDispatchers<>)
                  .injected,
              10u);
}
}  // namespace
}  // namespace cullet::test
