// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Cases in which boxes walk within a crowd.
#include "cullet/demos/bench/losses/box_losses.h"
#include "cullet/demos/bench/losses/scripted_broadphase.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <algorithm>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Boxes in a cube of 2 m, each of which walks at random.
class WalkingLoss : public ScriptedBroadphase
{
public:
    /// @param mask of all boxes, whose group is 1
    WalkingLoss(const LossSetup& setup, double halfEdge, double origin, int mask = -1)
        : ScriptedBroadphase(setup), m_random(setup.seed), m_halfEdge(halfEdge), m_origin(origin)
    {
        for (std::uint32_t row = 0; row < setup.bodies; ++row)
        {
            for (int axis = 0; axis < 3; ++axis)
                m_centres.push_back(m_random.uniform(-1.0f, 1.0f));
            add(boxOf(row), 1, mask);
        }
        makeBroadphase();
    }

    double run() override
    {
        walk();
        const Stopwatch watch;
        setBoxes();
        findPairs();
        return watch.wallMs();
    }

protected:
    /// Walks until as many boxes leave their skins in each update as later on: in the first updates none does.
    void begin()
    {
        constexpr int kUntilSteady = 20;
        createProxies();
        findPairs();
        for (int update = 0; update < kUntilSteady; ++update)
        {
            walk();
            setBoxes();
            findPairs();
        }
    }

private:
    void walk()
    {
        for (std::uint32_t row = 0; row < size(); ++row)
        {
            for (int axis = 0; axis < 3; ++axis)
            {
                double& x = m_centres[3 * row + static_cast<std::uint32_t>(axis)];
                x = std::clamp(x + m_random.uniform(-0.02f, 0.02f), -1.0, 1.0);
            }
            place(row, boxOf(row));
        }
    }

    ExactBox boxOf(std::uint32_t row) const
    {
        double centre[3];
        for (std::uint32_t axis = 0; axis < 3; ++axis)
            centre[axis] = m_origin + m_centres[3 * row + axis];
        return cubeAt(centre, m_halfEdge);
    }

    SplitMix64 m_random;
    double m_halfEdge;
    double m_origin;
    std::vector<double> m_centres;  ///< three coordinates a row
};

class FarLoss : public WalkingLoss
{
public:
    explicit FarLoss(const LossSetup& setup) : WalkingLoss(setup, 0.05, 6.4e6) { begin(); }
};

class RefusedLoss : public WalkingLoss
{
public:
    /// @param allowedShare one pair in so many is allowed; 0: none
    RefusedLoss(const LossSetup& setup, std::uint64_t allowedShare)
        : WalkingLoss(setup, 0.5, 0.0), m_filter(allowedShare)
    {
        broadphase().getOverlappingPairCache()->setOverlapFilterCallback(&m_filter);
        begin();
    }

    // Before the filter.
    ~RefusedLoss() override { destroy(); }

private:
    /// Decides by the unique ids, which are the same on all sides.
    class Refusal : public btOverlapFilterCallback
    {
    public:
        explicit Refusal(std::uint64_t allowedShare) : m_allowedShare(allowedShare) {}

        bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
        {
            if (m_allowedShare == 0)
                return false;
            const Pair ids = makePair(static_cast<std::uint32_t>(a->m_uniqueId),
                                      static_cast<std::uint32_t>(b->m_uniqueId));
            return splitMix(pairKey(ids)) % m_allowedShare == 0;
        }

    private:
        std::uint64_t m_allowedShare;
    };

    bool allows(const btBroadphaseProxy& a, const btBroadphaseProxy& b) const override
    {
        return m_filter.needBroadphaseCollision(const_cast<btBroadphaseProxy*>(&a),
                                                const_cast<btBroadphaseProxy*>(&b));
    }

    Refusal m_filter;
};

class MaskedLoss : public WalkingLoss
{
public:
    explicit MaskedLoss(const LossSetup& setup) : WalkingLoss(setup, 0.5, 0.0, 2) { begin(); }
};
}  // namespace

std::unique_ptr<LossSide> makeFarLoss(const LossSetup& setup)
{
    return std::make_unique<FarLoss>(setup);
}

std::unique_ptr<LossSide> makeRefusedLoss(const LossSetup& setup)
{
    return std::make_unique<RefusedLoss>(setup, 0);
}

std::unique_ptr<LossSide> makeMostlyRefusedLoss(const LossSetup& setup)
{
    return std::make_unique<RefusedLoss>(setup, 16);
}

std::unique_ptr<LossSide> makeMaskedLoss(const LossSetup& setup)
{
    return std::make_unique<MaskedLoss>(setup);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
