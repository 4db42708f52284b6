// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/structure_worlds.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class WallWorld : public WorldScene
{
public:
    WallWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        addFloor();
        btCollisionShape& brick =
            makeShape<btBoxShape>(btVector3(btScalar(0.5), btScalar(0.25), btScalar(0.25)));
        const std::uint32_t bricks = scene.bodies - 1;
        const auto columns = std::max(1u, static_cast<std::uint32_t>(std::lround(std::sqrt(2.0 * bricks))));
        for (std::uint32_t i = 0; i < bricks; ++i)
        {
            const std::uint32_t row = i / columns;
            const btScalar x = btScalar(i % columns) - btScalar(columns) / 2 + btScalar(row % 2) / 2;
            addBody(brick, 1, transformAt(btVector3(x, btScalar(0.25) + btScalar(row) / 2, 0)))
                .setFriction(btScalar(0.8));
        }
        const btScalar middle = std::max(btScalar(1), btScalar(bricks / columns) / 4);
        btRigidBody& ball =
            addBody(makeShape<btSphereShape>(btScalar(1)), 50, transformAt(btVector3(0, middle, -10)));
        ball.setLinearVelocity(btVector3(0, 0, 30));
    }
};

class DominoWorld : public WorldScene
{
public:
    DominoWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        addFloor();
        btCollisionShape& piece =
            makeShape<btBoxShape>(btVector3(btScalar(0.05), btScalar(0.5), btScalar(0.25)));
        constexpr double kSpacing = 0.4;
        double angle = 0.0;
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
        {
            const double radius = 2.0 + angle / SIMD_2_PI;
            const btVector3 place(btScalar(radius * std::sin(angle)), btScalar(0.5),
                                  btScalar(radius * std::cos(angle)));
            // The thin side faces along the spiral.
            const btQuaternion along(btVector3(0, 1, 0), btScalar(angle));
            btRigidBody& body = addBody(piece, 1, btTransform(along, place));
            body.setFriction(btScalar(0.5));
            if (i == 0)
                body.setAngularVelocity(btVector3(0, 0, -3));
            angle += kSpacing / radius;
        }
    }
};

class CardsWorld : public WorldScene
{
public:
    CardsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene), m_left(scene.bodies)
    {
        addFloor();
        m_card = &makeShape<btBoxShape>(btVector3(btScalar(0.01), btScalar(0.5), btScalar(0.35)));
        const auto perSide = static_cast<std::uint32_t>(std::ceil(std::sqrt((scene.bodies + 25) / 26)));
        for (std::uint32_t house = 0; m_left > 0; ++house)
            addHouse(btVector3(btScalar(6 * (house % perSide)), 0, btScalar(6 * (house / perSide))));
    }

private:
    static constexpr int kStoreys = 4;
    static constexpr btScalar kLean = btScalar(20) * SIMD_RADS_PER_DEG;

    void addHouse(const btVector3& origin)
    {
        // Thickness of a leaning card and of the one that lies on it.
        const btScalar height = btCos(kLean) + btScalar(0.05);
        const btScalar width = 2 * btSin(kLean) + btScalar(0.05);
        for (int storey = 0; storey < kStoreys; ++storey)
        {
            const int frames = kStoreys - storey;
            const btScalar left = -width * btScalar(frames - 1) / 2;
            const btScalar middle = btScalar(storey) * height + height / 2;
            for (int i = 0; i < frames; ++i)
            {
                const btVector3 foot = origin + btVector3(left + btScalar(i) * width, middle, 0);
                addCard(foot - btVector3(width / 4, 0, 0), -kLean);
                addCard(foot + btVector3(width / 4, 0, 0), kLean);
            }
            for (int i = 0; i + 1 < frames; ++i)
                addCard(
                    origin + btVector3(left + (btScalar(i) + btScalar(0.5)) * width, middle + height / 2, 0),
                    SIMD_HALF_PI);
        }
    }

    void addCard(const btVector3& place, btScalar lean)
    {
        if (m_left == 0)
            return;
        --m_left;
        addBody(*m_card, 1, btTransform(btQuaternion(btVector3(0, 0, 1), lean), place)).setFriction(1);
    }

    std::uint32_t m_left;
    btCollisionShape* m_card = nullptr;
};

class PyramidWorld : public WorldScene
{
public:
    PyramidWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        addFloor();
        const btScalar half = btScalar(0.5), spacing = btScalar(1.05);
        btCollisionShape& cube = makeShape<btBoxShape>(btVector3(half, half, half));
        auto length = static_cast<std::uint32_t>(std::ceil((std::sqrt(8.0 * scene.bodies + 1) - 1) / 2));
        std::uint32_t row = 0, inRow = 0;
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
        {
            const btScalar x = (btScalar(inRow) - btScalar(length - 1) / 2) * spacing;
            addBody(cube, 1, transformAt(btVector3(x, half + btScalar(row), 0)));
            if (++inRow < length)
                continue;
            inRow = 0;
            ++row;
            --length;
        }
    }
};
}  // namespace

std::unique_ptr<WorldScene> makePyramidScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options)
{
    return std::make_unique<PyramidWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeWallScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options)
{
    return std::make_unique<WallWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeDominoScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options)
{
    return std::make_unique<DominoWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeCardsScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options)
{
    return std::make_unique<CardsWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
