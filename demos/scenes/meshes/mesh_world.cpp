// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/meshes/mesh_world.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"
#include "cullet/demos/scenes/worlds/lattice_mesh.h"

#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr int kFall = 40;         ///< steps
constexpr double kHighest = 0.3;  ///< of a mesh, metres

WorldSceneOptions meshSceneOptions(const MeshCase& meshCase, const std::string& narrow)
{
    WorldSceneOptions options;
    options.bodies = static_cast<std::uint32_t>(meshCase.bodies);
    options.seed = meshCase.seed;
    options.sleeping = false;
    options.narrow = narrow;
    options.backend = "dbvt";
    options.threads = 1;
    return options;
}

MeshSpacing spacingOf(const std::string& mesh)
{
    if (mesh == "0.1m")
        return {0.1, 0.1};
    if (mesh == "5m")
        return {5.0, 5.0};
    if (mesh == "flat-0.25m")
        return {0.25, 0.25};
    if (mesh == "needles")
        return {0.02, 8.0};
    return {0.5, 0.5};
}

bool rollsOff(const std::string& shape)
{
    return shape == "sphere" || shape == "small-sphere" || shape == "capsule" || shape == "cylinder";
}
}  // namespace

const std::vector<std::string>& meshShapeNames()
{
    static const std::vector<std::string> names = {
        "sphere",   "box",     "capsule",     "cylinder",     "hull16",    "hull64",  "hull200",
        "compound", "gimpact", "convex-mesh", "small-sphere", "small-box", "long-box"};
    return names;
}

const std::vector<std::string>& meshNames()
{
    static const std::vector<std::string> names = {
        "0.5m", "0.1m", "5m", "heightfield", "scaled", "multi-material", "flat", "flat-0.25m", "needles"};
    return names;
}

MeshWorld::MeshWorld(const MeshCase& meshCase, const std::string& narrow)
    : WorldScene("mesh", makeNamedBroadphase({"dbvt"}), meshSceneOptions(meshCase, narrow)),
      m_case(meshCase),
      m_random(meshCase.seed)
{
    btGImpactCollisionAlgorithm::registerAlgorithm(
        static_cast<btCollisionDispatcher*>(world().getDispatcher()));
    m_mesh = &makeMesh();
    addBody(*m_mesh, 0, btTransform::getIdentity());
    addBodies();
}

double MeshWorld::heightAt(double x, double z) const
{
    const std::string& mesh = m_case.mesh;
    if (mesh == "flat" || mesh == "flat-0.25m")
        return 0.0;
    return kHighest * std::sin(0.25 * x) * std::cos(0.2 * z);
}

btConcaveShape& MeshWorld::makeHeightField(double spacing)
{
    const int reach = static_cast<int>(std::ceil(m_case.reach / spacing)), across = 2 * reach + 1;
    auto& heights = keep(std::make_unique<std::vector<float>>());
    for (int z = -reach; z <= reach; ++z)
    {
        for (int x = -reach; x <= reach; ++x)
            heights.push_back(static_cast<float>(heightAt(spacing * x, spacing * z)));
    }
    // Bullet puts the middle between both bounds to the origin.
    auto& field =
        makeShape<btHeightfieldTerrainShape>(across, across, heights.data(), btScalar(1), -btScalar(kHighest),
                                             btScalar(kHighest), 1, PHY_FLOAT, false);
    field.setLocalScaling(btVector3(btScalar(spacing), 1, btScalar(spacing)));
    return field;
}

/// @param scale of the shape: corners are divided by it
btTriangleMesh& MeshWorld::makeTriangles(const MeshSpacing& spacing, double scale)
{
    const int columns = static_cast<int>(std::ceil(m_case.reach / spacing.x));
    const int rows = static_cast<int>(std::ceil(m_case.reach / spacing.z));
    auto& triangles = makeShape<btTriangleMesh>();
    addLattice(triangles, {-columns, columns}, {-rows, rows},
               [&](int column, int row)
               {
                   const double x = spacing.x * column, z = spacing.z * row;
                   return btVector3(btScalar(x / scale), btScalar(heightAt(x, z) / scale),
                                    btScalar(z / scale));
               });
    return triangles;
}

btConcaveShape& MeshWorld::makeMesh()
{
    const MeshSpacing spacing = spacingOf(m_case.mesh);
    if (m_case.mesh == "heightfield")
        return makeHeightField(spacing.x);
    if (m_case.mesh == "multi-material")
        return makeShape<btMultimaterialTriangleMeshShape>(&makeTriangles(spacing, 1), true);
    if (m_case.mesh != "scaled")
        return makeShape<btBvhTriangleMeshShape>(&makeTriangles(spacing, 1), true);
    auto& small = makeShape<btBvhTriangleMeshShape>(&makeTriangles(spacing, 2), true);
    return makeShape<btScaledBvhTriangleMeshShape>(&small, btVector3(2, 2, 2));
}

/// A prism, which lies on one of its ends.
btCollisionShape& MeshWorld::makeHull(int points)
{
    return keep(makeHullShape(makeRings("prism", {{-0.3f, 0.5f}, {0.3f, 0.5f}}, 1, points / 2)));
}

btCollisionShape& MeshWorld::makeCompound()
{
    auto& compound = makeShape<btCompoundShape>();
    auto& hull = keep(makeHullShape(makeRings("part", {{-0.15f, 0.15f}, {0.15f, 0.15f}}, 1, 8)));
    for (const btVector3& place : {btVector3(0, 0, 0), btVector3(1, 0, 1), btVector3(-1, 0, 1),
                                   btVector3(1, 0, -1), btVector3(-1, 0, -1)})
        compound.addChildShape(transformAt(place * btScalar(0.35)), &hull);
    return compound;
}

/// A torus that lies: 16 times 6 corners.
btCollisionShape& MeshWorld::makeTorus()
{
    auto& triangles = makeShape<btTriangleMesh>();
    const auto at = [](int around, int section)
    {
        const btScalar a = SIMD_2_PI * btScalar(around) / 16, s = SIMD_2_PI * btScalar(section) / 6;
        const btScalar radius = btScalar(0.4) + btScalar(0.15) * btCos(s);
        return btVector3(radius * btCos(a), btScalar(0.15) * btSin(s), radius * btSin(a));
    };
    addLattice(triangles, {0, 16}, {0, 6}, at);
    auto& torus = makeShape<btGImpactMeshShape>(&triangles);
    torus.updateBound();
    return torus;
}

/// A prism of 20 sides: 80 triangles.
btCollisionShape& MeshWorld::makeConvexMesh()
{
    constexpr int kSides = 20;
    const btVector3 top(0, btScalar(0.3), 0);
    const auto rim = [](int side)
    {
        const btScalar angle = SIMD_2_PI * btScalar(side) / kSides;
        return btVector3(btCos(angle), 0, btSin(angle)) * btScalar(0.5);
    };
    auto& triangles = makeShape<btTriangleMesh>();
    addLattice(triangles, {0, kSides}, {0, 1},
               [&](int side, int upper) { return rim(side) + (upper == 1 ? top : -top); });
    for (int side = 0; side < kSides; ++side)
    {
        for (const btVector3& centre : {top, btVector3(-top)})
            triangles.addTriangle(centre, centre + rim(side), centre + rim(side + 1));
    }
    return makeShape<btConvexTriangleMeshShape>(&triangles, true);
}

btCollisionShape& MeshWorld::makeBodyShape()
{
    const std::string& name = m_case.shape;
    const btScalar half = btScalar(0.5), low = btScalar(0.3), small = btScalar(0.1);
    if (name == "sphere")
        return makeShape<btSphereShape>(half);
    if (name == "box")
        return makeShape<btBoxShape>(btVector3(half, low, half));
    if (name == "capsule")
        return makeShape<btCapsuleShapeX>(low, 2 * low);
    if (name == "cylinder")
        return makeShape<btCylinderShape>(btVector3(half, low, half));
    if (name == "compound")
        return makeCompound();
    if (name == "gimpact")
        return makeTorus();
    if (name == "convex-mesh")
        return makeConvexMesh();
    if (name == "small-sphere")
        return makeShape<btSphereShape>(small);
    if (name == "small-box")
        return makeShape<btBoxShape>(btVector3(small, small, small));
    if (name == "long-box")
        return makeShape<btBoxShape>(btVector3(5, small, small));
    if (name == "hull16" || name == "hull64" || name == "hull200")
        return makeHull(std::stoi(name.substr(4)));
    throw std::invalid_argument("no shape '" + name + "'");
}

void MeshWorld::addBodies()
{
    btCollisionShape& shape = makeBodyShape();
    btVector3 low, high;
    shape.getAabb(btTransform::getIdentity(), low, high);
    const int perSide = static_cast<int>(std::ceil(std::sqrt(m_case.bodies)));
    for (int i = 0; i < m_case.bodies; ++i)
    {
        const double x = m_case.apart * (i % perSide - 0.5 * (perSide - 1));
        const double z = m_case.apart * (i / perSide - 0.5 * (perSide - 1));
        m_sites.emplace_back(btScalar(x), btScalar(heightAt(x, z)) - low.y() + btScalar(0.02), btScalar(z));
        btRigidBody& body = addBody(shape, 1, btTransform::getIdentity());
        body.getBroadphaseProxy()->m_collisionFilterMask = btBroadphaseProxy::StaticFilter;
        m_bodies.push_back(&body);
        place(static_cast<std::size_t>(i));
        const bool isRough = m_case.motion == MeshMotion::Rest || m_case.motion == MeshMotion::Falling;
        body.setFriction(isRough ? btScalar(0.7) : btScalar(0));
        if (isRough && rollsOff(m_case.shape))
        {
            // Otherwise they would roll down the slopes.
            body.setRollingFriction(btScalar(0.2));
            body.setSpinningFriction(btScalar(0.2));
        }
    }
}

/// Puts a body to its site, by its motion.
void MeshWorld::place(std::size_t i)
{
    btVector3 site = m_sites[i], velocity(0, 0, 0);
    btQuaternion rotation(btVector3(0, 1, 0), btScalar(m_random.uniform(0, 6.2831853f)));
    if (m_case.motion == MeshMotion::Falling)
    {
        rotation = randomRotation(m_random);
        site.setY(site.y() + btScalar(m_random.uniform(0.2f, 2.0f)));
        velocity.setY(-1);
    }
    restart(*m_bodies[i], btTransform(rotation, site), velocity);
}

void MeshWorld::direct()
{
    if (m_case.motion == MeshMotion::Falling && m_step > 0 && m_step % kFall == 0)
    {
        for (std::size_t i = 0; i < m_bodies.size(); ++i)
            place(i);
    }
    if (m_case.motion == MeshMotion::Sliding)
    {
        for (std::size_t i = 0; i < m_bodies.size(); ++i)
        {
            if (m_bodies[i]->getWorldTransform().getOrigin().x() > m_sites[i].x() + 5)
                place(i);
            m_bodies[i]->setLinearVelocity(btVector3(5, m_bodies[i]->getLinearVelocity().y(), 0));
            m_bodies[i]->setAngularVelocity(btVector3(0, 0, 0));
        }
    }
    ++m_step;
}

double MeshWorld::trianglesPerBody() const
{
    struct Counter : btTriangleCallback
    {
        void processTriangle(btVector3*, int, int) override { ++count; }
        int count = 0;
    } counter;
    for (const btRigidBody* body : m_bodies)
    {
        btVector3 low, high;
        body->getAabb(low, high);
        m_mesh->processAllTriangles(&counter, low, high);
    }
    return double(counter.count) / double(std::max<std::size_t>(1, m_bodies.size()));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
