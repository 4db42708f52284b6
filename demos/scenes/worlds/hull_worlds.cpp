// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/hull_worlds.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
HullPoints makeBarrel()
{
    return makeRings("barrel", {{-0.6f, 0.4f}, {-0.2f, 0.5f}, {0.2f, 0.5f}, {0.6f, 0.4f}}, 1);
}

class BarrelsWorld : public WorldScene
{
public:
    BarrelsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        constexpr std::uint32_t kHigh = 15;
        const std::uint32_t columns = (scene.bodies + kHigh - 1) / kHigh;
        const auto perSide = static_cast<std::uint32_t>(std::ceil(std::sqrt(columns)));
        const btScalar half = btScalar(perSide) + 100;
        addStaticBox(btVector3(half, 1, half), btVector3(0, -1, 0));
        btCollisionShape& barrel = keep(makeHullShape(makeBarrel()));
        const btScalar centre = btScalar(perSide - 1) / 2;
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
        {
            const std::uint32_t column = i % columns;
            // Half a height, margins, and the height of the fall.
            const btScalar y = btScalar(0.74) + btScalar(1.38) * btScalar(i / columns);
            addBody(barrel, 1,
                    transformAt(btVector3(btScalar(1.5) * (btScalar(column % perSide) - centre), y,
                                          btScalar(1.5) * (btScalar(column / perSide) - centre))));
        }
    }
};

class HillsWorld : public WorldScene
{
public:
    HillsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene),
          m_perSide(static_cast<std::uint32_t>(std::ceil(std::sqrt((scene.bodies + 3) / 4)))),
          m_reach(static_cast<int>(m_perSide) + 3)
    {
        addMesh();
        addHulls();
    }

private:
    static constexpr btScalar kSpacing = btScalar(1.4);

    btVector3 cornerAt(int x, int z) const
    {
        const int rim = std::max({std::abs(x), std::abs(z), m_reach - 2}) - (m_reach - 2);
        const btScalar height = btScalar(0.6) * btSin(btScalar(x)) * btCos(btScalar(0.8) * btScalar(z));
        return btVector3(btScalar(x), height + btScalar(3 * rim), btScalar(z));
    }

    void addMesh()
    {
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        for (int x = -m_reach; x < m_reach; ++x)
        {
            for (int z = -m_reach; z < m_reach; ++z)
            {
                mesh.addTriangle(cornerAt(x, z), cornerAt(x, z + 1), cornerAt(x + 1, z));
                mesh.addTriangle(cornerAt(x + 1, z), cornerAt(x, z + 1), cornerAt(x + 1, z + 1));
            }
        }
        addBody(makeShape<btBvhTriangleMeshShape>(&mesh, true), 0, btTransform::getIdentity());
    }

    void addHulls()
    {
        constexpr std::size_t kHullKinds = 8;
        BodyShapes& shapes = keep(std::make_unique<BodyShapes>());
        for (const HullPoints& hull : makeRandomHulls(kHullKinds, options().hullPoints, options().seed))
            shapes.addHull(hull);
        SplitMix64 random(options().seed);
        const btScalar centre = btScalar(m_perSide - 1) / 2;
        for (std::uint32_t i = 0; i < options().bodies; ++i)
        {
            const btVector3 cell(btScalar(i % m_perSide) - centre, btScalar(i / (m_perSide * m_perSide)),
                                 btScalar(i / m_perSide % m_perSide) - centre);
            const btTransform place(randomRotation(random), cell * kSpacing + btVector3(0, 2, 0));
            addBody(*shapes.at(random.below(shapes.size())), 1, place);
        }
    }

    std::uint32_t m_perSide;  ///< bodies of a layer
    int m_reach;              ///< of the mesh, on each side
};
}  // namespace

std::unique_ptr<WorldScene> makeBarrelsScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options)
{
    return std::make_unique<BarrelsWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeHillsScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options)
{
    return std::make_unique<HillsWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
