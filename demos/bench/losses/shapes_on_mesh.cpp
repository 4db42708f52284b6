// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/shapes_on_mesh.h"

#include "cullet/demos/scenes/splitmix64.h"
#include "cullet/demos/scenes/worlds/lattice_mesh.h"

#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class ShapesOnMesh : public WorldScene
{
public:
    ShapesOnMesh(MeshShape shape, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene("shapes-on-mesh", std::move(broadphase), scene), m_random(scene.seed)
    {
        const auto perSide = static_cast<int>(std::ceil(std::sqrt(scene.bodies)));
        addMesh(4 * perSide);
        btCollisionShape& common = makeCommonShape(shape);
        const btQuaternion lying(btVector3(1, 0, 0),
                                 shape == MeshShape::Cylinder ? SIMD_HALF_PI : btScalar(0));
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
        {
            const btScalar x = 2 * (btScalar(static_cast<int>(i) % perSide) - btScalar(perSide) / 2);
            const btScalar z = 2 * (btScalar(static_cast<int>(i) / perSide) - btScalar(perSide) / 2);
            addBody(common, 1, btTransform(lying, btVector3(x, restingHeight(shape), z))).setFriction(1);
        }
    }

private:
    static constexpr btScalar kCell = btScalar(0.5);

    static btScalar restingHeight(MeshShape shape)
    {
        return shape == MeshShape::GImpactTorus ? btScalar(0.25) : btScalar(0.6);
    }

    /// A little rough, so that no two triangles of a square are level.
    btVector3 cornerAt(int x, int z)
    {
        const btScalar height = btScalar(m_random.uniform(-0.02f, 0.02f));
        return btVector3(kCell * btScalar(x), height, kCell * btScalar(z));
    }

    void addMesh(int reach)
    {
        std::vector<btVector3> corners;
        const int side = 2 * reach + 1;
        for (int i = 0; i < side * side; ++i)
            corners.push_back(cornerAt(i / side - reach, i % side - reach));
        const auto at = [&](int x, int z)
        { return corners[static_cast<std::size_t>((x + reach) * side + z + reach)]; };
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        addLattice(mesh, -reach, reach, at);
        addBody(makeShape<btBvhTriangleMeshShape>(&mesh, true), 0, btTransform::getIdentity());
    }

    btCollisionShape& makeCommonShape(MeshShape shape)
    {
        if (shape == MeshShape::Cylinder)
            return makeShape<btCylinderShape>(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
        return shape == MeshShape::CompoundOfHulls ? makeCompound() : makeTorus();
    }

    /// Hulls of 20 cm side by side in a block of 5 x 2 x 5.
    btCollisionShape& makeCompound()
    {
        auto& compound = makeShape<btCompoundShape>();
        for (int i = 0; i < 50; ++i)
        {
            auto& hull = makeShape<btConvexHullShape>();
            for (int point = 0; point < 16; ++point)
            {
                const btScalar x = btScalar(m_random.uniform(-0.1f, 0.1f));
                const btScalar y = btScalar(m_random.uniform(-0.1f, 0.1f));
                hull.addPoint(btVector3(x, y, btScalar(m_random.uniform(-0.1f, 0.1f))), point == 15);
            }
            const btVector3 place(btScalar(i % 5 - 2), btScalar(i / 25) - btScalar(0.5),
                                  btScalar(i / 5 % 5 - 2));
            compound.addChildShape(transformAt(btScalar(0.25) * place), &hull);
        }
        return compound;
    }

    btCollisionShape& makeTorus()
    {
        constexpr int kAround = 8, kAcross = 8;
        const auto corner = [](int around, int across)
        {
            const btScalar a = SIMD_2_PI * btScalar(around) / kAround,
                           b = SIMD_2_PI * btScalar(across) / kAcross;
            const btScalar radius = btScalar(0.4) + btScalar(0.15) * btCos(b);
            return btVector3(radius * btCos(a), btScalar(0.15) * btSin(b), radius * btSin(a));
        };
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        for (int i = 0; i < kAround; ++i)
        {
            for (int j = 0; j < kAcross; ++j)
            {
                mesh.addTriangle(corner(i, j), corner(i, j + 1), corner(i + 1, j));
                mesh.addTriangle(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
            }
        }
        auto& torus = makeShape<btGImpactMeshShape>(&mesh);
        torus.updateBound();
        btGImpactCollisionAlgorithm::registerAlgorithm(
            static_cast<btCollisionDispatcher*>(world().getDispatcher()));
        return torus;
    }

    SplitMix64 m_random;
};
}  // namespace

std::unique_ptr<WorldScene> makeShapesOnMesh(MeshShape shape, const WorldSceneOptions& options)
{
    BroadphaseRequest request;
    request.name = options.backend;
    request.threads = options.threads;
    return std::make_unique<ShapesOnMesh>(shape, makeNamedBroadphase(request), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
