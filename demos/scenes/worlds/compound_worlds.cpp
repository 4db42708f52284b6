// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/compound_worlds.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"
#include "cullet/demos/scenes/bodies/parallel_world.h"

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
const WorldKind& multiBodyWorld()
{
    using Solver = btMultiBodyConstraintSolver;
    static const WorldKind kind = {
        [] { return std::make_unique<btDefaultCollisionConfiguration>(); }, makeSolver<Solver>,
        [](btDispatcher& dispatcher, btBroadphaseInterface& broadphase, btConstraintSolver& solver,
           btCollisionConfiguration& configuration) -> std::unique_ptr<btDiscreteDynamicsWorld>
        {
            return std::make_unique<btMultiBodyDynamicsWorld>(&dispatcher, &broadphase,
                                                              static_cast<Solver*>(&solver), &configuration);
        },
        makeParallelWorld<btMultiBodyDynamicsWorld, Solver>};
    return kind;
}

/// Around the x axis; the outer rings are smaller.
HullPoints makeWheel()
{
    return makeRings("wheel", {{-0.12f, 0.26f}, {-0.05f, 0.3f}, {0.05f, 0.3f}, {0.12f, 0.26f}}, 0);
}

class RobotsWorld : public WorldScene
{
public:
    RobotsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene, multiBodyWorld()),
          m_random(scene.seed),
          m_chassis(makeShape<btBoxShape>(btVector3(btScalar(0.4), btScalar(0.15), btScalar(0.7)))),
          m_wheel(keep(makeHullShape(makeWheel())))
    {
        const auto perSide = static_cast<std::uint32_t>(std::ceil(std::sqrt(scene.bodies)));
        addWalledFloor(btScalar(2 * perSide + 4), 2);
        const btScalar centre = btScalar(perSide - 1) / 2;
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
            addRobot(btVector3(4 * (btScalar(i % perSide) - centre), btScalar(0.6),
                               4 * (btScalar(i / perSide) - centre)));
    }

    ~RobotsWorld() override
    {
        for (btMultiBodyConstraint* motor : m_motors)
            multiBodies().removeMultiBodyConstraint(motor);
        while (multiBodies().getNumMultibodies() > 0)
            multiBodies().removeMultiBody(multiBodies().getMultiBody(0));
    }

private:
    static constexpr int kWheels = 4;

    btMultiBodyDynamicsWorld& multiBodies() { return static_cast<btMultiBodyDynamicsWorld&>(world()); }

    void addRobot(const btVector3& place)
    {
        constexpr btScalar kChassisMass = 4, kWheelMass = btScalar(0.5), kMostImpulse = btScalar(0.2);
        btMultiBody& robot = keep(std::make_unique<btMultiBody>(
            kWheels, kChassisMass, inertia(m_chassis, kChassisMass), false, options().sleeping));
        for (int wheel = 0; wheel < kWheels; ++wheel)
        {
            const btVector3 axle(btScalar(wheel % 2 == 0 ? -0.55 : 0.55), btScalar(-0.1),
                                 btScalar(wheel < 2 ? -0.5 : 0.5));
            robot.setupRevolute(wheel, kWheelMass, inertia(m_wheel, kWheelMass), -1,
                                btQuaternion::getIdentity(), btVector3(1, 0, 0), axle, btVector3(0, 0, 0),
                                true);
        }
        robot.finalizeMultiDof();
        robot.setBaseWorldTransform(transformAt(place));
        multiBodies().addMultiBody(&robot);
        addCollider(robot, -1, m_chassis);
        for (int wheel = 0; wheel < kWheels; ++wheel)
        {
            addCollider(robot, wheel, m_wheel);
            const btScalar speed = btScalar(m_random.uniform(-6.0f, 6.0f));
            m_motors.push_back(
                &keep(std::make_unique<btMultiBodyJointMotor>(&robot, wheel, speed, kMostImpulse)));
            multiBodies().addMultiBodyConstraint(m_motors.back());
        }
        btAlignedObjectArray<btQuaternion> rotations;
        btAlignedObjectArray<btVector3> origins;
        robot.forwardKinematics(rotations, origins);
        robot.updateCollisionObjectWorldTransforms(rotations, origins);
    }

    static btVector3 inertia(const btCollisionShape& shape, btScalar mass)
    {
        btVector3 result;
        shape.calculateLocalInertia(mass, result);
        return result;
    }

    /// @param link -1: the chassis
    void addCollider(btMultiBody& robot, int link, btCollisionShape& shape)
    {
        auto& collider = keep(std::make_unique<btMultiBodyLinkCollider>(&robot, link));
        collider.setCollisionShape(&shape);
        collider.setWorldTransform(robot.getBaseWorldTransform());
        collider.setFriction(1);
        world().addCollisionObject(&collider, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
        if (link < 0)
            robot.setBaseCollider(&collider);
        else
            robot.getLink(link).m_collider = &collider;
    }

    SplitMix64 m_random;
    btCollisionShape& m_chassis;
    btCollisionShape& m_wheel;
    std::vector<btMultiBodyConstraint*> m_motors;
};

class CompoundsWorld : public WorldScene
{
public:
    CompoundsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        const auto perSide =
            static_cast<std::uint32_t>(std::ceil(std::cbrt(static_cast<double>(scene.bodies))));
        addWalledFloor(btScalar(perSide) + 1, btScalar(3 * perSide));
        const std::vector<btCompoundShape*> shapes = makeShapes();
        SplitMix64 random(scene.seed);
        const btScalar centre = btScalar(perSide - 1) / 2;
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
        {
            const btVector3 cell(btScalar(i % perSide) - centre, btScalar(i / (perSide * perSide)),
                                 btScalar(i / perSide % perSide) - centre);
            const btTransform place(randomRotation(random), btScalar(1.9) * cell + btVector3(0, 2, 0));
            addBody(*shapes[random.below(shapes.size())], 1, place);
        }
    }

private:
    /// A core of diameter 1, and four arms at its sides that are half as large.
    std::vector<btCompoundShape*> makeShapes()
    {
        constexpr std::size_t kKinds = 4;
        std::vector<btCompoundShape*> shapes;
        for (HullPoints& hull : makeRandomHulls(kKinds, options().hullPoints, options().seed))
        {
            btCollisionShape& core = keep(makeHullShape(hull));
            for (auto& point : hull.points)
                for (auto& coordinate : point)
                    coordinate /= 2;
            btCollisionShape& arm = keep(makeHullShape(hull));
            btCompoundShape& shape = makeShape<btCompoundShape>();
            shape.addChildShape(btTransform::getIdentity(), &core);
            for (const btScalar side : {btScalar(-0.6), btScalar(0.6)})
            {
                shape.addChildShape(transformAt(btVector3(side, 0, 0)), &arm);
                shape.addChildShape(transformAt(btVector3(0, 0, side)), &arm);
            }
            shapes.push_back(&shape);
        }
        return shapes;
    }
};
}  // namespace

std::unique_ptr<WorldScene> makeRobotsScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options)
{
    return std::make_unique<RobotsWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeCompoundsScene(const std::string& name, NamedBroadphase broadphase,
                                               const WorldSceneOptions& options)
{
    return std::make_unique<CompoundsWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
