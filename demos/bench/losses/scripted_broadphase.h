// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/losses/loss_case.h"
#include "cullet/demos/scenes/bodies/broadphase_factory.h"

#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// @param centre [3]
inline ExactBox cubeAt(const double* centre, double halfEdge)
{
    ExactBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = centre[axis] - halfEdge;
        box.max[axis] = centre[axis] + halfEdge;
    }
    return box;
}

/// A side of a case without a world: a broad phase with the boxes of a script.
class ScriptedBroadphase : public LossSide
{
public:
    /// @param margin negative: gDbvtMargin
    explicit ScriptedBroadphase(const LossSetup& setup, btScalar margin = btScalar(-1));
    ~ScriptedBroadphase() override;

    PairDigest answer() override;
    PairDigest exactAnswer() override;
    std::uint64_t releaseAndMeasure() override;

protected:
    struct Body
    {
        ExactBox box;
        int group = 1;
        int mask = -1;
        void* client = nullptr;
        btBroadphaseProxy* proxy = nullptr;
    };

    void add(const ExactBox& box, int group = 1, int mask = -1, void* client = nullptr);

    /// Changes the box of the script; the broad phase receives it in setBoxes().
    void place(std::uint32_t row, const ExactBox& box) { m_bodies[row].box = box; }

    /// Makes the broad phase without a proxy.
    void makeBroadphase();
    void createProxies();
    /// Destroys the proxy of the row and creates one with other filter words.
    void createAgain(std::uint32_t row, int group, int mask);
    /// Sets the boxes of the rows from `first` on.
    void setBoxes(std::uint32_t first = 0);
    void findPairs();
    /// Destroys all proxies and the broad phase.
    void destroy();

    btBroadphaseInterface& broadphase() { return *m_broadphase.broadphase; }
    std::uint32_t size() const { return static_cast<std::uint32_t>(m_bodies.size()); }
    const ExactBox& box(std::uint32_t row) const { return m_bodies[row].box; }
    btBroadphaseProxy& proxy(std::uint32_t row) { return *m_bodies[row].proxy; }
    const LossSetup& setup() const { return m_setup; }

    /// For the algorithms of pairs, if the script has any.
    virtual btDispatcher* dispatcher() { return nullptr; }

    /// Whether the script's filter callback, if there is one, lets a pair pass.
    virtual bool allows(const btBroadphaseProxy& /*a*/, const btBroadphaseProxy& /*b*/) const { return true; }

    std::uint32_t rowOf(const btBroadphaseProxy& proxy) const
    {
        return m_rows[static_cast<std::uint32_t>(proxy.m_uniqueId)];
    }

private:
    void createProxy(std::uint32_t row);

    LossSetup m_setup;
    btScalar m_margin;
    NamedBroadphase m_broadphase;
    std::vector<Body> m_bodies;
    std::vector<std::uint32_t> m_rows;  ///< by unique id of a proxy
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
