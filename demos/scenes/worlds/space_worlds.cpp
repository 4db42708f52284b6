// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/space_worlds.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class StaticWorld : public WorldScene
{
public:
    StaticWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene),
          m_random(scene.seed),
          m_half(btScalar(std::cbrt(32.0 * scene.bodies) / 2))
    {
        btCollisionShape& cube = makeShape<btBoxShape>(btVector3(1, 1, 1));
        const std::uint32_t movers = std::min(kMovers, scene.bodies);
        for (std::uint32_t i = 0; i < movers; ++i)
        {
            m_movers.push_back({&addObject(cube, transformAt(place())),
                                randomVector(m_random, btScalar(m_random.uniform(3, 6)))});
        }
        for (std::uint32_t i = movers; i < scene.bodies; ++i)
            addStatic(cube);
        world().setForceUpdateAllAabbs(false);
    }

private:
    static constexpr std::uint32_t kMovers = 100;

    struct Mover
    {
        btCollisionObject* object;
        btVector3 velocity;
    };

    btVector3 place()
    {
        btVector3 result(0, 0, 0);
        const float half = static_cast<float>(m_half);
        for (int axis = 0; axis < 3; ++axis)
            result[axis] = btScalar(m_random.uniform(-half, half));
        return result;
    }

    /// Adds a plain collision object: a million rigid bodies would take twice the memory for the same effect.
    void addStatic(btCollisionShape& shape)
    {
        btCollisionObject& object = keep(std::make_unique<btCollisionObject>());
        object.setCollisionShape(&shape);
        object.setWorldTransform(transformAt(place()));
        object.setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
        object.forceActivationState(ISLAND_SLEEPING);
        world().addCollisionObject(&object, btBroadphaseProxy::StaticFilter,
                                   btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter);
    }

    void direct() override
    {
        for (Mover& mover : m_movers)
        {
            btVector3 to = mover.object->getWorldTransform().getOrigin() + mover.velocity * options().dt;
            for (int axis = 0; axis < 3; ++axis)
            {
                if (btFabs(to[axis]) > m_half)
                    mover.velocity[axis] =
                        to[axis] > 0 ? -btFabs(mover.velocity[axis]) : btFabs(mover.velocity[axis]);
            }
            mover.object->setWorldTransform(transformAt(to));
        }
    }

    SplitMix64 m_random;
    btScalar m_half;
    std::vector<Mover> m_movers;
};

class StaticsWorld : public WorldScene
{
public:
    StaticsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene), m_random(scene.seed)
    {
        const btScalar half = btScalar(0.5);
        btCollisionShape& cube = makeShape<btBoxShape>(btVector3(half, half, half));
        const auto perSide = static_cast<std::uint32_t>(std::ceil(std::sqrt(scene.bodies)));
        const std::uint32_t tiles = kSquare * perSide;
        for (std::uint32_t i = 0; i < tiles * tiles; ++i)
            addBody(cube, 0,
                    transformAt(btVector3(btScalar(i % tiles), draw(0.2f) - half, btScalar(i / tiles))));
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
            addBody(cube, 1, placeIn(i % perSide, i / perSide));
    }

private:
    static constexpr std::uint32_t kSquare = 8;

    btScalar draw(float reach) { return btScalar(m_random.uniform(-reach, reach)); }

    /// Above the middle of a square of the floor.
    btTransform placeIn(std::uint32_t x, std::uint32_t z)
    {
        const btScalar middle = btScalar(kSquare - 1) / 2, shiftX = draw(2), shiftZ = draw(2);
        return btTransform(randomRotation(m_random), btVector3(btScalar(kSquare * x) + middle + shiftX, 2,
                                                               btScalar(kSquare * z) + middle + shiftZ));
    }

    SplitMix64 m_random;
};

class PlanetWorld : public WorldScene
{
public:
    PlanetWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        constexpr double kPlanet = 1e5;
        addBody(makeShape<btSphereShape>(btScalar(kPlanet)), 0, btTransform::getIdentity());
        SplitMix64 random(scene.seed);
        // A fiftieth of the volume of the largest box per body, for scenes of any size.
        const double inner = 1.5 * kPlanet;
        const double outer =
            std::cbrt(inner * inner * inner + scene.bodies * (kPlanet * kPlanet * kPlanet / 50) / (4.19));
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
            m_moons.push_back(makeMoon(random, inner, outer));
    }

private:
    struct Moon
    {
        btCollisionObject* object;
        btQuaternion turn;  ///< of a step
    };

    Moon makeMoon(SplitMix64& random, double inner, double outer)
    {
        const double edge = 0.1 * std::exp(double(random.uniform(0, 6)) * 2.302585092994046);
        const double share = random.uniform(0, 1);
        const double distance =
            std::cbrt(inner * inner * inner + share * (outer * outer * outer - inner * inner * inner));
        const btVector3 place = randomVector(random, btScalar(distance));
        const btVector3 axis = place.cross(randomVector(random, 1)).normalized();
        const btScalar half = btScalar(edge / 2);
        const btScalar angle = btScalar(random.uniform(0.05f, 0.1f)) * half / btScalar(distance);
        btCollisionObject& object =
            addObject(makeShape<btBoxShape>(btVector3(half, half, half)), transformAt(place));
        return {&object, btQuaternion(axis, angle)};
    }

    void direct() override
    {
        for (const Moon& moon : m_moons)
        {
            const btVector3 place = moon.object->getWorldTransform().getOrigin();
            moon.object->setWorldTransform(transformAt(quatRotate(moon.turn, place)));
        }
    }

    std::vector<Moon> m_moons;
};
}  // namespace

std::unique_ptr<WorldScene> makeStaticScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options)
{
    return std::make_unique<StaticWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeStaticsScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options)
{
    return std::make_unique<StaticsWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makePlanetScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options)
{
    return std::make_unique<PlanetWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
