// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/solver_rows.h"

#include <LinearMath/btVector3.h>

#include <cstdint>
#include <vector>

class btCollisionObject;
class btRigidBody;
struct btContactSolverInfo;

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
/// The bodies of a group, by number. Number kFixedBody stands for all objects that nothing moves. Bodies that are near each
/// other have near numbers, so that constraints in the order of numbers find their bodies in near caches.
class SolverBodies
{
public:
    /// What find() returns for a body that add() must number.
    static constexpr std::uint32_t kUnknown = ~std::uint32_t{0};

    /// Begins a group: numbers its bodies.
    void number(btCollisionObject** bodies, int count, ParallelLoops& loops);

    /// The number of an object, if it has one. On any thread.
    std::uint32_t find(const btCollisionObject& object) const;
    /// The number of an object; adds it if it is new.
    std::uint32_t add(btCollisionObject& object);

    /// Divides a body into kBlock parts of equal mass, by which as many rows can move it at once ("Mass splitting for
    /// jitter-free parallel rigid body simulation", Tonge et al. 2012). After all bodies are known, before their states are.
    ///
    /// @return the number of the first part; the others follow
    std::uint32_t split(std::uint32_t number);
    /// Gives the parts of a body its motion.
    ///
    /// @param motions motions() or pushes()
    static void spread(std::uint32_t number, std::uint32_t firstPart, SolverMotion* motions);
    /// Gives a body the mean motion of its parts, which has their momentum.
    static void merge(std::uint32_t number, std::uint32_t firstPart, SolverMotion* motions);

    /// Computes the states, when all bodies are known.
    void readStates(const btContactSolverInfo& info, ParallelLoops& loops);

    /// @name Soft steps
    ///@{
    /// Makes the motions velocities, without what forces add.
    void beginSubsteps(ParallelLoops& loops);
    /// Adds what forces add in a substep. A body without rows gets all of it in the first one, and moves as with Bullet's
    /// solver.
    void addForces(int substep, btScalar share, ParallelLoops& loops);
    /// Moves the bodies by their velocities.
    void move(btScalar time, ParallelLoops& loops);
    /// Ends a substep. A step must move a body by its velocity after the forces of the step, as Bullet's does: springs that
    /// an application makes of forces, and chains under tension, gain energy otherwise. So what has been added to a velocity
    /// now is missing in the substeps before, unless that is an impact.
    void endSubstep(int substep, btScalar share, btScalar time, ParallelLoops& loops);
    /// Gives the bodies their velocities, and places from which Bullet moves them to where they are now.
    void writeBackMoved(const btContactSolverInfo& info, ParallelLoops& loops);
    ///@}

    /// Gives the bodies their velocities, and their places if the split impulse moved them.
    void writeBack(const btContactSolverInfo& info, ParallelLoops& loops);

    std::uint32_t size() const { return static_cast<std::uint32_t>(m_bodies.size()); }
    const SolverBodyState* states() const { return m_states.data(); }
    /// Notes that a body has rows.
    void bind(std::uint32_t number) { m_isBound[number] = 1; }
    /// The number that the broad phase gave to a body that rows move, less the lowest of its island: it does not depend on
    /// other islands. All other objects have one in common.
    std::uint32_t localId(std::uint32_t number) const { return m_localIds[number]; }
    /// Whether rows may change a body, which is not so for kinematic ones.
    bool isMoved(std::uint32_t number) const { return m_isMoved[number] != 0; }

    btScalar inverseMass(std::uint32_t number) const;

    bool isAnisotropic(std::uint32_t number) const { return m_isAnisotropic[number] != 0; }

    /// Changes of the velocities; with substeps the velocities.
    SolverMotion* motions() { return m_motions.data(); }
    /// Velocities of the split impulse; with substeps how far the bodies have moved.
    SolverMotion* pushes() { return m_pushes.data(); }

private:
    /// The way that is missing, see endSubstep().
    struct MissingPart
    {
        MissingPart() = default;
        explicit MissingPart(const btScalar* velocity)
            : last(velocity[0], velocity[1], velocity[2]), way(0, 0, 0)
        {
        }
        void add(const btScalar* velocity, const btVector3& added, btScalar time);
        btVector3 total() const { return isSteady ? way : btVector3(0, 0, 0); }

        btVector3 last;  ///< velocity at the end of the last substep
        btVector3 way;
        btScalar first = 0;    ///< change of the velocity in the first substep, squared
        bool isSteady = true;  ///< no later substep has changed it by much more, or than forces: no impact
    };
    struct MissingWay
    {
        MissingPart linear, angular;
    };

    /// What decides about the number of a body.
    struct Place
    {
        btRigidBody* body;  ///< null: no number
        int island;
        std::uint32_t id;       ///< of the broad phase
        std::uint32_t localId;  ///< see localId()
        std::uint32_t cell;     ///< of a grid over the group
        btScalar centre[3];
    };

    static Place placeOf(btCollisionObject& object);
    std::uint32_t findKinematic(const btRigidBody& body) const;
    void findLocalIds();
    void findCells();
    void numberByCells();
    void resize(std::size_t size);
    void set(std::uint32_t number, btRigidBody& body, std::uint32_t localId);
    static SolverBodyState partOf(SolverBodyState state);
    static void readState(const btContactSolverInfo& info, btRigidBody& body, SolverBodyState& state);
    void writeBack(const btContactSolverInfo& info, std::uint32_t number) const;
    void writeBackMoved(const btContactSolverInfo& info, std::uint32_t number) const;

    std::vector<Place> m_places;           ///< [object of the group]
    std::vector<std::uint32_t> m_numbers;  ///< [object of the group]
    std::vector<std::uint32_t> m_firsts;   ///< [cell] number of its next body
    std::size_t m_cells = 1;
    std::vector<btRigidBody*> m_bodies;             ///< [number], null for the fixed one
    std::vector<std::uint8_t> m_isMoved;            ///< [number]
    std::vector<std::uint8_t> m_isAnisotropic;      ///< [number] whether friction depends on its direction
    std::vector<std::uint8_t> m_isBound;            ///< [number] whether the body has rows
    std::vector<std::uint32_t> m_localIds;          ///< [number]
    std::vector<std::uint32_t> m_kinematic;         ///< numbers of kinematic bodies
    std::vector<std::uint32_t> m_split;             ///< numbers of bodies that have parts
    std::vector<SolverBodyState> m_states;          ///< [number], those of parts last
    std::vector<MissingWay> m_missing;              ///< [number] in a soft step
    std::vector<SolverMotion> m_motions, m_pushes;  ///< [number], those of parts last
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
