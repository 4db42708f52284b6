// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/soft_world.h"

#include "cullet/demos/scenes/bodies/parallel_world.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class SoftWorld : public WorldScene
{
public:
    SoftWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene, softWorldKind())
    {
        const auto perSide =
            static_cast<std::uint32_t>(std::ceil(std::cbrt(static_cast<double>(scene.bodies))));
        addWalledFloor(btScalar(perSide), btScalar(2 * perSide + 4));
        btCollisionShape& cube =
            makeShape<btBoxShape>(btVector3(btScalar(0.35), btScalar(0.35), btScalar(0.35)));
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
        {
            const btVector3 cell(btScalar(i % perSide), btScalar(i / (perSide * perSide)),
                                 btScalar(i / perSide % perSide));
            const btScalar half = btScalar(perSide - 1) / 2;
            const btVector3 place = (cell - btVector3(half, 0, half)) * btScalar(1.5) + btVector3(0, 1, 0);
            if (i % 2 == 0)
                addBall(place);
            else
                addBody(cube, 1, transformAt(place));
        }
    }

private:
    btSoftRigidDynamicsWorld& softRigidWorld() { return static_cast<btSoftRigidDynamicsWorld&>(world()); }

    void addBall(const btVector3& place)
    {
        constexpr int kSamples = 100;
        const btScalar radius = btScalar(0.5);
        btSoftBody& ball = keep(std::unique_ptr<btSoftBody>(btSoftBodyHelpers::CreateEllipsoid(
            softRigidWorld().getWorldInfo(), place, btVector3(radius, radius, radius), kSamples)));
        ball.m_materials[0]->m_kLST = btScalar(0.5);
        // Pressure keeps the ball round.
        ball.m_cfg.kPR = 200;
        ball.m_cfg.kDF = btScalar(0.5);
        ball.setTotalMass(1, true);
        softRigidWorld().addSoftBody(&ball);
    }

    void hashMore(std::uint64_t& hash) const override
    {
        const auto& bodies = static_cast<const btSoftRigidDynamicsWorld&>(world()).getSoftBodyArray();
        for (int i = 0; i < bodies.size(); ++i)
        {
            for (int node = 0; node < bodies[i]->m_nodes.size(); ++node)
                hashScalars(hash, bodies[i]->m_nodes[node].m_x);
        }
    }
};
}  // namespace

const WorldKind& softWorldKind()
{
    static const WorldKind kind = {
        []() -> std::unique_ptr<btDefaultCollisionConfiguration>
        { return std::make_unique<btSoftBodyRigidBodyCollisionConfiguration>(); },
        makeSolver<btSequentialImpulseConstraintSolver>,
        [](btDispatcher& dispatcher, btBroadphaseInterface& broadphase, btConstraintSolver& solver,
           btCollisionConfiguration& configuration) -> std::unique_ptr<btDiscreteDynamicsWorld> {
            return std::make_unique<btSoftRigidDynamicsWorld>(&dispatcher, &broadphase, &solver,
                                                              &configuration);
        },
        makeParallelWorld<btSoftRigidDynamicsWorld>};
    return kind;
}

std::unique_ptr<WorldScene> makeSoftScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options)
{
    return std::make_unique<SoftWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
