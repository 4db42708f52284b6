// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/array.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <LinearMath/btAlignedObjectArray.h>
#include <LinearMath/btScalar.h>

#include <cstdint>
#include <memory>

class btRigidBody;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Counters of the last step.
struct WorldBodiesStats
{
    std::uint64_t parallelBodies = 0;  ///< bodies whose transforms were integrated on several threads
    std::uint64_t sweptBodies = 0;     ///< bodies with a CCD threshold, which Bullet's own functions handle
    /// Sleeping bodies that were compared, and then visited by no loop before contacts. Nor by one after them, if all bodies
    /// slept and no code of the application could run.
    std::uint64_t restingBodies = 0;
};

/// The loops of a btDiscreteDynamicsWorld over its bodies, on several threads where there are enough bodies; a part of
/// World<Base>.
///
/// Damping, prediction, integration and deactivation of a body read and write that body only, so that results are the
/// same bits for any number of threads. Motion states are called on the calling thread, in Bullet's order.
class CULLET_API WorldBodies
{
public:
    using Bodies = btAlignedObjectArray<btRigidBody*>;

    /// One of Bullet's functions for an array of bodies.
    class RangeFunction
    {
    public:
        template <class Function>
        explicit RangeFunction(const Function& function)
            : m_function(&function),
              m_call([](const void* what, btRigidBody** bodies, int count)
                     { (*static_cast<const Function*>(what))(bodies, count); })
        {
        }
        void operator()(btRigidBody** bodies, int count) const { m_call(m_function, bodies, count); }

    private:
        const void* m_function;
        void (*m_call)(const void* function, btRigidBody** bodies, int count);
    };

    WorldBodies();
    ~WorldBodies();

    /// @param threads 0: as many as the machine has
    void setThreads(int threads);

    /// With as many bodies at most, the functions that return a bool do nothing: those of the world are as fast, and have
    /// the same bits. WorldIslands compares the objects of the world with it. Tests lower it for the whole program, between
    /// steps.
    static inline int fewBodies = 256;

    /// Lists the bodies that the loops have to visit, unless they are listed: those that are awake, and sleeping ones that a
    /// loop would change. It is for worlds in which each loop is this class's (step/awake_bodies.h says how it works).
    ///
    /// Each sleeping body is compared once, some 20 ns. Without memory, or with as few bodies that Base's own loops run, all
    /// are visited.
    void listAwake(Bodies& bodies, btScalar timeStep);

    /// Whether the loops would change no sleeping body at all. False if that is unknown.
    bool sleepersStay() const;

    /// Code of the application runs, or has run: it may have changed any body.
    void forgetAwake();

    /// Code of the application runs from here on, unless resumeAwake() is called.
    void suspendAwake();
    void resumeAwake();

    /// Whether btDiscreteDynamicsWorld::synchronizeMotionStates() would call no motion state. False if that is unknown.
    bool haveNoMotionState(const Bodies& bodies) const;

    /// As btDiscreteDynamicsWorld::saveKinematicState(), on the calling thread.
    ///
    /// @param restless indices of the objects that are not at rest (WorldRest); null: any may be
    /// @return whether code of the application may have run: the motion state of a kinematic body
    bool saveKinematicState(btCollisionObjectArray& objects, btScalar timeStep, const Array<int>* restless);

    /// As btDiscreteDynamicsWorld::applyGravity().
    ///
    /// @return false, with nothing changed: the world's own function must run
    bool applyGravity(Bodies& bodies) { return !areFew(bodies) && applyGravityToMany(bodies); }

    /// As btDiscreteDynamicsWorld::clearForces().
    ///
    /// @return as applyGravity()
    bool clearForces(Bodies& bodies) { return !areFew(bodies) && clearForcesOfMany(bodies); }

    /// As btDiscreteDynamicsWorld::predictUnconstraintMotion().
    ///
    /// @return as applyGravity()
    bool predictMotion(Bodies& bodies, btScalar timeStep)
    {
        return !areFew(bodies) && predictMotionOfMany(bodies, timeStep);
    }

    /// As btDiscreteDynamicsWorld::createPredictiveContactsInternal() for all bodies. Bullet predicts the transform of
    /// each body and uses it for those with a CCD threshold only; here those alone are predicted.
    ///
    /// @param sweep Bullet's function
    void sweep(Bodies& bodies, const RangeFunction& sweep);

    /// As btDiscreteDynamicsWorld::integrateTransformsInternal() for all bodies.
    ///
    /// @param integrate Bullet's function; called once for all bodies if one of them has a CCD threshold, since a sweep
    ///                  sees the bodies before it integrated and those after it not
    /// @return as applyGravity()
    bool integrate(Bodies& bodies, const RangeFunction& integrate)
    {
        return !areFew(bodies) && integrateMany(bodies, integrate);
    }

    /// As btDiscreteDynamicsWorld::updateActivationState().
    ///
    /// @return as applyGravity(); false, too, where Bullet's library may round otherwise
    bool updateActivation(Bodies& bodies, btScalar timeStep)
    {
        return !areFew(bodies) && updateActivationOfMany(bodies, timeStep);
    }

    const WorldBodiesStats& stats() const;

private:
    struct Parts;

    static bool areFew(const Bodies& bodies) { return bodies.size() <= fewBodies; }
    bool applyGravityToMany(Bodies& bodies);
    bool clearForcesOfMany(Bodies& bodies);
    bool predictMotionOfMany(Bodies& bodies, btScalar timeStep);
    bool integrateMany(Bodies& bodies, const RangeFunction& integrate);
    bool updateActivationOfMany(Bodies& bodies, btScalar timeStep);

    std::unique_ptr<Parts> m;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
