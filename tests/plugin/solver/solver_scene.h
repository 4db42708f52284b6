// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

namespace cullet::test
{
class Random;

inline constexpr double kGravity = 10;  ///< of each scene, downwards

/// A solver whose results are compared.
enum class Contender
{
    Stock,   ///< btSequentialImpulseConstraintSolver
    Bullet,  ///< Solver, SolverModel::Bullet
    Soft     ///< Solver, SolverModel::Soft
};
const char* nameOf(Contender contender);
/// @param threads of Solver
std::unique_ptr<btSequentialImpulseConstraintSolver> makeSolver(Contender contender, int threads = 0);

/// Bullet's own world.
std::unique_ptr<btDiscreteDynamicsWorld> makeDiscreteWorld(btDispatcher* dispatcher,
                                                           btBroadphaseInterface* broadphase,
                                                           btConstraintSolver* solver,
                                                           btCollisionConfiguration* configuration);

/// Kinds of joints that joinOfKind() makes.
enum class JointKind
{
    Ball,
    Hinge,
    Slider,
    Generic,
    Fixed,
    Cone,
    Spring
};
inline constexpr JointKind kJointKinds[] = {JointKind::Ball,    JointKind::Hinge, JointKind::Slider,
                                            JointKind::Generic, JointKind::Fixed, JointKind::Cone,
                                            JointKind::Spring};
const char* nameOf(JointKind kind);

/// As btPoint2PointConstraint, but of the application.
class OwnJoint : public btPoint2PointConstraint
{
public:
    using btPoint2PointConstraint::btPoint2PointConstraint;
    void getInfo1(btConstraintInfo1* info) override { btPoint2PointConstraint::getInfo1(info); }
};

/// Bullet's discrete world with its own collision detection and one of the solvers. Bodies and joints enter the world at the
/// first step, in an order that a number names.
class SolverScene
{
public:
    /// @param order 0: as they were made; otherwise the seed of a shuffle
    explicit SolverScene(Contender contender, int order = 0);
    /// @param world made by makeWorld(dispatcher, broadphase, solver, configuration)
    SolverScene(std::unique_ptr<btSequentialImpulseConstraintSolver> solver, int order,
                const std::function<std::unique_ptr<btDiscreteDynamicsWorld>(
                    btDispatcher*, btBroadphaseInterface*, btConstraintSolver*, btCollisionConfiguration*)>&
                    makeWorld);
    ~SolverScene();
    SolverScene(const SolverScene&) = delete;
    SolverScene& operator=(const SolverScene&) = delete;

    template <class Shape, class... Args>
    Shape& shape(Args&&... args)
    {
        return keep(std::make_unique<Shape>(std::forward<Args>(args)...));
    }
    btBoxShape& box(double halfX, double halfY, double halfZ);
    /// Mass 0: static.
    btRigidBody& add(btCollisionShape& shape, double mass, const btTransform& at);
    btRigidBody& add(btCollisionShape& shape, double mass, const btVector3& at);
    btRigidBody& addKinematic(btCollisionShape& shape, const btVector3& at);
    /// A box whose top is y = 0.
    btRigidBody& addFloor();
    template <class Joint, class... Args>
    Joint& join(Args&&... args)
    {
        m_joints.push_back(std::make_unique<Joint>(std::forward<Args>(args)...));
        return static_cast<Joint&>(*m_joints.back());
    }
    /// Joins two bodies half of the way between their centres, by limits as ragdolls have them.
    btTypedConstraint& joinOfKind(JointKind kind, btRigidBody& a, btRigidBody& b);
    /// Takes ownership of what must live as long as the world.
    template <class T>
    T& keep(std::unique_ptr<T> thing)
    {
        T& reference = *thing;
        m_kept.push_back(std::shared_ptr<T>(std::move(thing)));
        return reference;
    }

    /// Adds all bodies and joints to the world; step() does so.
    void enter();
    void step(int count = 1);
    void setStepsPerSecond(int steps) { m_dt = btScalar(1) / btScalar(steps); }
    double dt() const { return double(m_dt); }
    btContactSolverInfo& info() { return m_world->getSolverInfo(); }
    btDiscreteDynamicsWorld& world() { return *m_world; }
    btSequentialImpulseConstraintSolver& solver() { return *m_solver; }
    /// Called before each step.
    void setScript(std::function<void()> script) { m_script = std::move(script); }

    /// Of all moving bodies, joules; height: over y = 0.
    double kineticEnergy() const;
    double totalEnergy() const;
    /// Mean depth of the contact points, metres; those that do not overlap count as 0.
    double meanDepth() const;
    double maxDepth() const;
    /// Sum of normal impulses of the contacts of a body.
    double normalImpulse(const btCollisionObject& body) const;
    /// Sum of both lateral impulses, as vector.
    btVector3 frictionImpulse(const btCollisionObject& body) const;
    int awakeCount() const;
    /// Largest distance between the places of a joint's pivot in its two bodies.
    double pivotError() const;
    const std::vector<std::unique_ptr<btRigidBody>>& bodies() const { return m_bodies; }
    const std::vector<std::unique_ptr<btTypedConstraint>>& joints() const { return m_joints; }
    /// Hash of places and velocities of all bodies and of impulses of joints and contacts.
    std::uint64_t hash() const;

private:
    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher{&m_configuration};
    btDbvtBroadphase m_broadphase;
    std::unique_ptr<btSequentialImpulseConstraintSolver> m_solver;
    std::unique_ptr<btDiscreteDynamicsWorld> m_world;
    std::vector<std::shared_ptr<void>> m_kept;
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
    std::vector<std::unique_ptr<btTypedConstraint>> m_joints;
    std::function<void()> m_script;
    int m_order;
    bool m_hasEntered = false;
    btScalar m_dt = btScalar(1) / 60;
};

/// Of place and velocities, bit by bit.
std::uint64_t hashOf(const btRigidBody& body);
std::uint64_t hashOf(btScalar value);

btTransform at(double x, double y, double z);
double heightOfBody(const btRigidBody& body);
btQuaternion randomTurn(Random& random);

/// What a scene measures, and how it is compared with stock Bullet's value.
struct Measure
{
    enum class Rule
    {
        Equal,
        NotMore,
        NotLess
    };
    const char* name;
    double value;
    Rule rule;
    double tolerance;  ///< of the mean and of both extremes over all orders
};
Measure equal(const char* name, double value, double tolerance);
Measure notMore(const char* name, double value, double tolerance);
Measure notLess(const char* name, double value, double tolerance);

using Measures = std::vector<Measure>;
using Scene = std::function<Measures(SolverScene&)>;

/// In how many orders a scene runs: what it asks for (few_orders.cpp), or ten (ten_orders.cpp), by which of these files the
/// program contains.
int ordersOf(int few);

/// Runs a scene with each solver in ordersOf(orders) orders and compares their measures with stock Bullet's.
void expectAsStock(const Scene& scene, int orders = 1,
                   std::initializer_list<Contender> contenders = {Contender::Bullet, Contender::Soft});
}  // namespace cullet::test
