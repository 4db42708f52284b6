// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"
#include "cullet/plugin/core/precision.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btAlignedObjectArray.h>
#include <LinearMath/btTransform.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Lists the bodies that the loops of a step have to visit: all but those that sleep and that each loop would leave bit by
/// bit as they are.
///
/// Bullet's loops clear the forces of a sleeping body and its velocity, and predict its transform from its pose. It is left
/// out if forces and velocity are 0 and the predicted transform is that of its pose. Which one that is, is remembered
/// from the step in which Bullet computed it: of a body without velocity it depends on the pose alone.
///
/// Bullet reports no change of a body, so each step compares all sleeping bodies once. The list serves the loops until
/// code of the application may run, which may change any body.
class AwakeBodies
{
public:
    using Bodies = btAlignedObjectArray<btRigidBody*>;

    /// Bodies per task of a search.
    static constexpr int kGrain = 256;

    /// Whether the loops know already which bodies they have to visit.
    bool areKnown() const { return m_state == State::Listed || m_state == State::All; }

    /// Whether all bodies that sleep are left out.
    bool sleepersStay() const { return areKnown() && m_allSleepers == static_cast<int>(resting()); }

    /// Whether the last search found most bodies asleep, and the list does not serve: what is worth a prefetch.
    bool mostSleep() const { return m_state == State::Unknown && 2 * m_allSleepers > m_count; }

    /// Begins a search; examine() follows for each task, then end(). Throws std::bad_alloc.
    ///
    /// @return false: with such a time step or such settings of Bullet's, sleeping bodies change too
    bool begin(const Bodies& bodies, btScalar timeStep);

    /// Examines the bodies of a task, on any thread.
    void examine(const Bodies& bodies, unsigned task);

    /// Ends a search. Throws std::bad_alloc.
    void end(const Bodies& bodies);

    /// Code of the application runs, or has run.
    void forget() { m_state = State::Unknown; }

    /// Code of the application runs unless resume() is called: until then all bodies are visited.
    void suspend() { m_state = m_state == State::Listed ? State::Suspended : m_state; }
    void resume() { m_state = m_state == State::Suspended ? State::Listed : m_state; }

    /// The indices of the bodies to visit, ascending; null: all.
    const Array<int>* indices(const Bodies& bodies) const
    {
        return m_state == State::Listed && m_count == bodies.size() ? &m_awake : nullptr;
    }

    /// Number of bodies that the last search left out.
    std::size_t resting() const { return static_cast<std::size_t>(m_count) - m_awake.size(); }

    /// Nanoseconds that a search takes, by what the last one has found.
    double costOfSearch(int bodies) const;

    /// Remembers the predicted transform of a body that sleeps, on any thread.
    void note(int index, const btRigidBody& body)
    {
        const auto place = static_cast<std::size_t>(index);
        if (place < m_predictions.size() && m_isUsual && body.getActivationState() == ISLAND_SLEEPING &&
            isWithoutVelocity(body))
            m_predictions[place] = {body.getWorldTransform(), body.getInterpolationWorldTransform()};
    }

private:
    enum class State : std::uint8_t
    {
        Unknown,
        All,       ///< none can be left out
        Listed,    ///< those of the list have to be visited
        Suspended  ///< as Listed, if no code of the application has run meanwhile
    };

    /// What Bullet predicts for a body without velocity.
    struct Prediction
    {
        btTransform from, to;
    };

    static bool isWithoutVelocity(const btRigidBody& body);
    bool isAtRest(const btRigidBody& body, std::size_t index) const;
    void predictNone(std::size_t bodies);

    State m_state = State::Unknown;
    bool m_isUsual = false;  ///< time step and settings are such that sleeping bodies may be left out
    int m_count = 0;         ///< bodies of the last search
    Array<int> m_awake;      ///< indices of the bodies to visit
    Array<int> m_found;      ///< those of each task, from where its bodies begin
    Array<int> m_ends;       ///< [task] end of its part of what was found
    Array<int> m_sleepers;   ///< [task] bodies that sleep, left out or not
    int m_allSleepers = 0;
    std::vector<Prediction>
        m_predictions;  ///< [body] facts, whichever body is there; empty while none sleeps
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
