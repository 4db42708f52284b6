// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/box_losses.h"

#include "cullet/demos/bench/losses/scripted_broadphase.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/box_scene.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCallback.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::unique_ptr<BoxScene> makeScene(const char* name, const LossSetup& setup)
{
    return findBoxScene(name)->make({setup.bodies, false, setup.seed});
}

/// A broad phase that follows one of boxScenes().
class FollowingBroadphase : public ScriptedBroadphase
{
public:
    FollowingBroadphase(const LossSetup& setup, const char* scene)
        : ScriptedBroadphase(setup), m_scene(makeScene(scene, setup))
    {
    }

protected:
    void addAll()
    {
        for (const Aabb& box : m_scene->boxes())
            add(toExactBox(box));
    }

    /// The next frame of the scene, for the rows from `first` on.
    void stepScene(std::uint32_t first = 0)
    {
        const std::vector<Aabb>& boxes = nextBoxes();
        for (std::uint32_t row = first; row < size(); ++row)
            place(row, toExactBox(boxes[row]));
    }

    const std::vector<Aabb>& sceneBoxes() const { return m_scene->boxes(); }

    /// The boxes of the next frame of the scene.
    const std::vector<Aabb>& nextBoxes()
    {
        m_scene->step();
        return m_scene->boxes();
    }

private:
    std::unique_ptr<BoxScene> m_scene;
};

class GhostsLoss : public FollowingBroadphase
{
public:
    explicit GhostsLoss(const LossSetup& setup)
        : FollowingBroadphase(setup, "W1"),
          m_ghosts(setup.bodies / 3),
          m_movers(setup.bodies - setup.bodies / 3)
    {
        for (std::uint32_t row = 0; row < setup.bodies; ++row)
        {
            btCollisionObject& client = row < m_ghosts.size()
                                            ? m_ghosts[row]
                                            : m_movers[row - static_cast<std::uint32_t>(m_ghosts.size())];
            add(toExactBox(sceneBoxes()[row]), 1, -1, &client);
        }
        makeBroadphase();
        broadphase().getOverlappingPairCache()->setInternalGhostPairCallback(&m_callback);
        createProxies();
        findPairs();
    }

    // Before the ghosts, which the removal of pairs changes.
    ~GhostsLoss() override { destroy(); }

    double run() override
    {
        const auto first = static_cast<std::uint32_t>(m_ghosts.size());
        stepScene(first);
        const Stopwatch watch;
        setBoxes(first);
        findPairs();
        return watch.wallMs();
    }

private:
    btGhostPairCallback m_callback;
    std::vector<btGhostObject> m_ghosts;
    std::vector<btCollisionObject> m_movers;
};

class DriftLoss : public FollowingBroadphase
{
public:
    explicit DriftLoss(const LossSetup& setup) : FollowingBroadphase(setup, "W1")
    {
        addAll();
        makeBroadphase();
        createProxies();
        findPairs();
    }

    double run() override
    {
        // All frames at once: to read a clock takes longer than a frame of a few bodies.
        std::vector<std::vector<Aabb>> frames(20);
        for (std::vector<Aabb>& frame : frames)
            frame = nextBoxes();
        const Stopwatch watch;
        for (const std::vector<Aabb>& frame : frames)
        {
            for (std::uint32_t row = 0; row < size(); ++row)
                place(row, toExactBox(frame[row]));
            setBoxes();
            findPairs();
        }
        return watch.wallMs();
    }
};

class HeapLoss : public FollowingBroadphase
{
public:
    explicit HeapLoss(const LossSetup& setup) : FollowingBroadphase(setup, "W4") { addAll(); }

    double run() override
    {
        destroy();
        makeBroadphase();
        createProxies();
        findPairs();
        double slowest = 0.0;
        for (int frame = 0; frame < 8; ++frame)
        {
            stepScene();
            const Stopwatch watch;
            setBoxes();
            findPairs();
            slowest = std::max(slowest, watch.wallMs());
        }
        return slowest;
    }
};

/// The loop of a motion planner: links among static boxes, without a world, and with a margin of 0.
class PlanningLoss : public ScriptedBroadphase
{
public:
    enum class Motion
    {
        Teleports,    ///< links are somewhere else in each check
        Steps,        ///< links move by up to 2 cm on each axis
        OtherFilters  ///< as Teleports, and one link is created anew with other filter words, as planners do
    };

    PlanningLoss(const LossSetup& setup, Motion motion)
        : ScriptedBroadphase(setup, 0), m_motion(motion), m_random(setup.seed)
    {
        m_firstLink = setup.bodies - std::min(kLinks, setup.bodies / 2);
        for (std::uint32_t row = 0; row < setup.bodies; ++row)
        {
            const bool isLink = row >= m_firstLink;
            add(drawBox(), isLink ? kLinkGroup : kStaticGroup,
                isLink ? kStaticGroup | kLinkGroup : kLinkGroup);
        }
        makeBroadphase();
        createProxies();
        findPairs();
    }

    double run() override { return check(200); }

protected:
    /// Milliseconds of so many checks.
    double check(int poses)
    {
        double milliseconds = 0.0;
        for (int pose = 0; pose < poses; ++pose)
        {
            for (std::uint32_t row = m_firstLink; row < size(); ++row)
                place(row, m_motion == Motion::Steps ? stepped(box(row)) : drawBox());
            const Stopwatch watch;
            if (m_motion == Motion::OtherFilters)
                changeFilter(m_firstLink + static_cast<std::uint32_t>(pose) % (size() - m_firstLink));
            setBoxes(m_firstLink);
            findPairs();
            broadphase().getOverlappingPairCache()->processAllOverlappingPairs(&m_counter, nullptr);
            milliseconds += watch.wallMs();
        }
        return milliseconds;
    }

private:
    static constexpr std::uint32_t kLinks = 10;
    static constexpr int kStaticGroup = 1, kLinkGroup = 2;

    struct Counter : btOverlapCallback
    {
        bool processOverlap(btBroadphasePair&) override
        {
            ++count;
            return false;
        }
        std::uint64_t count = 0;
    };

    /// The link no longer meets other links, or meets them again.
    void changeFilter(std::uint32_t link)
    {
        broadphase().getOverlappingPairCache()->cleanProxyFromPairs(&proxy(link), nullptr);
        createAgain(link, kLinkGroup, kStaticGroup | (proxy(link).m_collisionFilterMask ^ kLinkGroup));
    }

    /// Boxes of 10 to 30 cm in a room of 4 m.
    ExactBox drawBox()
    {
        double centre[3];
        for (double& x : centre)
            x = m_random.uniform(-2.0f, 2.0f);
        return cubeAt(centre, m_random.uniform(0.05f, 0.15f));
    }

    ExactBox stepped(ExactBox box)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            const double by = m_random.uniform(-0.02f, 0.02f);
            box.min[axis] += by;
            box.max[axis] += by;
        }
        return box;
    }

    Motion m_motion;
    SplitMix64 m_random;
    std::uint32_t m_firstLink = 0;
    Counter m_counter;
};

/// A planner's thread from the construction of its broad phase on.
class PlanningFromConstructionLoss : public PlanningLoss
{
public:
    explicit PlanningFromConstructionLoss(const LossSetup& setup) : PlanningLoss(setup, Motion::Teleports) {}

    double run() override
    {
        const Stopwatch watch;
        destroy();
        makeBroadphase();
        createProxies();
        const double construction = watch.wallMs();
        return construction + check(20);
    }
};

class ConstructionLoss : public FollowingBroadphase
{
public:
    explicit ConstructionLoss(const LossSetup& setup) : FollowingBroadphase(setup, "W1") { addAll(); }

    double run() override
    {
        double milliseconds = 0.0;
        for (int repetition = 0; repetition < 10; ++repetition)
        {
            // Also destroys that of the last run, whose pairs were the answer.
            const Stopwatch watch;
            destroy();
            makeBroadphase();
            createProxies();
            findPairs();
            milliseconds += watch.wallMs();
        }
        return milliseconds;
    }
};
}  // namespace

std::unique_ptr<LossSide> makeGhostsLoss(const LossSetup& setup)
{
    return std::make_unique<GhostsLoss>(setup);
}

std::unique_ptr<LossSide> makeDriftLoss(const LossSetup& setup)
{
    return std::make_unique<DriftLoss>(setup);
}

std::unique_ptr<LossSide> makeHeapLoss(const LossSetup& setup)
{
    return std::make_unique<HeapLoss>(setup);
}

std::unique_ptr<LossSide> makePlanningLoss(const LossSetup& setup)
{
    return std::make_unique<PlanningLoss>(setup, PlanningLoss::Motion::Teleports);
}

std::unique_ptr<LossSide> makePlanningStepsLoss(const LossSetup& setup)
{
    return std::make_unique<PlanningLoss>(setup, PlanningLoss::Motion::Steps);
}

std::unique_ptr<LossSide> makePlanningFiltersLoss(const LossSetup& setup)
{
    return std::make_unique<PlanningLoss>(setup, PlanningLoss::Motion::OtherFilters);
}

std::unique_ptr<LossSide> makePlanningFromConstructionLoss(const LossSetup& setup)
{
    return std::make_unique<PlanningFromConstructionLoss>(setup);
}

std::unique_ptr<LossSide> makeConstructionLoss(const LossSetup& setup)
{
    return std::make_unique<ConstructionLoss>(setup);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
