// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/solver/solver_scene.h"

#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>

namespace cullet::test
{
namespace
{
std::vector<std::size_t> orderOf(std::size_t count, int order)
{
    std::vector<std::size_t> indices(count);
    std::iota(indices.begin(), indices.end(), std::size_t(0));
    if (order == 0)
        return indices;
    Random random(static_cast<std::uint32_t>(order));
    for (std::size_t i = count; i > 1; --i)
        std::swap(indices[i - 1], indices[random.below(static_cast<std::uint32_t>(i))]);
    return indices;
}

template <class Function>
void forEachPoint(const btDiscreteDynamicsWorld& world, const Function& function)
{
    const btDispatcher& dispatcher = *world.getDispatcher();
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
    {
        const btPersistentManifold& manifold =
            *const_cast<btDispatcher&>(dispatcher).getManifoldByIndexInternal(i);
        for (int k = 0; k < manifold.getNumContacts(); ++k)
            function(manifold, manifold.getContactPoint(k));
    }
}

class Fingerprint
{
public:
    void add(btScalar value)
    {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof(value));
        m_hash = (m_hash ^ bits) * 1099511628211ull;
    }
    void add(const btVector3& vector)
    {
        for (int axis = 0; axis < 3; ++axis)
            add(vector[axis]);
    }
    void add(const btRigidBody& body)
    {
        add(body.getWorldTransform().getOrigin());
        for (int row = 0; row < 3; ++row)
            add(body.getWorldTransform().getBasis()[row]);
        add(body.getLinearVelocity());
        add(body.getAngularVelocity());
    }
    std::uint64_t value() const { return m_hash; }

private:
    std::uint64_t m_hash = 14695981039346656037ull;
};

/// 0 for joints without a pivot.
double pivotErrorOf(const btTypedConstraint& joint)
{
    btVector3 inA(0, 0, 0), inB(0, 0, 0);
    if (const auto* ball = dynamic_cast<const btPoint2PointConstraint*>(&joint))
    {
        inA = ball->getPivotInA();
        inB = ball->getPivotInB();
    }
    else if (const auto* hinge = dynamic_cast<const btHingeConstraint*>(&joint))
    {
        inA = hinge->getAFrame().getOrigin();
        inB = hinge->getBFrame().getOrigin();
    }
    else if (const auto* cone = dynamic_cast<const btConeTwistConstraint*>(&joint))
    {
        inA = cone->getAFrame().getOrigin();
        inB = cone->getBFrame().getOrigin();
    }
    else
    {
        return 0;
    }
    const btVector3 onA = joint.getRigidBodyA().getWorldTransform() * inA;
    return double(onA.distance(joint.getRigidBodyB().getWorldTransform() * inB));
}

/// Smallest, mean and largest value of a measure over all orders.
struct Range
{
    double low, mean, high;
};

Range rangeOf(const std::vector<Measures>& runs, std::size_t index)
{
    Range range{runs[0][index].value, 0, runs[0][index].value};
    for (const Measures& run : runs)
    {
        range.low = std::min(range.low, run[index].value);
        range.high = std::max(range.high, run[index].value);
        range.mean += run[index].value / double(runs.size());
    }
    return range;
}

bool keepsRule(const Measure& measure, const Range& stock, const Range& own)
{
    const double tolerance = measure.tolerance;
    // A NaN keeps no rule.
    const auto above = [tolerance](double value, double bound) { return value >= bound - tolerance; };
    const auto below = [tolerance](double value, double bound) { return value <= bound + tolerance; };
    const bool isNotLess = above(own.low, stock.low) && above(own.mean, stock.mean);
    const bool isNotMore = below(own.high, stock.high) && below(own.mean, stock.mean);
    switch (measure.rule)
    {
        case Measure::Rule::NotLess:
            return isNotLess;
        case Measure::Rule::NotMore:
            return isNotMore;
        case Measure::Rule::Equal:
            break;
    }
    return isNotLess && isNotMore && above(own.high, stock.high) && below(own.low, stock.low);
}

std::vector<Measures> runOrders(const Scene& scene, Contender contender, int orders)
{
    std::vector<Measures> runs;
    for (int order = 0; order < orders; ++order)
    {
        SolverScene world(contender, order);
        runs.push_back(scene(world));
    }
    return runs;
}
}  // namespace

std::unique_ptr<btDiscreteDynamicsWorld> makeDiscreteWorld(btDispatcher* dispatcher,
                                                           btBroadphaseInterface* broadphase,
                                                           btConstraintSolver* solver,
                                                           btCollisionConfiguration* configuration)
{
    return std::make_unique<btDiscreteDynamicsWorld>(dispatcher, broadphase, solver, configuration);
}

const char* nameOf(Contender contender)
{
    switch (contender)
    {
        case Contender::Stock:
            return "stock";
        case Contender::Bullet:
            return "Solver(Bullet)";
        case Contender::Soft:
            break;
    }
    return "Solver(Soft)";
}

std::unique_ptr<btSequentialImpulseConstraintSolver> makeSolver(Contender contender, int threads)
{
    if (contender == Contender::Stock)
        return std::make_unique<btSequentialImpulseConstraintSolver>();
    SolverOptions options;
    options.model = contender == Contender::Bullet ? SolverModel::Bullet : SolverModel::Soft;
    options.threads = threads;
    return std::make_unique<Solver>(options);
}

SolverScene::SolverScene(Contender contender, int order)
    : SolverScene(makeSolver(contender, 1), order, makeDiscreteWorld)
{
}

SolverScene::SolverScene(
    std::unique_ptr<btSequentialImpulseConstraintSolver> solver, int order,
    const std::function<std::unique_ptr<btDiscreteDynamicsWorld>(
        btDispatcher*, btBroadphaseInterface*, btConstraintSolver*, btCollisionConfiguration*)>& makeWorld)
    : m_solver(std::move(solver)), m_order(order)
{
    m_world = makeWorld(&m_dispatcher, &m_broadphase, m_solver.get(), &m_configuration);
    m_world->setGravity(vec(0, -kGravity, 0));
}

SolverScene::~SolverScene()
{
    for (int i = m_world->getNumConstraints() - 1; i >= 0; --i)
        m_world->removeConstraint(m_world->getConstraint(i));
    for (auto& body : m_bodies)
        m_world->removeRigidBody(body.get());
}

btBoxShape& SolverScene::box(double halfX, double halfY, double halfZ)
{
    return shape<btBoxShape>(vec(halfX, halfY, halfZ));
}

btRigidBody& SolverScene::add(btCollisionShape& shape, double mass, const btTransform& at)
{
    btVector3 inertia(0, 0, 0);
    if (mass > 0)
        shape.calculateLocalInertia(btScalar(mass), inertia);
    m_bodies.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, &shape, inertia));
    btRigidBody& body = *m_bodies.back();
    body.setWorldTransform(at);
    body.setInterpolationWorldTransform(at);
    return body;
}

btRigidBody& SolverScene::add(btCollisionShape& shape, double mass, const btVector3& at)
{
    return add(shape, mass, btTransform(btQuaternion::getIdentity(), at));
}

btRigidBody& SolverScene::addKinematic(btCollisionShape& shape, const btVector3& at)
{
    btRigidBody& body = add(shape, 0, at);
    body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    body.setActivationState(DISABLE_DEACTIVATION);
    return body;
}

btRigidBody& SolverScene::addFloor()
{
    return add(box(100, 1, 100), 0, vec(0, -1, 0));
}

void SolverScene::enter()
{
    if (m_hasEntered)
        return;
    m_hasEntered = true;
    for (const std::size_t index : orderOf(m_bodies.size(), m_order))
        m_world->addRigidBody(m_bodies[index].get());
    for (const std::size_t index : orderOf(m_joints.size(), m_order))
        m_world->addConstraint(m_joints[index].get(), true);
}

void SolverScene::step(int count)
{
    enter();
    for (int i = 0; i < count; ++i)
    {
        if (m_script)
            m_script();
        m_world->stepSimulation(m_dt, 0, m_dt);
    }
}

double SolverScene::kineticEnergy() const
{
    double sum = 0;
    for (const auto& body : m_bodies)
    {
        if (body->getInvMass() == 0)
            continue;
        const btVector3 spin = body->getAngularVelocity() * body->getWorldTransform().getBasis();
        const btVector3 inertia = body->getLocalInertia();
        sum += double(body->getLinearVelocity().length2() / body->getInvMass() +
                      spin.dot(btVector3(inertia * spin))) /
               2;
    }
    return sum;
}

double SolverScene::totalEnergy() const
{
    double sum = kineticEnergy();
    for (const auto& body : m_bodies)
    {
        if (body->getInvMass() > 0)
            sum -= double(body->getGravity().dot(body->getWorldTransform().getOrigin()) / body->getInvMass());
    }
    return sum;
}

double SolverScene::meanDepth() const
{
    double sum = 0;
    int points = 0;
    forEachPoint(*m_world,
                 [&](const btPersistentManifold&, const btManifoldPoint& point)
                 {
                     sum += std::max(0.0, -double(point.getDistance()));
                     ++points;
                 });
    return points > 0 ? sum / points : 0;
}

double SolverScene::maxDepth() const
{
    double depth = 0;
    forEachPoint(*m_world, [&](const btPersistentManifold&, const btManifoldPoint& point)
                 { depth = std::max(depth, -double(point.getDistance())); });
    return depth;
}

double SolverScene::normalImpulse(const btCollisionObject& body) const
{
    double sum = 0;
    forEachPoint(*m_world,
                 [&](const btPersistentManifold& manifold, const btManifoldPoint& point)
                 {
                     if (manifold.getBody0() == &body || manifold.getBody1() == &body)
                         sum += double(point.getAppliedImpulse());
                 });
    return sum;
}

btVector3 SolverScene::frictionImpulse(const btCollisionObject& body) const
{
    btVector3 sum(0, 0, 0);
    forEachPoint(*m_world,
                 [&](const btPersistentManifold& manifold, const btManifoldPoint& point)
                 {
                     if (manifold.getBody0() != &body && manifold.getBody1() != &body)
                         return;
                     sum += point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
                            point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2;
                 });
    return sum;
}

int SolverScene::awakeCount() const
{
    return int(std::count_if(m_bodies.begin(), m_bodies.end(),
                             [](const auto& body) { return body->getInvMass() > 0 && body->isActive(); }));
}

double SolverScene::pivotError() const
{
    double most = 0;
    for (const auto& joint : m_joints)
    {
        if (joint->isEnabled())
            most = std::max(most, pivotErrorOf(*joint));
    }
    return most;
}

std::uint64_t SolverScene::hash() const
{
    Fingerprint hash;
    for (const auto& body : m_bodies)
        hash.add(*body);
    for (const auto& joint : m_joints)
        hash.add(joint->internalGetAppliedImpulse());
    forEachPoint(*m_world,
                 [&](const btPersistentManifold&, const btManifoldPoint& point)
                 {
                     hash.add(point.m_appliedImpulse);
                     hash.add(point.m_appliedImpulseLateral1);
                     hash.add(point.m_appliedImpulseLateral2);
                 });
    return hash.value();
}

std::uint64_t hashOf(const btRigidBody& body)
{
    Fingerprint hash;
    hash.add(body);
    return hash.value();
}

std::uint64_t hashOf(btScalar value)
{
    Fingerprint hash;
    hash.add(value);
    return hash.value();
}

btTransform at(double x, double y, double z)
{
    return btTransform(btQuaternion::getIdentity(), vec(x, y, z));
}

const char* nameOf(JointKind kind)
{
    static constexpr const char* kNames[] = {"ball", "hinge", "slider", "generic", "fixed", "cone", "spring"};
    return kNames[static_cast<int>(kind)];
}

btTypedConstraint& SolverScene::joinOfKind(JointKind kind, btRigidBody& a, btRigidBody& b)
{
    const btTransform &fromA = a.getWorldTransform(), &fromB = b.getWorldTransform();
    const btTransform between(fromA.getBasis(), (fromA.getOrigin() + fromB.getOrigin()) / 2);
    const btTransform inA = fromA.inverse() * between, inB = fromB.inverse() * between;
    switch (kind)
    {
        case JointKind::Ball:
            return join<btPoint2PointConstraint>(a, b, inA.getOrigin(), inB.getOrigin());
        case JointKind::Hinge:
        {
            auto& hinge = join<btHingeConstraint>(a, b, inA, inB);
            hinge.setLimit(btScalar(-0.6), btScalar(0.8));
            return hinge;
        }
        case JointKind::Slider:
        {
            auto& slider = join<btSliderConstraint>(a, b, inA, inB, true);
            slider.setLowerLinLimit(btScalar(-0.1));
            slider.setUpperLinLimit(btScalar(0.2));
            return slider;
        }
        case JointKind::Generic:
            return join<btGeneric6DofConstraint>(a, b, inA, inB, true);
        case JointKind::Fixed:
            return join<btFixedConstraint>(a, b, inA, inB);
        case JointKind::Cone:
        {
            auto& cone = join<btConeTwistConstraint>(a, b, inA, inB);
            cone.setLimit(btScalar(0.6), btScalar(0.6), btScalar(0.3));
            return cone;
        }
        default:
        {
            auto& spring = join<btGeneric6DofSpring2Constraint>(a, b, inA, inB);
            spring.enableSpring(0, true);
            spring.setStiffness(0, 100);
            spring.setDamping(0, 2);
            return spring;
        }
    }
}

btQuaternion randomTurn(Random& random)
{
    const btVector3 axis = vec(random.point(-1, 1));
    return btQuaternion(axis.x(), axis.y(), axis.z(), btScalar(random.between(0.1f, 1))).normalized();
}

double heightOfBody(const btRigidBody& body)
{
    return double(body.getWorldTransform().getOrigin().y());
}

Measure equal(const char* name, double value, double tolerance)
{
    return {name, value, Measure::Rule::Equal, tolerance};
}

Measure notMore(const char* name, double value, double tolerance)
{
    return {name, value, Measure::Rule::NotMore, tolerance};
}

Measure notLess(const char* name, double value, double tolerance)
{
    return {name, value, Measure::Rule::NotLess, tolerance};
}

void expectAsStock(const Scene& scene, int few, std::initializer_list<Contender> contenders)
{
    const int orders = ordersOf(few);
    const std::vector<Measures> stock = runOrders(scene, Contender::Stock, orders);
    for (const Contender contender : contenders)
    {
        const std::vector<Measures> own = runOrders(scene, contender, orders);
        ASSERT_EQ(own[0].size(), stock[0].size());
        for (std::size_t i = 0; i < stock[0].size(); ++i)
        {
            const Range expected = rangeOf(stock, i), found = rangeOf(own, i);
            EXPECT_TRUE(keepsRule(stock[0][i], expected, found))
                << stock[0][i].name << ", least, mean, most of " << orders << " orders: " << nameOf(contender)
                << " " << found.low << ", " << found.mean << ", " << found.high << "; stock " << expected.low
                << ", " << expected.mean << ", " << expected.high;
        }
    }
}
}  // namespace cullet::test
