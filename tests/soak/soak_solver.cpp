// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/solver.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/soak/soak_checks.h"
#include "cullet/tests/soak/soak_world.h"
#include "cullet/tests/support/number_hash.h"
#include "cullet/tests/support/random.h"

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kMostBodies = 200;
constexpr int kChurnSteps = 120, kRestSteps = 240, kCreepSteps = 60;
constexpr double kPit = 5;  ///< half the width

struct JointedBody
{
    std::unique_ptr<btCollisionShape> shape;
    std::unique_ptr<btRigidBody> body;
    int since = 0;  ///< the step in which it was made
};

/// Bounds of one rest. Twice the most that Bullet's solver reaches in 883 rests of seed 41, .10 m, .31 J and .7 mm, and in 98 of
/// seed 20261127, 38 mm: rarely a joined body still swings.
constexpr RestErrors kMost = {0.2, 0.6, 0.005, 0.08};
/// Bounds of the mean of at least so many rests, by model: about twice what they are in worlds that fall once, and four times what
/// they are in worlds that live on. The worst rest alone does not reach them.
constexpr std::uint64_t kManyRests = 20;
constexpr RestErrors kMostMean[] = {{0.03, 0.05, 0.001, 0.006}, {0.015, 0.05, 0.001, 0.004}};
constexpr const char* kErrorNames[] = {"bodies at rest creep by", "energy of a body at rest is",
                                       "overlap at rest is", "joints at rest are open by"};
constexpr double kMostSpeed = 100;

bool isFinite(const btVector3& v)
{
    return std::isfinite(double(v.x())) && std::isfinite(double(v.y())) && std::isfinite(double(v.z()));
}

SolverOptions solverOptions(SolverModel model, std::uint32_t threads)
{
    SolverOptions options;
    options.model = model;
    options.threads = static_cast<int>(threads);
    return options;
}

/// Bodies and joints that fall into a pit, are changed while they do, and come to rest; again and again.
class JointChurn
{
public:
    JointChurn(std::uint32_t seed, SolverModel model, std::uint32_t target,
               const SoakCircumstances& circumstances, SoakCounts& counts)
        : m_random(seed),
          m_chooser(circumstances.seed ^ seed),
          m_target(target),
          m_model(model),
          m_counts(counts),
          m_mistake(circumstances.mistake),
          m_dispatcher(&m_configuration),
          m_solver(solverOptions(model, 1 + m_chooser.below(3)))
    {
        if (m_chooser.chance(0.5f))
            m_world = std::make_unique<World<btDiscreteDynamicsWorld>>(&m_dispatcher, &m_broadphase,
                                                                       &m_solver, &m_configuration);
        else
            m_world = std::make_unique<btDiscreteDynamicsWorld>(&m_dispatcher, &m_broadphase, &m_solver,
                                                                &m_configuration);
        addPit();
    }
    ~JointChurn()
    {
        clear();
        for (const JointedBody& side : m_pit)
            m_world->removeRigidBody(side.body.get());
    }
    JointChurn(const JointChurn&) = delete;
    JointChurn& operator=(const JointChurn&) = delete;

    void runRound()
    {
        stir();
        for (int i = 0; i < kChurnSteps; ++i)
        {
            change();
            step();
        }
        stopMotors();
        for (int i = 0; i < kRestSteps - kCreepSteps; ++i)
            step();
        checkRest();
    }

    /// Whether the bodies have lived for long enough.
    bool areOld() { return m_random.chance(0.25f); }

    void clear()
    {
        while (!m_joints.empty())
            removeJoint(m_joints.size() - 1);
        while (!m_bodies.empty())
            remove(m_bodies.size() - 1);
    }

    std::uint64_t hash() const { return m_hash.value(); }

private:
    void addPit()
    {
        const auto addSide = [this](const btVector3& half, const btVector3& at)
        {
            JointedBody side;
            side.shape = std::make_unique<btBoxShape>(half);
            side.body = std::make_unique<btRigidBody>(btScalar(0), nullptr, side.shape.get());
            side.body->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
            m_world->addRigidBody(side.body.get());
            m_pit.push_back(std::move(side));
        };
        addSide(btVector3(20, 2, 20), btVector3(0, -2, 0));
        for (const double side : {-1.0, 1.0})
        {
            addSide(btVector3(2, 20, 20), btVector3(btScalar(side * (kPit + 2)), 20, 0));
            addSide(btVector3(20, 20, 2), btVector3(0, 20, btScalar(side * (kPit + 2))));
        }
    }

    std::unique_ptr<btCollisionShape> drawShape()
    {
        const float size = m_random.between(0.2f, 0.5f);
        switch (m_random.below(4))
        {
            case 0:
                return std::make_unique<btSphereShape>(btScalar(size));
            case 1:
                return std::make_unique<btCapsuleShape>(btScalar(0.5f * size), btScalar(size));
            case 2:
                return std::make_unique<btCylinderShape>(toVector(m_random.point(0.5f, 1)) * btScalar(size));
            default:
                return std::make_unique<btBoxShape>(toVector(m_random.point(0.5f, 1)) * btScalar(size));
        }
    }

    btRigidBody& add(const btVector3& at)
    {
        JointedBody made;
        made.shape = drawShape();
        const btScalar mass(m_random.between(0.5f, 4));
        btVector3 inertia(0, 0, 0);
        made.shape->calculateLocalInertia(mass, inertia);
        made.body = std::make_unique<btRigidBody>(mass, nullptr, made.shape.get(), inertia);
        const btVector3 axis = toVector(m_random.point(-1, 1));
        const btQuaternion turn(axis.x(), axis.y(), axis.z(), btScalar(m_random.between(0.1f, 1)));
        made.body->setWorldTransform(btTransform(turn.normalized(), at));
        made.body->setInterpolationWorldTransform(made.body->getWorldTransform());
        made.body->setFriction(btScalar(m_random.between(0.2f, 1)));
        if (m_random.chance(0.3f))
            made.body->setRestitution(btScalar(m_random.between(0, 0.6f)));
        // What rolls would do so for ever.
        made.body->setRollingFriction(btScalar(0.02));
        made.body->setSpinningFriction(btScalar(0.02));
        m_world->addRigidBody(made.body.get());
        made.since = m_step;
        m_bodies.push_back(std::move(made));
        return *m_bodies.back().body;
    }

    void remove(std::size_t index)
    {
        btRigidBody& body = *m_bodies[index].body;
        for (std::size_t i = m_joints.size(); i-- > 0;)
            if (&m_joints[i]->getRigidBodyA() == &body || &m_joints[i]->getRigidBodyB() == &body)
                removeJoint(i);
        m_world->removeRigidBody(&body);
        std::swap(m_bodies[index], m_bodies.back());
        m_bodies.pop_back();
    }

    void removeJoint(std::size_t index)
    {
        m_world->removeConstraint(m_joints[index].get());
        std::swap(m_joints[index], m_joints.back());
        m_joints.pop_back();
    }

    /// A joint whose frames coincide between two bodies.
    std::unique_ptr<btTypedConstraint> drawJoint(btRigidBody& a, btRigidBody& b)
    {
        const btTransform &fromA = a.getWorldTransform(), &fromB = b.getWorldTransform();
        const btTransform between(fromA.getBasis(), (fromA.getOrigin() + fromB.getOrigin()) / 2);
        const btTransform inA = fromA.inverse() * between, inB = fromB.inverse() * between;
        switch (m_random.below(7))
        {
            case 0:
                return std::make_unique<btPoint2PointConstraint>(a, b, inA.getOrigin(), inB.getOrigin());
            case 1:
            {
                auto hinge = std::make_unique<btHingeConstraint>(a, b, inA, inB);
                hinge->setLimit(btScalar(-0.6), btScalar(0.8));
                hinge->enableAngularMotor(m_random.chance(0.3f), 2, btScalar(0.2));
                return hinge;
            }
            case 2:
            {
                auto cone = std::make_unique<btConeTwistConstraint>(a, b, inA, inB);
                cone->setLimit(btScalar(0.6), btScalar(0.6), btScalar(0.3));
                return cone;
            }
            case 3:
            {
                auto slider = std::make_unique<btSliderConstraint>(a, b, inA, inB, true);
                slider->setLowerLinLimit(btScalar(-0.1));
                slider->setUpperLinLimit(btScalar(0.2));
                return slider;
            }
            case 4:
                return std::make_unique<btGeneric6DofConstraint>(a, b, inA, inB, true);
            case 5:
                return std::make_unique<btFixedConstraint>(a, b, inA, inB);
            default:
            {
                auto spring = std::make_unique<btGeneric6DofSpring2Constraint>(a, b, inA, inB);
                spring->enableSpring(0, true);
                spring->setStiffness(0, 100);
                spring->setDamping(0, 2);
                return spring;
            }
        }
    }

    void join(btRigidBody& a, btRigidBody& b)
    {
        std::unique_ptr<btTypedConstraint> joint = drawJoint(a, b);
        if (m_random.chance(0.25f))
            joint->setBreakingImpulseThreshold(btScalar(m_random.between(0.5f, 4)));
        if (m_random.chance(0.1f))
            joint->setOverrideNumSolverIterations(20);
        m_world->addConstraint(joint.get(), true);
        m_joints.push_back(std::move(joint));
        ++m_counts.joints;
    }

    void change()
    {
        for (std::size_t i = m_joints.size(); i-- > 0;)
        {
            if (m_joints[i]->isEnabled())
                continue;
            ++m_counts.brokenJoints;
            removeJoint(i);
        }
        if (m_bodies.size() < m_target)
            pourChain();
        switch (m_random.below(30))
        {
            case 0:
                for (std::uint32_t i = m_random.below(8); i > 0 && !m_bodies.empty(); --i)
                    remove(m_random.below(static_cast<std::uint32_t>(m_bodies.size())));
                break;
            case 1:
                for (const JointedBody& body : m_bodies)
                {
                    body.body->activate(true);
                    body.body->applyCentralImpulse(toVector(m_random.point(-2, 2)));
                }
                break;
            default:
                break;
        }
    }

    /// Throws all bodies that have rested, and lifts a few that no joint holds out of the heap.
    void stir()
    {
        int lifted = 0;
        for (const JointedBody& made : m_bodies)
        {
            btRigidBody& body = *made.body;
            body.activate(true);
            const btVector3 blow = toVector(m_random.point(-1, 1));
            if (lifted < 5 && body.getNumConstraintRefs() == 0 && m_random.chance(0.05f))
            {
                ++lifted;
                const btVector3 place(3 * blow.x(), btScalar(8 + lifted), 3 * blow.z());
                body.setCenterOfMassTransform(btTransform(body.getOrientation(), place));
                body.clearForces();
                body.setLinearVelocity(btVector3(0, 0, 0));
            }
            else
            {
                body.setLinearVelocity(body.getLinearVelocity() + blow + btVector3(0, 4, 0));
            }
        }
    }

    /// One to five bodies above the others, joined to each other.
    void pourChain()
    {
        const float x = m_random.between(-3, 3), z = m_random.between(-3, 3);
        btRigidBody* before = nullptr;
        for (std::uint32_t i = 1 + m_random.below(5); i > 0 && m_bodies.size() < m_target; --i)
        {
            btRigidBody& body = add(btVector3(btScalar(x), btScalar(8 + i), btScalar(z)));
            if (before != nullptr && m_random.chance(0.7f))
                join(*before, body);
            before = &body;
        }
    }

    void stopMotors()
    {
        for (const auto& joint : m_joints)
            if (joint->getConstraintType() == HINGE_CONSTRAINT_TYPE)
                static_cast<btHingeConstraint&>(*joint).enableMotor(false);
    }

    void step()
    {
        m_world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        ++m_step;
        ++m_counts.steps;
        ++m_counts.solverSteps;
        for (const JointedBody& body : m_bodies)
        {
            checkBody(*body.body);
            m_hash.addVector(body.body->getWorldTransform().getOrigin());
        }
        for (const auto& joint : m_joints)
            if (!std::isfinite(double(joint->internalGetAppliedImpulse())))
                throw SoakFault(m_step, "a joint whose impulse is no number");
    }

    static std::string nameOf(const btRigidBody& body)
    {
        btVector3 low, high;
        body.getCollisionShape()->getAabb(btTransform::getIdentity(), low, high);
        const btVector3 size = high - low, place = body.getWorldTransform().getOrigin(),
                        speed = body.getLinearVelocity();
        char text[200];
        std::snprintf(text, sizeof(text),
                      "%s of %.3f x %.3f x %.3f m, %d joints, at %.2f %.2f %.2f, %.1f m/s",
                      body.getCollisionShape()->getName(), double(size.x()), double(size.y()),
                      double(size.z()), body.getNumConstraintRefs(), double(place.x()), double(place.y()),
                      double(place.z()), double(speed.length()));
        return text;
    }

    void checkBody(const btRigidBody& body) const
    {
        const btVector3 place = body.getWorldTransform().getOrigin(), speed = body.getLinearVelocity();
        if (!isFinite(place) || !isFinite(speed) || !isFinite(body.getAngularVelocity()) ||
            !isFinite(body.getWorldTransform().getBasis()[0]))
            throw SoakFault(m_step, "a body whose place or velocity is no number");
        if (double(speed.length()) > kMostSpeed)
            throw SoakFault(m_step, "a body that moves with " + std::to_string(speed.length()) + " m/s");
        if (double(place.y()) < -1 || std::fabs(double(place.x())) > kPit + 1 ||
            std::fabs(double(place.z())) > kPit + 1)
            throw SoakFault(m_step, "a body that has left the pit: " + nameOf(body));
    }

    /// How bodies and joints are after their rest. The bounds are the same in the first round and in the last.
    void checkRest()
    {
        std::vector<btVector3> places;
        for (const JointedBody& body : m_bodies)
            places.push_back(body.body->getWorldTransform().getOrigin());
        for (int i = 0; i < kCreepSteps; ++i)
        {
            move(faultyWay() / kCreepSteps);
            step();
        }
        RestErrors rest{};
        for (std::size_t i = 0; i < m_bodies.size(); ++i)
        {
            const btRigidBody& body = *m_bodies[i].body;
            rest[Creep] += double(body.getWorldTransform().getOrigin().distance(places[i]));
            rest[Energy] += 0.5 * double(body.getLinearVelocity().length2() * body.getMass());
            m_counts.longestLife = std::max(m_counts.longestLife, std::uint64_t(m_step - m_bodies[i].since));
        }
        const double count = double(std::max<std::size_t>(m_bodies.size(), 1));
        rest[Creep] /= count;
        rest[Energy] /= count;
        rest[Depth] = meanDepth();
        rest[Pivot] = meanPivotError();
        for (std::size_t i = 0; i < rest.size(); ++i)
        {
            if (!(rest[i] <= kMost[i]))
                throw SoakFault(m_step, std::string(kErrorNames[i]) + " " + std::to_string(rest[i]));
        }
        m_counts.rests[int(m_model)].add(rest);
    }

    /// How far a mistake moves bodies at rest.
    double faultyWay() const
    {
        if (m_mistake == SoakMistake::Creep)
            return 1.5 * kMost[Creep];
        return m_mistake == SoakMistake::Drift ? 1.5 * kMostMean[int(m_model)][Creep] : 0;
    }

    void move(double way)
    {
        for (const JointedBody& body : m_bodies)
            if (way > 0)
                body.body->translate(btVector3(btScalar(way), 0, 0));
    }

    double meanDepth() const
    {
        double sum = 0;
        int points = 0;
        for (int i = 0; i < m_world->getDispatcher()->getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *m_world->getDispatcher()->getManifoldByIndexInternal(i);
            for (int k = 0; k < manifold.getNumContacts(); ++k)
            {
                const btManifoldPoint& point = manifold.getContactPoint(k);
                if (!(point.getAppliedImpulse() >= 0) || !std::isfinite(double(point.getAppliedImpulse())))
                    throw SoakFault(m_step, "a contact that pulls, or whose impulse is no number");
                sum += std::max(0.0, -double(point.getDistance()));
                ++points;
            }
        }
        return points > 0 ? sum / points : 0;
    }

    double meanPivotError() const
    {
        double sum = 0;
        int pivots = 0;
        for (const auto& joint : m_joints)
        {
            if (joint->getConstraintType() != POINT2POINT_CONSTRAINT_TYPE || !joint->isEnabled())
                continue;
            const auto& pivot = static_cast<const btPoint2PointConstraint&>(*joint);
            const btVector3 onA = pivot.getRigidBodyA().getWorldTransform() * pivot.getPivotInA();
            sum += double(onA.distance(pivot.getRigidBodyB().getWorldTransform() * pivot.getPivotInB()));
            ++pivots;
        }
        return pivots > 0 ? sum / pivots : 0;
    }

    Random m_random;   ///< of the world
    Random m_chooser;  ///< of what changes nothing
    std::uint32_t m_target;
    SolverModel m_model;
    SoakCounts& m_counts;
    SoakMistake m_mistake;
    NumberHash m_hash;
    int m_step = 0;
    btDefaultCollisionConfiguration m_configuration;
    Dispatcher m_dispatcher;
    Broadphase m_broadphase;
    Solver m_solver;
    std::unique_ptr<btDiscreteDynamicsWorld> m_world;
    std::vector<JointedBody> m_pit, m_bodies;
    std::vector<std::unique_ptr<btTypedConstraint>> m_joints;
};
}  // namespace

std::uint64_t soakSolver(std::uint32_t seed, const SoakCircumstances& circumstances, SoakCounts& counts)
{
    const SolverModel model = seed / 8 % 2 == 0 ? SolverModel::Bullet : SolverModel::Soft;
    JointChurn churn(seed, model, 20 + seed / 16 % (kMostBodies - 19), circumstances, counts);
    churn.runRound();
    ++counts.worlds;
    return churn.hash();
}

void soakOneSolver(SolverModel model, std::uint32_t seed, const SoakCircumstances& circumstances,
                   SoakCounts& counts, const std::function<bool()>& goesOn)
{
    JointChurn churn(seed, model, kMostBodies, circumstances, counts);
    do
    {
        do
            churn.runRound();
        while (!churn.areOld());
        churn.clear();
    } while (goesOn());
    ++counts.worlds;
}

std::string faultOfRests(SolverModel model, const SoakRests& rests)
{
    for (std::size_t i = 0; i < kMost.size() && rests.count >= kManyRests; ++i)
    {
        if (!(rests.mean(i) <= kMostMean[int(model)][i]))
            return std::string("in the mean of ") + std::to_string(rests.count) + " rests " + kErrorNames[i] +
                   " " + std::to_string(rests.mean(i));
    }
    return "";
}
}  // namespace cullet::test
