// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/actor_worlds.h"

#include "cullet/demos/scenes/splitmix64.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>
#include <BulletDynamics/Vehicle/btRaycastVehicle.h>

#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class StampedeWorld : public WorldScene
{
public:
    StampedeWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene), m_random(scene.seed)
    {
        allowGhosts();
        addFloor();
        const std::uint32_t vehicles = (scene.bodies + 1) / 2;
        const std::uint32_t ghosts = scene.bodies - vehicles;
        const auto perRow = static_cast<std::uint32_t>(std::ceil(std::sqrt(vehicles)));
        btCollisionShape& chassis = makeShape<btBoxShape>(btVector3(1, btScalar(0.4), 2));
        btCollisionShape& sensor = makeShape<btSphereShape>(btScalar(6));
        btCollisionShape& bump = makeShape<btBoxShape>(btVector3(1, btScalar(0.05), btScalar(0.5)));
        auto& raycaster = keep(std::make_unique<btDefaultVehicleRaycaster>(&world()));
        for (std::uint32_t i = 0; i < vehicles; ++i)
        {
            const btVector3 place(btScalar(6 * (i % perRow)), btScalar(1.1), btScalar(8 * (i / perRow)));
            m_vehicles.push_back(&addVehicle(chassis, place, raycaster));
            addBody(bump, 0,
                    transformAt(place + btVector3(btScalar(m_random.uniform(-2, 2)), btScalar(-1.1), 5)));
            if (i < ghosts)
                addGhost(sensor, place);
        }
    }

    std::vector<const btRaycastVehicle*> vehicles() const override
    {
        return {m_vehicles.begin(), m_vehicles.end()};
    }

private:
    btRaycastVehicle& addVehicle(btCollisionShape& chassis, const btVector3& place,
                                 btVehicleRaycaster& raycaster)
    {
        btRigidBody& body = addBody(chassis, 800, transformAt(place));
        body.setActivationState(DISABLE_DEACTIVATION);
        const btRaycastVehicle::btVehicleTuning tuning;
        btRaycastVehicle& vehicle = keep(std::make_unique<btRaycastVehicle>(tuning, &body, &raycaster));
        vehicle.setCoordinateSystem(0, 1, 2);
        for (const btScalar x : {btScalar(-0.9), btScalar(0.9)})
        {
            for (const btScalar z : {btScalar(-1.5), btScalar(1.5)})
            {
                btWheelInfo& wheel =
                    vehicle.addWheel(btVector3(x, btScalar(-0.2), z), btVector3(0, -1, 0),
                                     btVector3(-1, 0, 0), btScalar(0.4), btScalar(0.4), tuning, z > 0);
                wheel.m_suspensionStiffness = 20;
                wheel.m_wheelsDampingRelaxation = btScalar(2.3);
                wheel.m_wheelsDampingCompression = btScalar(4.4);
                wheel.m_rollInfluence = btScalar(0.1);
            }
        }
        // addWheel() places the wheel by its suspension length, which is uninitialised.
        vehicle.resetSuspension();
        for (int wheel = 0; wheel < vehicle.getNumWheels(); ++wheel)
            vehicle.updateWheelTransform(wheel, false);
        world().addAction(&vehicle);
        return vehicle;
    }

    void addGhost(btCollisionShape& sensor, const btVector3& place)
    {
        auto& ghost = keep(std::make_unique<btPairCachingGhostObject>());
        ghost.setCollisionShape(&sensor);
        ghost.setWorldTransform(transformAt(place));
        ghost.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
        world().addCollisionObject(&ghost, btBroadphaseProxy::SensorTrigger,
                                   btBroadphaseProxy::DefaultFilter);
        m_ghosts.push_back(&ghost);
    }

    void direct() override
    {
        const bool steers = m_step++ % 60 == 0;
        for (btRaycastVehicle* vehicle : m_vehicles)
        {
            const btScalar steering = btScalar(steers ? m_random.uniform(-0.1f, 0.1f) : 0);
            for (int wheel = 0; wheel < vehicle->getNumWheels(); ++wheel)
            {
                vehicle->applyEngineForce(600, wheel);
                if (steers && vehicle->getWheelInfo(wheel).m_bIsFrontWheel)
                    vehicle->setSteeringValue(steering, wheel);
            }
        }
        for (std::size_t i = 0; i < m_ghosts.size(); ++i)
            m_ghosts[i]->setWorldTransform(
                transformAt(m_vehicles[i]->getRigidBody()->getWorldTransform().getOrigin()));
    }

    SplitMix64 m_random;
    std::uint32_t m_step = 0;
    std::vector<btRaycastVehicle*> m_vehicles;
    std::vector<btPairCachingGhostObject*> m_ghosts;
};

class CrowdWorld : public WorldScene
{
public:
    CrowdWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene),
          m_random(scene.seed),
          m_perSide(static_cast<std::uint32_t>(std::ceil(std::sqrt(scene.bodies))))
    {
        allowGhosts();
        addFloor();
        // Bullet's controller rotates the z axis of its object to point up.
        auto& capsule = makeShape<btCapsuleShapeZ>(btScalar(0.4), btScalar(0.8));
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
            addWalker(capsule, btVector3(btScalar(2 * (i % m_perSide)), btScalar(0.85),
                                         btScalar(2 * (i / m_perSide))));
        for (std::uint32_t i = 0; i < scene.bodies; i += 16)
            addStaticBox(btVector3(btScalar(0.3), 2, btScalar(0.3)),
                         btVector3(btScalar(2 * (i % m_perSide) + 1), 2, btScalar(2 * (i / m_perSide) + 1)));
    }

private:
    struct Walker
    {
        btPairCachingGhostObject* body;
        btKinematicCharacterController* controller;
        btVector3 goal;
    };

    btVector3 drawGoal()
    {
        const float side = 2.0f * static_cast<float>(m_perSide);
        const btScalar x = btScalar(m_random.uniform(0, side));
        return btVector3(x, 0, btScalar(m_random.uniform(0, side)));
    }

    void addWalker(btConvexShape& shape, const btVector3& place)
    {
        auto& body = keep(std::make_unique<btPairCachingGhostObject>());
        body.setCollisionShape(&shape);
        body.setWorldTransform(transformAt(place));
        body.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
        world().addCollisionObject(&body, btBroadphaseProxy::CharacterFilter,
                                   btBroadphaseProxy::StaticFilter | btBroadphaseProxy::DefaultFilter |
                                       btBroadphaseProxy::CharacterFilter);
        auto& controller = keep(std::make_unique<btKinematicCharacterController>(&body, &shape, btScalar(0.3),
                                                                                 btVector3(0, 1, 0)));
        controller.setGravity(world().getGravity());
        world().addAction(&controller);
        m_walkers.push_back({&body, &controller, drawGoal()});
    }

    void direct() override
    {
        for (Walker& walker : m_walkers)
        {
            btVector3 way = walker.goal - walker.body->getWorldTransform().getOrigin();
            way.setY(0);
            if (way.length2() < 1)
                walker.goal = drawGoal();
            walker.controller->setWalkDirection(way.safeNormalize() * 3 * options().dt);
        }
    }

    SplitMix64 m_random;
    std::uint32_t m_perSide;
    std::vector<Walker> m_walkers;
};
}  // namespace

std::unique_ptr<WorldScene> makeStampedeScene(const std::string& name, NamedBroadphase broadphase,
                                              const WorldSceneOptions& options)
{
    return std::make_unique<StampedeWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeCrowdScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options)
{
    return std::make_unique<CrowdWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
