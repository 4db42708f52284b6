// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Hulls of a few lattice points in exact poses: their structure, and all queries of a pair, from caches of any content.

#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/fuzz_target.h"
#include "cullet/tests/fuzz/hulls/hull_pair_check.h"
#include "cullet/tests/fuzz/hulls/hull_structure_check.h"
#include "cullet/tests/support/random.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace cullet::test
{
const char* const kFuzzTargetName = "hulls";

namespace
{
/// Any content that the types allow and vertices need not have.
template <class S>
GjkCache<S> randomCache(std::uint32_t seed)
{
    Random random(seed);
    const auto anyId = [&]
    {
        const std::uint32_t kind = random.below(8);
        return static_cast<std::uint16_t>(kind == 0 ? 0xffffu : kind == 1 ? random.bits() : random.below(12));
    };
    GjkCache<S> cache;
    for (float& component : cache.axis)
        component = random.below(3) == 0 ? 0.0f : random.between(-1, 1);
    const float sign = random.chance(0.5f) ? 1.0f : -1.0f;
    if (random.below(8) != 0)
        cache.axis[random.below(3)] = sign * random.between(0.5f, 1);
    for (std::size_t i = 0; i < 4; ++i)
    {
        cache.verticesA[i] = anyId();
        cache.verticesB[i] = anyId();
    }
    cache.startA = anyId();
    cache.startB = anyId();
    cache.state = static_cast<GjkState>(random.below(4));
    cache.count = static_cast<std::uint8_t>(random.below(5));
    return cache;
}

/// What queries of one precision leave for the next ones.
template <class S>
struct Memory
{
    GjkCache<S> caches[2];  ///< of A and B, and of B and A
    EpaCache surface;       ///< of A and B
};

/// Two hulls, and what a query needs beside them.
struct Scene
{
    LatticeHull hulls[2];
    int power = -3;    ///< a step of the lattice is 2^power
    Lattice far = {};  ///< where both are moved
    std::uint32_t limitKind = 0;
    std::uint32_t seed = 1;  ///< of caches and directions
};

template <class S>
S limitOf(const Scene& scene, const LatticeTruth& truth, long double unit)
{
    static constexpr long double kFactors[] = {0, 0.5L, 0.999L, 0.99999L, 1, 1.00001L, 1.001L, 2};
    if (scene.limitKind < 8)
        return static_cast<S>(kFactors[scene.limitKind] * truth.distance * unit);
    return static_cast<S>(static_cast<long double>(scene.limitKind - 8) * unit);
}

template <class S>
class SceneCheck
{
public:
    SceneCheck(const Scene& scene, const LatticeTruth& lattice, Memory<S>& memory)
        : m_scene(scene),
          m_unit(std::ldexp(1.0, scene.power)),
          m_truth(lattice, static_cast<long double>(m_unit)),
          m_limit(limitOf<S>(scene, lattice, static_cast<long double>(m_unit))),
          m_memory(memory),
          m_typed{TypedHull<S>(scene.hulls[0], m_unit), TypedHull<S>(scene.hulls[1], m_unit)}
    {
    }

    std::string run()
    {
        for (std::size_t i = 0; i < 2; ++i)
        {
            const std::string error =
                HullStructureCheck<S>(m_scene.hulls[i], m_typed[i]).run(m_scene.seed + i);
            if (!error.empty())
                return (i == 0 ? "A, " : "B, ") + error;
        }
        const std::string error = checkPair(0);
        return error.empty() ? checkPair(1) : error;
    }

private:
    /// @param first the hull that is A
    std::string checkPair(std::size_t first)
    {
        const LatticeHull &a = m_scene.hulls[first], &b = m_scene.hulls[1 - first];
        HullPairCheck<S> check(a.placed(), b.placed(), a.origin, static_cast<long double>(m_unit), m_truth);
        const PosedHull<S> posedA = m_typed[first].posed(), posedB = m_typed[1 - first].posed();
        const PairAnswers<S> cold = check.ask(posedA, posedB, m_limit, {}, "fresh cache");
        GjkCache<S>& last = m_memory.caches[first];
        const PairAnswers<S> warm = check.ask(posedA, posedB, m_limit, last, "cache of the last pair");
        const PairAnswers<S> other =
            check.ask(posedA, posedB, m_limit, randomCache<S>(m_scene.seed), "random cache");
        checkSettled(cold, warm, check);
        checkSettled(cold, other, check);
        checkMoved(first, cold, check);
        check.checkExactPenetration(posedA, posedB);
        if (first == 0)
            check.askRemembered(posedA, posedB, last, m_memory.surface);
        isaGjk(posedA, posedB, m_limit, last);
        gjkDistance(posedA, posedB, m_limit, last);
        penetration(posedA, posedB, last, first == 0 ? &m_memory.surface : nullptr);
        if (first == 0 && m_memory.surface.vertexCount > 0)
            check.askRemembered(posedA, posedB, last, m_memory.surface);
        return check.error().empty() ? "" : (first == 0 ? "A B, " : "B A, ") + check.error();
    }

    /// What is settled depends on shapes and poses alone.
    static void checkSettled(const PairAnswers<S>& a, const PairAnswers<S>& b, HullPairCheck<S>& check)
    {
        if (a.deep.isSettled && b.deep.isSettled)
            check.require(isSameAnswer(a.deep, b.deep), "two settled depths differ: ", a.deep.depth, " and ",
                          b.deep.depth);
    }

    /// Points are relative to the origin of A, and the origins' difference is exact.
    void checkMoved(std::size_t first, const PairAnswers<S>& here, HullPairCheck<S>& check)
    {
        const auto shift = TypedHull<S>::toVector(m_scene.far, m_unit);
        const PosedHull<S> a = m_typed[first].posedAt(shift), b = m_typed[1 - first].posedAt(shift);
        const PairAnswers<S> there = check.ask(a, b, m_limit, {}, "moved, fresh cache");
        check.require(isSameAnswer(here.isa, there.isa), "isaGjk() differs far away");
        check.require(isSameAnswer(here.near, there.near),
                      "gjkDistance() differs far away: ", here.near.distance, " and ", there.near.distance);
        check.require(isSameAnswer(here.deep, there.deep),
                      "penetration() differs far away: ", here.deep.depth, " and ", there.deep.depth);
    }

    const Scene& m_scene;
    const double m_unit;
    const PairTruth<S> m_truth;
    const S m_limit;
    Memory<S>& m_memory;
    const TypedHull<S> m_typed[2];
};

/// Changes a scene as an input says, and checks it after each change.
class Session
{
public:
    std::string run(Choices& choices)
    {
        for (; !choices.isEmpty(); choices.nextOperation())
        {
            if (!change(choices))
                continue;
            const std::string error = check();
            if (!error.empty())
                return error;
        }
        return check();
    }

private:
    /// @return whether the scene is worth a check
    bool change(Choices& choices)
    {
        const std::uint32_t kind = choices.below(16);
        const std::size_t which = choices.below(2);
        LatticeHull& hull = m_scene.hulls[which];
        if (kind < 4)
            return addPoints(choices, hull);
        if (kind == 4)
            return replace(choices, hull);
        if (kind == 5)
        {
            hull.exponent = choices.below(6);
            forgetSurfaces();
        }
        else if (kind < 8)
        {
            hull.orientation = choices.below(48);
            const std::uint32_t span = choices.chance(128) ? 17u : 257u;
            for (std::int64_t& component : hull.origin)
                component = signedBelow(choices, span) * (span == 17u ? 8 : 1);
        }
        else if (kind < 12)
            nudge(choices, hull);
        else if (kind == 12)
            setScale(choices);
        else if (kind == 13)
            touch(choices, hull, m_scene.hulls[1 - which]);
        m_scene.limitKind = choices.below(16);
        m_scene.seed = choices.below(65536);
        return true;
    }

    static std::int64_t signedBelow(Choices& choices, std::uint32_t count)
    {
        // Zero for a zero.
        const std::int64_t value = choices.below(count);
        return value % 2 == 0 ? value / 2 : -(value / 2) - 1;
    }

    static Lattice gridPoint(Choices& choices, std::uint32_t count)
    {
        Lattice point;
        for (std::int64_t& component : point)
            component = signedBelow(choices, count);
        return point;
    }

    bool addPoints(Choices& choices, LatticeHull& hull)
    {
        const std::uint32_t span = choices.chance(64) ? 17u : 5u;
        for (std::uint32_t left = 1 + choices.below(4); left > 0; --left)
        {
            const Lattice point = gridPoint(choices, span);
            if (hull.grid.size() == LatticeHull::kMostPoints)
                hull.grid.erase(hull.grid.begin());
            hull.grid.push_back(point);
        }
        forgetSurfaces();
        return false;
    }

    /// By nothing, or by the corners of a box.
    bool replace(Choices& choices, LatticeHull& hull)
    {
        hull.grid.clear();
        forgetSurfaces();
        if (choices.chance(96))
            return false;
        const Lattice low = gridPoint(choices, 9), high = gridPoint(choices, 9);
        for (std::size_t corner = 0; corner < 8; ++corner)
        {
            const auto at = [&](std::size_t axis)
            { return (corner >> axis & 1u) != 0 ? high[axis] : low[axis]; };
            hull.grid.push_back({at(0), at(1), at(2)});
        }
        return true;
    }

    static void nudge(Choices& choices, LatticeHull& hull)
    {
        for (std::int64_t& component : hull.origin)
        {
            component += signedBelow(choices, 5);
            if (std::abs(component) > 1024)
                component = 0;
        }
    }

    void setScale(Choices& choices)
    {
        m_scene.power = static_cast<int>(signedBelow(choices, 33)) - 3;
        for (std::int64_t& component : m_scene.far)
            component = signedBelow(choices, 256) * (std::int64_t(1) << choices.below(13));
    }

    /// Moves a hull so that two points coincide, or nearly.
    static void touch(Choices& choices, LatticeHull& hull, const LatticeHull& other)
    {
        const LatticePoints own = hull.placed(), its = other.placed();
        if (own.empty() || its.empty())
            return;
        const Lattice& p = own[choices.below(LatticeHull::kMostPoints) % own.size()];
        const Lattice& q = its[choices.below(LatticeHull::kMostPoints) % its.size()];
        const Lattice beside = gridPoint(choices, 3);
        for (std::size_t axis = 0; axis < 3; ++axis)
            hull.origin[axis] += q[axis] - p[axis] + beside[axis];
        if (std::abs(hull.origin[0]) + std::abs(hull.origin[1]) + std::abs(hull.origin[2]) > 2048)
            hull.origin = {};
    }

    /// A surface is one of the same two shapes.
    void forgetSurfaces()
    {
        m_inFloat.surface = {};
        m_inDouble.surface = {};
    }

    std::string check()
    {
        if (m_scene.hulls[0].grid.empty() || m_scene.hulls[1].grid.empty())
            return "";
        const LatticeTruth truth = solveLattice(m_scene.hulls[0].placed(), m_scene.hulls[1].placed());
        const std::string error = SceneCheck<float>(m_scene, truth, m_inFloat).run();
        return error.empty() ? SceneCheck<double>(m_scene, truth, m_inDouble).run() : error;
    }

    Scene m_scene;
    Memory<float> m_inFloat;
    Memory<double> m_inDouble;
};
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    Choices choices(data, size);
    return Session().run(choices);
}
}  // namespace cullet::test
