// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/mesh_worlds.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"
#include "cullet/demos/scenes/worlds/lattice_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// A scene of one mesh and bodies of a metre over it, of four kinds in turn.
class MeshScene : public WorldScene
{
protected:
    MeshScene(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene),
          m_random(scene.seed),
          m_perSide(std::max(1, static_cast<int>(std::ceil(std::sqrt(scene.bodies)))))
    {
    }

    /// Bodies in a square, in one layer.
    int perSide() const { return m_perSide; }
    SplitMix64& random() { return m_random; }

    void addMesh(btTriangleMesh& mesh)
    {
        addBody(makeShape<btBvhTriangleMeshShape>(&mesh, true), 0, btTransform::getIdentity());
    }

    /// @param apart distance of neighbours
    void addBodies(btScalar apart, btScalar height)
    {
        std::vector<btCollisionShape*> kinds = {&makeShape<btBoxShape>(btVector3(1, 1, 1) * btScalar(0.4)),
                                                &makeShape<btSphereShape>(btScalar(0.5)),
                                                &makeShape<btCapsuleShape>(btScalar(0.3), btScalar(0.6))};
        for (const HullPoints& hull : makeRandomHulls(1, options().hullPoints, options().seed))
            kinds.push_back(&keep(makeHullShape(hull)));
        const btScalar centre = btScalar(m_perSide - 1) / 2;
        for (std::uint32_t i = 0; i < options().bodies; ++i)
        {
            const int column = static_cast<int>(i) % m_perSide, row = static_cast<int>(i) / m_perSide;
            const btVector3 place((btScalar(column) - centre) * apart, height,
                                  (btScalar(row) - centre) * apart);
            addBody(*kinds[i % kinds.size()], 1, btTransform(randomRotation(m_random), place));
        }
    }

private:
    SplitMix64 m_random;
    int m_perSide;
};

void addQuad(btTriangleMesh& mesh, const btVector3& a, const btVector3& b, const btVector3& c,
             const btVector3& d)
{
    mesh.addTriangle(a, b, c);
    mesh.addTriangle(a, c, d);
}

/// The sides and the top of a block that stands on a height.
void addBlock(btTriangleMesh& mesh, const btVector3& low, const btVector3& high)
{
    const std::array<btVector3, 4> bottom = {{low, btVector3(low.x(), low.y(), high.z()),
                                              btVector3(high.x(), low.y(), high.z()),
                                              btVector3(high.x(), low.y(), low.z())}};
    const btVector3 up(0, high.y() - low.y(), 0);
    for (std::size_t i = 0; i < 4; ++i)
    {
        const btVector3 &a = bottom[i], &b = bottom[(i + 1) % 4];
        addQuad(mesh, a, b, b + up, a + up);
    }
    addQuad(mesh, bottom[0] + up, bottom[1] + up, bottom[2] + up, bottom[3] + up);
}

class CityWorld : public MeshScene
{
public:
    CityWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : MeshScene(name, std::move(broadphase), scene)
    {
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        const int blocks = (perSide() + 1) / 2;
        const btScalar reach = kBlock * btScalar(blocks) / 2, ground = reach + kOutskirts;
        addQuad(mesh, btVector3(-ground, 0, -ground), btVector3(-ground, 0, ground),
                btVector3(ground, 0, ground), btVector3(ground, 0, -ground));
        for (int i = 0; i < blocks * blocks; ++i)
        {
            const btVector3 corner(kBlock * btScalar(i % blocks) - reach, 0,
                                   kBlock * btScalar(i / blocks) - reach);
            addHouse(mesh, corner);
        }
        addMesh(mesh);
        addBodies(kBlock / 2, kHighest + 1);
    }

private:
    static constexpr btScalar kBlock = 8;       ///< a house with its street
    static constexpr btScalar kHighest = 5;     ///< roof
    static constexpr btScalar kOutskirts = 60;  ///< ground beyond the last house

    void addHouse(btTriangleMesh& mesh, const btVector3& corner)
    {
        const auto height = btScalar(random().uniform(2, float(kHighest)));
        addBlock(mesh, corner + btVector3(1, 0, 1), corner + btVector3(5, height, 5));
        for (int step = 0; step < 5; ++step)
        {
            const btScalar inset = btScalar(0.3) * btScalar(step), rise = btScalar(0.2) * btScalar(step + 1);
            addBlock(mesh, corner + btVector3(5 + inset / 2, 0, 1 + inset),
                     corner + btVector3(7 - inset / 2, rise, 5 - inset));
        }
        addStatue(mesh, corner + btVector3(3, 0, btScalar(6.5)));
    }

    /// A hemisphere on the street.
    static void addStatue(btTriangleMesh& mesh, const btVector3& centre)
    {
        constexpr int kParts = 24;
        const auto at = [&](int latitude, int longitude)
        {
            const btScalar up = SIMD_HALF_PI * btScalar(latitude) / (kParts / 4);
            const btScalar around = SIMD_2_PI * btScalar(longitude % kParts) / kParts;
            return centre +
                   btVector3(btCos(up) * btCos(around), btSin(up), btCos(up) * btSin(around)) * btScalar(0.6);
        };
        for (int latitude = 0; latitude < kParts / 4; ++latitude)
        {
            for (int longitude = 0; longitude < kParts; ++longitude)
            {
                mesh.addTriangle(at(latitude, longitude), at(latitude + 1, longitude),
                                 at(latitude, longitude + 1));
                // At the top, both upper corners are the same.
                if (latitude + 1 < kParts / 4)
                    mesh.addTriangle(at(latitude, longitude + 1), at(latitude + 1, longitude),
                                     at(latitude + 1, longitude + 1));
            }
        }
    }
};

class NeedlesWorld : public MeshScene
{
public:
    NeedlesWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : MeshScene(name, std::move(broadphase), scene)
    {
        const btScalar reach = btScalar(perSide()) + kRim;
        const int columns = static_cast<int>(std::ceil(reach / kWidth));
        const int rows = static_cast<int>(std::ceil(reach / kLength));
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        addLattice(mesh, {-columns, columns}, {-rows, rows},
                   [](int x, int z)
                   {
                       const btScalar height =
                           btScalar(0.3) * btSin(kWidth * btScalar(x)) * btCos(btScalar(z));
                       return btVector3(kWidth * btScalar(x), height, kLength * btScalar(z));
                   });
        addMesh(mesh);
        addBodies(2, 2);
    }

private:
    static constexpr btScalar kWidth = btScalar(0.02), kLength = 8;  ///< of a triangle
    static constexpr btScalar kRim = 20;                             ///< beyond the bodies
};

class SlideWorld : public WorldScene
{
public:
    SlideWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), withActiveEdges(scene)), m_random(scene.seed)
    {
        const int lanes = static_cast<int>(scene.bodies);
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        const int half = lanes * kLane + 4;
        addLattice(mesh, {-2 * kReach - 8, 2 * kReach + 8}, {-half, half},
                   [](int x, int z) { return btVector3(btScalar(x) / 2, 0, btScalar(z) / 2); });
        addBody(makeShape<btBvhTriangleMeshShape>(&mesh, true), 0, btTransform::getIdentity()).setFriction(0);
        const std::vector<Kind> kinds = makeKinds();
        for (int lane = 0; lane < lanes; ++lane)
            addSlider(kinds[static_cast<std::size_t>(lane) % kinds.size()], lane, lanes);
    }

protected:
    /// Puts bodies at the end of their lanes to the start.
    void direct() override
    {
        for (btRigidBody* body : m_sliders)
        {
            btTransform place = body->getWorldTransform();
            if (place.getOrigin().x() < btScalar(kReach))
                continue;
            place.getOrigin().setX(place.getOrigin().x() - 2 * btScalar(kReach));
            body->setWorldTransform(place);
            body->setInterpolationWorldTransform(place);
        }
    }

private:
    static WorldSceneOptions withActiveEdges(WorldSceneOptions options)
    {
        options.activeEdges = true;
        return options;
    }

    static constexpr int kReach = 20;  ///< metres of a lane on each side
    static constexpr int kLane = 2;    ///< metres between lanes

    struct Kind
    {
        btCollisionShape* shape;
        btScalar height;  ///< of the origin of a body that lies on the mesh
    };

    std::vector<Kind> makeKinds()
    {
        const btScalar half = btScalar(0.5);
        std::vector<Kind> kinds = {
            {&makeShape<btSphereShape>(half), half},
            {&makeShape<btBoxShape>(btVector3(half, half, half)), half},
            {&makeShape<btCapsuleShapeX>(btScalar(0.3), btScalar(0.6)), btScalar(0.3)},
            {&makeShape<btCylinderShape>(btVector3(half, btScalar(0.3), half)), btScalar(0.3)}};
        for (const int sides : {8, 32})
        {
            btCollisionShape& hull =
                keep(makeHullShape(makeRings("prism", {{-0.3f, 0.5f}, {0.3f, 0.5f}}, 1, sides)));
            kinds.push_back({&hull, btScalar(0.3) + CONVEX_DISTANCE_MARGIN});
        }
        return kinds;
    }

    void addSlider(const Kind& kind, int lane, int lanes)
    {
        const auto yaw = btScalar(m_random.uniform(0, 6.2831853f));
        const auto along = btScalar(m_random.uniform(-float(kReach), float(kReach)));
        const btVector3 place(along, kind.height + kGap, kLane * (btScalar(lane) - btScalar(lanes - 1) / 2));
        btRigidBody& body =
            addBody(*kind.shape, 1, btTransform(btQuaternion(btVector3(0, 1, 0), yaw), place));
        body.setFriction(0);
        const btScalar share = btScalar(lane) / btScalar(std::max(lanes - 1, 1));
        body.setLinearVelocity(btVector3(1 + 14 * share, 0, 0));
        m_sliders.push_back(&body);
    }

    static constexpr btScalar kGap = btScalar(0.001);  ///< below a body at the start

    SplitMix64 m_random;
    std::vector<btRigidBody*> m_sliders;
};
}  // namespace

std::unique_ptr<WorldScene> makeCityScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options)
{
    return std::make_unique<CityWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeNeedlesScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options)
{
    return std::make_unique<NeedlesWorld>(name, std::move(broadphase), options);
}

std::unique_ptr<WorldScene> makeSlideScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options)
{
    return std::make_unique<SlideWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
