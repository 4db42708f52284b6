// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/heap_worlds.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class PourWorld : public WorldScene
{
public:
    PourWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene),
          m_random(scene.seed),
          m_perLayer(std::min(scene.bodies, std::max(4u, (scene.bodies + 19) / 20))),
          m_perSide(static_cast<std::uint32_t>(std::ceil(std::sqrt(m_perLayer)))),
          m_box(makeShape<btBoxShape>(btVector3(btScalar(0.35), btScalar(0.35), btScalar(0.35)))),
          m_ball(makeShape<btSphereShape>(btScalar(0.4)))
    {
        addWalledFloor(kSpacing * btScalar(m_perSide) / 2 + 1, 8);
    }

private:
    static constexpr btScalar kSpacing = btScalar(1.25);

    void change() override
    {
        // In ten steps a layer clears the space of the next one.
        if (m_step++ % 10 != 0)
            return;
        for (std::uint32_t i = 0; i < m_perLayer; ++i)
            pour(btVector3(btScalar(i % m_perSide), 0, btScalar(i / m_perSide)));
    }

    void pour(const btVector3& cell)
    {
        const btScalar half = btScalar(m_perSide - 1) / 2;
        const btVector3 place = (cell - btVector3(half, 0, half)) * kSpacing + btVector3(0, 10, 0);
        const btTransform spout(randomRotation(m_random), place);
        if (m_bodies.size() < options().bodies)
        {
            btCollisionShape& shape = m_bodies.size() % 2 == 0 ? m_box : m_ball;
            m_bodies.push_back(&addBody(shape, 1, spout));
            m_bodies.back()->setLinearVelocity(btVector3(0, -5, 0));
            return;
        }
        btRigidBody& oldest = *m_bodies[m_next];
        m_next = (m_next + 1) % m_bodies.size();
        world().removeRigidBody(&oldest);
        restart(oldest, spout, btVector3(0, -5, 0));
        oldest.clearForces();
        if (options().sleeping)
            oldest.forceActivationState(ACTIVE_TAG);
        world().addRigidBody(&oldest);
    }

    SplitMix64 m_random;
    std::uint32_t m_perLayer;
    std::uint32_t m_perSide;
    std::uint32_t m_step = 0;
    btCollisionShape& m_box;
    btCollisionShape& m_ball;
    std::vector<btRigidBody*> m_bodies;
    std::size_t m_next = 0;  ///< next body to add, or the oldest once all are in the world
};

class PileWorld : public WorldScene
{
public:
    PileWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        addFloor();
        btCollisionShape& cube =
            makeShape<btBoxShape>(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
        SplitMix64 random(scene.seed);
        double radius = 1.0;
        while (countCone(radius) < scene.bodies)
            radius += 0.1;
        std::uint32_t left = scene.bodies;
        for (int layer = 0; left > 0; ++layer)
        {
            const double here = radiusOf(radius, layer);
            const int reach = static_cast<int>(here);
            for (int x = -reach; x <= reach; ++x)
            {
                for (int z = -reach; z <= reach && left > 0; ++z)
                {
                    if (x * x + z * z > here * here)
                        continue;
                    const btScalar turn = btScalar(random.uniform(-0.1f, 0.1f));
                    const btVector3 place(btScalar(1.12) * btScalar(x),
                                          btScalar(0.5) + btScalar(1.02) * btScalar(layer),
                                          btScalar(1.12) * btScalar(z));
                    addBody(cube, 1, btTransform(btQuaternion(btVector3(0, 1, 0), turn), place));
                    --left;
                }
            }
        }
    }

private:
    /// Radius of a layer of a cone of slope 0.6, in cells.
    static double radiusOf(double radius, int layer) { return radius - (layer + 0.5) / 0.6; }

    static std::uint32_t countCone(double radius)
    {
        std::uint32_t count = 0;
        for (int layer = 0; radiusOf(radius, layer) >= 0; ++layer)
        {
            const double here = radiusOf(radius, layer);
            const int reach = static_cast<int>(here);
            for (int x = -reach; x <= reach; ++x)
                count += 2 * static_cast<std::uint32_t>(std::sqrt(here * here - x * x)) + 1;
        }
        return count;
    }
};
}  // namespace

std::unique_ptr<WorldScene> makePourScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options)
{
    return std::make_unique<PourWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makePileScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options)
{
    return std::make_unique<PileWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
