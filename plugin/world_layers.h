// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/world_bodies.h"
#include "cullet/plugin/world_boxes.h"
#include "cullet/plugin/world_islands.h"
#include "cullet/plugin/world_queries.h"
#include "cullet/plugin/world_rest.h"
#include "cullet/plugin/world_speculation.h"

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>
#include <LinearMath/btQuickprof.h>

#include <type_traits>
#include <typeinfo>

namespace cullet
{
inline namespace CULLET_PRECISION
{
template <class Base, template <class> class Holder>
class World;

/// The parts of World<Base>, which derives from Base by one layer per function that it takes over. A layer exists only if
/// Base inherits the function from btDiscreteDynamicsWorld: a class of the application keeps its own ones, private
/// ones too.
namespace world_layers
{
/// Asks from whom Base has its functions; never made.
template <class Base>
class Origins : public Base
{
    using Step = void (btDiscreteDynamicsWorld::*)(btScalar);
    using Solve = void (btDiscreteDynamicsWorld::*)(btContactSolverInfo&);
    using All = void (btDiscreteDynamicsWorld::*)();
    using Ray = void (btCollisionWorld::*)(const btVector3&, const btVector3&,
                                           btCollisionWorld::RayResultCallback&) const;

    // Not found if Base lacks the function, overloads it or hides it from derived classes.
    template <class B>
    static auto solve(int) -> decltype(&B::solveConstraints);
    template <class B>
    static auto islands(int) -> decltype(&B::calculateSimulationIslands);
    template <class B>
    static auto gravity(int) -> decltype(&B::applyGravity);
    template <class B>
    static auto forces(int) -> decltype(&B::clearForces);
    template <class B>
    static auto kinematic(int) -> decltype(&B::saveKinematicState);
    template <class B>
    static auto predict(int) -> decltype(&B::predictUnconstraintMotion);
    template <class B>
    static auto sweep(int) -> decltype(&B::createPredictiveContacts);
    template <class B>
    static auto integrate(int) -> decltype(&B::integrateTransforms);
    template <class B>
    static auto activate(int) -> decltype(&B::updateActivationState);
    template <class B>
    static auto internalStep(int) -> decltype(&B::internalSingleStepSimulation);
    template <class B>
    static auto motionStates(int) -> decltype(&B::synchronizeMotionStates);
    template <class B>
    static auto wholeStep(int) -> decltype(&B::stepSimulation);
    template <class B>
    static auto ray(int) -> decltype(&B::rayTest);
    template <class B>
    static void motionStates(...);
    template <class B>
    static void wholeStep(...);
    template <class B>
    static void ray(...);
    template <class B>
    static void internalStep(...);
    template <class B>
    static void solve(...);
    template <class B>
    static void islands(...);
    template <class B>
    static void gravity(...);
    template <class B>
    static void forces(...);
    template <class B>
    static void kinematic(...);
    template <class B>
    static void predict(...);
    template <class B>
    static void sweep(...);
    template <class B>
    static void integrate(...);
    template <class B>
    static void activate(...);

public:
    static constexpr bool solves() { return std::is_same_v<decltype(solve<Origins>(0)), Solve>; }
    static constexpr bool findsIslands() { return std::is_same_v<decltype(islands<Origins>(0)), All>; }
    static constexpr bool appliesGravity() { return std::is_same_v<decltype(gravity<Origins>(0)), All>; }
    static constexpr bool clearsForces() { return std::is_same_v<decltype(forces<Origins>(0)), All>; }
    static constexpr bool savesKinematic() { return std::is_same_v<decltype(kinematic<Origins>(0)), Step>; }
    static constexpr bool predicts() { return std::is_same_v<decltype(predict<Origins>(0)), Step>; }
    static constexpr bool sweeps() { return std::is_same_v<decltype(sweep<Origins>(0)), Step>; }
    static constexpr bool integrates() { return std::is_same_v<decltype(integrate<Origins>(0)), Step>; }
    /// Whether all between updateAabbs() and calculateSimulationIslands() is Bullet's own.
    static constexpr bool detectsAsBullet()
    {
        using Detect = void (btCollisionWorld::*)();
        return std::is_same_v<decltype(&Base::performDiscreteCollisionDetection), Detect> &&
               std::is_same_v<decltype(&Base::computeOverlappingPairs), Detect>;
    }
    /// Whether all between saveKinematicState() and updateAabbs() is a layer's or Bullet's own.
    static constexpr bool startsAsBullet()
    {
        return detectsAsBullet() && std::is_same_v<decltype(internalStep<Origins>(0)), Step> &&
               appliesGravity() && clearsForces() && predicts() && sweeps();
    }
    static constexpr bool synchronizes() { return std::is_same_v<decltype(motionStates<Origins>(0)), All>; }
    /// Whether all loops over bodies are a layer's, and all between them is a layer's or Bullet's own.
    static constexpr bool stepsAsBullet()
    {
        using WholeStep = int (btDiscreteDynamicsWorld::*)(btScalar, int, btScalar);
        return std::is_same_v<decltype(wholeStep<Origins>(0)), WholeStep> && startsAsBullet() &&
               savesKinematic() && findsIslands() && solves() && integrates() && activates() &&
               synchronizes();
    }
    static constexpr bool testsRays() { return std::is_same_v<decltype(ray<Origins>(0)), Ray>; }
    static constexpr bool activates() { return std::is_same_v<decltype(activate<Origins>(0)), Step>; }
};

/// The objects that the layers use.
struct StepParts
{
    WorldBoxes boxes;
    WorldIslands islands;
    WorldBodies bodies;
    WorldRest rest;
    WorldSpeculation speculation;
    /// Whether the step began with few objects and joints: then the layers leave what they can to Base, without a call of
    /// another library. Callbacks may add many, which only makes the step slower.
    bool areFew = false;

    /// Code of the application runs, or has run.
    void forgetRest()
    {
        rest.forget();
        bodies.forgetAwake();
    }
};

/// Base with its StepParts. Another class that has their functions may keep them elsewhere.
template <class Base>
class WithMembers : public Base
{
public:
    using Base::Base;

protected:
    StepParts& stepParts() { return m_stepParts; }
    const StepParts& stepParts() const { return m_stepParts; }

private:
    StepParts m_stepParts;
};

/// What the layers know of Base and of the class of the object.
template <class Base, template <class> class Holder>
class Asking : public Holder<Base>
{
public:
    using Holder<Base>::Holder;

protected:
    static constexpr bool kDetectsAsBullet = Origins<Base>::detectsAsBullet();
    static constexpr bool kStartsAsBullet = Origins<Base>::startsAsBullet();
    static constexpr bool kStepsAsBullet = Origins<Base>::stepsAsBullet();

    /// Whether no class of the application derives from World and replaces functions of it. False without RTTI.
    bool isWorldItself() const
    {
#ifdef __cpp_rtti
        return WorldRest::isOfClass(*this, &typeid(World<Base, Holder>));
#else
        return false;
#endif
    }

    /// Lists the bodies that the loops have to visit; no code of the application runs before the next one of them.
    void listAwake(btScalar timeStep)
    {
        if (kStepsAsBullet && isWorldItself())
            this->stepParts().bodies.listAwake(this->m_nonStaticRigidBodies, timeStep);
    }

    WorldIslands::Step islandsOf(btContactSolverInfo& info)
    {
        return {*this,
                *this->m_islandManager,
                *this->m_constraintSolver,
                info,
                this->getDebugDrawer(),
                this->m_constraints,
                this->m_sortedConstraints};
    }
};

template <class Next>
class Solving : public Next
{
public:
    using Next::Next;
    void solveConstraints(btContactSolverInfo& info) override
    {
        if (!this->stepParts().islands.solve(this->islandsOf(info)))
            Next::solveConstraints(info);
        if (this->stepParts().areFew)
            return;
        // Islands wake bodies, and solvers and joints may be the application's.
        if (this->stepParts().islands.stats().serial == SerialIslands::AtRest)
            this->stepParts().bodies.resumeAwake();
        else
            this->stepParts().bodies.forgetAwake();
    }
};

template <class Next>
class FindingIslands : public Next
{
public:
    using Next::Next;

protected:
    void calculateSimulationIslands() override
    {
        if (this->stepParts().areFew)
            return Next::calculateSimulationIslands();
        const bool isQuiet =
            Next::kDetectsAsBullet && this->stepParts().rest.isKnown() && this->isWorldItself();
        StepParts& parts = this->stepParts();
        if (!isQuiet)
            parts.rest.forget();
        const WorldRest::Indices* const restless = parts.rest.takeForIslands(*this);
        const bool allSleep =
            Next::kStepsAsBullet && parts.rest.allSleep() &&
            WorldIslands::canKeep(this->islandsOf(this->getSolverInfo()), this->m_predictiveManifolds);
        if (allSleep && parts.rest.keepsIslands(*this))
            return parts.islands.keep();
        if (!parts.islands.find(*this, *this->m_islandManager, this->m_predictiveManifolds,
                                this->m_constraints, restless))
            Next::calculateSimulationIslands();
        else if (allSleep)
            parts.rest.noteIslands(*this);
    }
};

template <class Next>
class ApplyingGravity : public Next
{
public:
    using Next::Next;
    void applyGravity() override
    {
        if (this->stepParts().areFew)
            return Next::applyGravity();
        if (!this->stepParts().bodies.applyGravity(this->m_nonStaticRigidBodies))
            Next::applyGravity();
    }
};

template <class Next>
class ClearingForces : public Next
{
public:
    using Next::Next;
    void clearForces() override
    {
        if (this->stepParts().areFew)
            return Next::clearForces();
        // The end of a step, also of one without an inner one.
        this->stepParts().rest.forget();
        if (!this->stepParts().bodies.clearForces(this->m_nonStaticRigidBodies))
            Next::clearForces();
        this->stepParts().bodies.forgetAwake();
    }
};

template <class Next>
class SavingKinematic : public Next
{
public:
    using Next::Next;

protected:
    void saveKinematicState(btScalar timeStep) override
    {
        if (beginsWithFew())
            return Next::saveKinematicState(timeStep);
        StepParts& parts = this->stepParts();
        const bool hasCallback = this->m_internalPreTickCallback != nullptr;
        parts.bodies.forgetAwake();
        if (!hasCallback)
            this->listAwake(timeStep);
        const bool isQuiet =
            Next::kStartsAsBullet && WorldRest::serves(*this) && !hasCallback && this->isWorldItself();
        const WorldRest::Indices* const restless =
            parts.rest.begin(*this, isQuiet, parts.bodies.sleepersStay());
        parts.bodies.suspendAwake();
        if (parts.bodies.saveKinematicState(this->m_collisionObjects, timeStep, restless))
            parts.forgetRest();
        else
            parts.bodies.resumeAwake();
    }

private:
    bool beginsWithFew()
    {
        StepParts& parts = this->stepParts();
        const bool wereFew = parts.areFew;
        parts.areFew = WorldIslands::areFew(*this, this->m_constraints);
        if (parts.areFew && !wereFew)
        {
            parts.rest.begin(*this, false, false);
            parts.bodies.forgetAwake();
        }
        return parts.areFew;
    }
};

template <class Next>
class Predicting : public Next
{
public:
    using Next::Next;

protected:
    void predictUnconstraintMotion(btScalar timeStep) override
    {
        if (this->stepParts().areFew)
            return Next::predictUnconstraintMotion(timeStep);
        this->listAwake(timeStep);
        if (!this->stepParts().bodies.predictMotion(this->m_nonStaticRigidBodies, timeStep))
            Next::predictUnconstraintMotion(timeStep);
    }
};

template <class Next>
class Sweeping : public Next
{
public:
    using Next::Next;

protected:
    void createPredictiveContacts(btScalar timeStep) override
    {
        BT_PROFILE("createPredictiveContacts");
        // Contacts that are released and sweeps call the application.
        if (this->m_predictiveManifolds.size() > 0)
        {
            this->stepParts().forgetRest();
            this->releasePredictiveContacts();
        }
        const auto sweep = [&](btRigidBody** bodies, int count)
        {
            this->stepParts().forgetRest();
            this->createPredictiveContactsInternal(bodies, count, timeStep);
        };
        this->stepParts().bodies.sweep(this->m_nonStaticRigidBodies, WorldBodies::RangeFunction(sweep));
        if (this->stepParts().speculation.isOn())
        {
            this->stepParts().forgetRest();
            this->stepParts().speculation.find(*this, this->m_nonStaticRigidBodies,
                                               this->m_predictiveManifolds, timeStep);
        }
        // Contacts and solvers may call the application.
        if (!this->stepParts().areFew)
            this->stepParts().bodies.suspendAwake();
    }
};

template <class Next>
class Integrating : public Next
{
public:
    using Next::Next;

protected:
    void integrateTransforms(btScalar timeStep) override
    {
        if (this->stepParts().areFew)
            return Next::integrateTransforms(timeStep);
        const auto integrate = [&](btRigidBody** bodies, int count)
        { this->integrateTransformsInternal(bodies, count, timeStep); };
        // Bullet's function applies the restitution after the loop.
        if (this->m_applySpeculativeContactRestitution ||
            !this->stepParts().bodies.integrate(this->m_nonStaticRigidBodies,
                                                WorldBodies::RangeFunction(integrate)))
            Next::integrateTransforms(timeStep);
        // They follow.
        if (this->m_actions.size() > 0)
            this->stepParts().bodies.forgetAwake();
    }
};

template <class Next>
class Activating : public Next
{
public:
    using Next::Next;

protected:
    void updateActivationState(btScalar timeStep) override
    {
        if (this->stepParts().areFew)
            return Next::updateActivationState(timeStep);
        if (!this->stepParts().bodies.updateActivation(this->m_nonStaticRigidBodies, timeStep))
            Next::updateActivationState(timeStep);
        // One follows, or the other begins the next inner step.
        if (this->m_internalTickCallback != nullptr || this->m_internalPreTickCallback != nullptr)
            this->stepParts().bodies.forgetAwake();
    }
};

template <class Next>
class Synchronizing : public Next
{
public:
    using Next::Next;
    void synchronizeMotionStates() override
    {
        if (this->stepParts().areFew)
            return Next::synchronizeMotionStates();
        if (!this->getSynchronizeAllMotionStates() &&
            this->stepParts().bodies.haveNoMotionState(this->m_nonStaticRigidBodies))
            return;
        this->stepParts().bodies.forgetAwake();
        Next::synchronizeMotionStates();
    }
};

template <class Next>
class TestingRays : public Next
{
public:
    using Next::Next;
    void rayTest(const btVector3& from, const btVector3& to,
                 btCollisionWorld::RayResultCallback& callback) const override
    {
        cullet::rayTest(*this, from, to, callback);
    }
};

template <class Next>
class Detecting : public Next
{
public:
    using Next::Next;
    void performDiscreteCollisionDetection() override
    {
        if (this->stepParts().areFew || !this->isWorldItself())
            return Next::performDiscreteCollisionDetection();
        const WorldRest::Detection detection(this->stepParts().rest, *this);
        Next::performDiscreteCollisionDetection();
    }
};

/// A layer over another one, or only the other one.
template <template <class> class Layer, class Next, bool kTakesOver>
using If = std::conditional_t<kTakesOver, Layer<Next>, Next>;

/// @tparam Holder gives its Base StepParts
template <class Base, template <class> class Holder>
struct Stack
{
    using Asked = Origins<Base>;
    using Solves = If<Solving, Asking<Base, Holder>, Asked::solves()>;
    using FindsIslands = If<FindingIslands, Solves, Asked::findsIslands()>;
    using AppliesGravity = If<ApplyingGravity, FindsIslands, Asked::appliesGravity()>;
    using ClearsForces = If<ClearingForces, AppliesGravity, Asked::clearsForces()>;
    using SavesKinematic = If<SavingKinematic, ClearsForces, Asked::savesKinematic()>;
    using Predicts = If<Predicting, SavesKinematic, Asked::predicts()>;
    using Sweeps = If<Sweeping, Predicts, Asked::sweeps()>;
    using Integrates = If<Integrating, Sweeps, Asked::integrates()>;
    using Activates = If<Activating, Integrates, Asked::activates()>;
    using Synchronizes = If<Synchronizing, Activates, Asked::stepsAsBullet()>;
    using Detects = If<Detecting, Synchronizes, Asked::stepsAsBullet()>;
    using All = If<TestingRays, Detects, Asked::testsRays()>;
};
}  // namespace world_layers
}  // namespace CULLET_PRECISION
}  // namespace cullet
