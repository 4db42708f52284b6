// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/hull_worlds.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"
#include "cullet/demos/scenes/worlds/lattice_mesh.h"

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

/// Eight random hulls.
std::unique_ptr<BodyShapes> makeHullKinds(std::size_t points, std::uint64_t seed)
{
    constexpr std::size_t kHullKinds = 8;
    auto shapes = std::make_unique<BodyShapes>();
    for (const HullPoints& hull : makeRandomHulls(kHullKinds, points, seed))
        shapes->addHull(hull);
    return shapes;
}

/// Hills and the hulls that fall onto them.
struct HillsLayout
{
    std::uint32_t perSide;  ///< hulls of a layer
    int reach;              ///< of the mesh, on each side, metres
    btScalar spacing;       ///< of the hulls, metres
};

/// Four layers of hulls above a mesh that is hardly wider.
HillsLayout layoutOfHills(std::uint32_t bodies)
{
    const auto perSide = static_cast<std::uint32_t>(std::ceil(std::sqrt((bodies + 3) / 4)));
    return {perSide, static_cast<int>(perSide) + 3, btScalar(1.4)};
}

/// One layer of hulls above 25 triangles for each.
HillsLayout layoutOfTerrain(std::uint32_t bodies)
{
    constexpr int kRim = 4;
    const auto perSide = static_cast<std::uint32_t>(std::ceil(std::sqrt(bodies)));
    const int reach = std::max(kRim + 1, static_cast<int>(std::ceil(std::sqrt(25.0 * bodies / 8))));
    return {perSide, reach, btScalar(2 * (reach - kRim)) / btScalar(perSide)};
}

class HillsWorld : public WorldScene
{
public:
    HillsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene,
               const HillsLayout& layout)
        : WorldScene(name, std::move(broadphase), scene), m_layout(layout)
    {
        addMesh();
        addHulls();
    }

private:
    btVector3 cornerAt(int x, int z) const
    {
        const int inner = m_layout.reach - 2;
        const int rim = std::max({std::abs(x), std::abs(z), inner}) - inner;
        const btScalar height = btScalar(0.6) * btSin(btScalar(x)) * btCos(btScalar(0.8) * btScalar(z));
        return btVector3(btScalar(x), height + btScalar(3 * rim), btScalar(z));
    }

    void addMesh()
    {
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        addLattice(mesh, -m_layout.reach, m_layout.reach, [this](int x, int z) { return cornerAt(x, z); });
        addBody(makeShape<btBvhTriangleMeshShape>(&mesh, true), 0, btTransform::getIdentity());
    }

    void addHulls()
    {
        const BodyShapes& shapes = keep(makeHullKinds(options().hullPoints, options().seed));
        SplitMix64 random(options().seed);
        const std::uint32_t perSide = m_layout.perSide;
        const btScalar centre = btScalar(perSide - 1) / 2;
        for (std::uint32_t i = 0; i < options().bodies; ++i)
        {
            const btVector3 cell(btScalar(i % perSide) - centre, btScalar(i / (perSide * perSide)),
                                 btScalar(i / perSide % perSide) - centre);
            const btTransform place(randomRotation(random), cell * m_layout.spacing + btVector3(0, 2, 0));
            addBody(*shapes.at(random.below(shapes.size())), 1, place);
        }
    }

    HillsLayout m_layout;
};

/// A lattice of spinning hulls without gravity. The spheres around them leave a gap of both margins, so that narrow
/// phases test all pairs of neighbours, and nothing pushes.
class FreeHullsWorld : public WorldScene
{
public:
    FreeHullsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        constexpr std::size_t kPoints = 64;
        world().setGravity(btVector3(0, 0, 0));
        const BodyShapes& shapes = keep(makeHullKinds(kPoints, scene.seed));
        SplitMix64 random(scene.seed);
        const auto perSide = static_cast<std::uint32_t>(std::ceil(std::cbrt(scene.bodies)));
        const btScalar spacing = 1 + 2 * CONVEX_DISTANCE_MARGIN;
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
        {
            const btVector3 cell(btScalar(i % perSide), btScalar(i / (perSide * perSide)),
                                 btScalar(i / perSide % perSide));
            const btTransform place(randomRotation(random), cell * spacing);
            btRigidBody& body = addBody(*shapes.at(i % shapes.size()), 1, place);
            body.setAngularVelocity(randomVector(random, btScalar(random.uniform(0.5f, 2))));
        }
    }
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
    return std::make_unique<HillsWorld>(name, std::move(broadphase), options, layoutOfHills(options.bodies));
}

std::unique_ptr<WorldScene> makeTerrainScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options)
{
    return std::make_unique<HillsWorld>(name, std::move(broadphase), options,
                                        layoutOfTerrain(options.bodies));
}

std::unique_ptr<WorldScene> makeFreeHullsScene(const std::string& name, NamedBroadphase broadphase,
                                               const WorldSceneOptions& options)
{
    return std::make_unique<FreeHullsWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
