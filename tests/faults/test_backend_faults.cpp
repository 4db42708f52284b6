// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Whichever allocation, thread or call of an executor fails in an update of a backend: the update says so, and another
// backend or the same one continues with all pairs.
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/psap/psap_backend.h"
#include "cullet/tests/cuda/support/named_options.h"
#include "cullet/tests/faults/support/faulty_exec.h"
#include "cullet/tests/faults/support/sweep.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
using MakeBackend = std::function<std::unique_ptr<Backend>()>;

std::unique_ptr<Backend> makeFaultyPsap(PsapOptions options)
{
    options.initialCapacity = 1;
    return std::make_unique<psap::PsapBackend<FaultyExec>>(options, "faulty psap", options);
}

/// The backend that continues after a failed update.
enum class Heir
{
    Grid,
    SameBackend
};

/// The status of an update with such a fault.
Status statusOf(FaultKind kind)
{
    return kind == FaultKind::DeviceLoss ? Status::DeviceLost : Status::OutOfMemory;
}

/// A life of a backend: boxes that drift, and later jump.
struct Scene
{
    MakeBackend make;
    std::uint32_t boxes = 60;
    int steps = 5;
    Heir heir = Heir::SameBackend;
};

class BackendLife
{
public:
    BackendLife(FaultRun& run, const Scene& scene, FaultKind kind)
        : m_run(run), m_life(scene), m_kind(kind), m_scene(SceneKind::Uniform, scene.boxes, 5)
    {
        m_run.insist([&] { m_backend = m_life.make(); });
        for (std::uint32_t row = 0; row < scene.boxes; ++row)
            m_table.create(m_scene.boxes()[row], row + 1, kEverything);
    }
    ~BackendLife()
    {
        m_run.certain([&] { m_backend.reset(); });
    }
    BackendLife(const BackendLife&) = delete;
    BackendLife& operator=(const BackendLife&) = delete;

    void live()
    {
        for (int step = 0; step < m_life.steps; ++step)
        {
            update();
            m_scene.step();
            const std::size_t shift = step == m_life.steps - 2 ? 7 : 0;  // boxes change places
            for (std::uint32_t row = 0; row < m_life.boxes; ++row)
                m_table.setBox(row, m_scene.boxes()[(row + shift) % m_life.boxes]);
        }
    }

private:
    void update()
    {
        const ProxyView view = m_table.beginUpdate(0.0f, true);
        PairDelta delta;
        Status status = updateOnce(view, delta);
        if (status != Status::Ok)
        {
            EXPECT_TRUE(hasFaultHappened());
            EXPECT_EQ(status, statusOf(m_kind));
            EXPECT_TRUE(delta.added.empty() && delta.removed.empty());
            if (m_life.heir == Heir::Grid)
                m_backend = makeGridBackend();
            m_backend->restart(m_pairs);
            status = updateOnce(view, delta);
        }
        EXPECT_EQ(status, Status::Ok);
        m_table.endUpdate();
        apply(delta);
        EXPECT_EQ(m_pairs, bruteForce());
    }

    Status updateOnce(const ProxyView& view, PairDelta& delta)
    {
        Status status = Status::Ok;
        m_run.certain([&] { status = m_backend->update(view, delta); });
        return status;
    }

    void apply(const PairDelta& delta)
    {
        Pairs stayed, pairs;
        std::set_difference(m_pairs.begin(), m_pairs.end(), delta.removed.begin(), delta.removed.end(),
                            std::back_inserter(stayed));
        std::set_union(stayed.begin(), stayed.end(), delta.added.begin(), delta.added.end(),
                       std::back_inserter(pairs));
        m_pairs = std::move(pairs);
    }

    /// Every pair that overlaps, by a sweep along x.
    Pairs bruteForce() const
    {
        std::vector<std::uint32_t> rows(m_life.boxes);
        std::iota(rows.begin(), rows.end(), 0u);
        std::sort(rows.begin(), rows.end(),
                  [this](std::uint32_t a, std::uint32_t b)
                  { return m_table.box(a).min[0] < m_table.box(b).min[0]; });
        Pairs pairs;
        for (std::size_t i = 0; i < rows.size(); ++i)
        {
            const Aabb& box = m_table.box(rows[i]);
            for (std::size_t k = i + 1; k < rows.size() && m_table.box(rows[k]).min[0] <= box.max[0]; ++k)
                if (overlaps(box, m_table.box(rows[k])))
                    pairs.push_back(makePair(rows[i] + 1, rows[k] + 1));
        }
        std::sort(pairs.begin(), pairs.end());
        EXPECT_GT(pairs.size(), m_life.boxes / 4) << "too few to be a test";
        return pairs;
    }

    FaultRun& m_run;
    const Scene& m_life;
    FaultKind m_kind;
    BoxScene m_scene;
    ProxyTable m_table;
    Pairs m_pairs;
    std::unique_ptr<Backend> m_backend;
};

std::uint64_t sweepBackend(const std::string& name, FaultKind kind, const Scene& scene,
                           std::uint64_t every = kEveryOfMost)
{
    const auto live = [&](FaultRun& run) { BackendLife(run, scene, kind).live(); };
    return sweepFaults(name.c_str(), kind, live, every).injected;
}

std::vector<NamedOptions> searches()
{
    std::vector<NamedOptions> all = allVariants();
    all.push_back({"Near", keepingNear()});
    SearchOptions timed;
    timed.timeStages = true;
    all.push_back({"TimedStages", timed});
    return all;
}

TEST(BackendFaults, LeavePairsExactWhenAnyCallOfTheExecutorFails)
{
    for (const NamedOptions& search : searches())
    {
        Scene scene{[&] { return makeFaultyPsap(search.options); }};
        scene.steps = framesWithPlan(search.options, 3);
        EXPECT_GE(sweepBackend("psap " + search.name, FaultKind::DeviceMemory, scene), 80u);
        scene.heir = Heir::Grid;
        EXPECT_GE(sweepBackend("psap " + search.name, FaultKind::DeviceLoss, scene), 80u);
    }
}

TEST(BackendFaults, LeavePairsExactWhenAllocationOfTheExecutorFails)
{
    for (const NamedOptions& search : searches())
    {
        Scene scene{[&] { return makeFaultyPsap(search.options); }};
        scene.steps = framesWithPlan(search.options, 3);
        EXPECT_GE(sweepBackend("psap " + search.name, FaultKind::New, scene), 50u);
    }
}

std::unique_ptr<Backend> makeThreadedGrid()
{
    GridOptions options;
    options.threads = 3;
    options.flatLimit = 0;
    return makeGridBackend(options);
}

std::unique_ptr<Backend> makeThreadedPsap()
{
    PsapOptions options;
    options.executor = PsapExecutor::Threads;
    options.threads = 3;
    return makeFaultyPsap(options);
}

TEST(BackendFaults, LeavePairsExactWhenAllocationOfAnyThreadFails)
{
    EXPECT_GE(sweepBackend("grid on threads", FaultKind::New, {makeThreadedGrid, 8200, 2}, kEveryOfFew), 50u);
    EXPECT_GE(sweepBackend("psap on threads", FaultKind::New, {makeThreadedPsap, 200, 3}), 75u);
}

TEST(BackendFaults, LeavePairsExactWhenThreadDoesNotStart)
{
    EXPECT_GE(sweepBackend("grid on threads", FaultKind::ThreadStart, {makeThreadedGrid, 8200, 2}), 1u);
    EXPECT_GE(sweepBackend("psap on threads", FaultKind::ThreadStart, {makeThreadedPsap, 200, 3}), 1u);
}
}  // namespace
}  // namespace cullet::test
