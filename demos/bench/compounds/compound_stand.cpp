// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/compounds/compound_stand.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"
#include "cullet/demos/scenes/worlds/lattice_mesh.h"

#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <ctime>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr double kSize = 2;     ///< of a body, metres
constexpr double kApart = 5;    ///< of neighbours, metres
constexpr double kHills = 0.1;  ///< height of the meshes, metres
constexpr int kFall = 40;       ///< steps

WorldSceneOptions standOptions(const CompoundCase& compoundCase, const std::string& narrow)
{
    WorldSceneOptions options;
    options.bodies = static_cast<std::uint32_t>(compoundCase.bodies);
    options.seed = compoundCase.seed;
    options.sleeping = false;
    options.narrow = narrow;
    options.backend = "dbvt";
    options.threads = 1;
    return options;
}

double threadMicroseconds()
{
    timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e6 * double(now.tv_sec) + 1e-3 * double(now.tv_nsec);
}
}  // namespace

const std::vector<std::string>& compoundChildNames()
{
    static const std::vector<std::string> names = {"box", "hull16", "sphere"};
    return names;
}

const std::vector<std::string>& compoundOtherNames()
{
    static const std::vector<std::string> names = {"plane", "box",  "hull", "compound",
                                                   "tiles", "mesh", "mesh5"};
    return names;
}

const std::vector<std::string>& compoundMotionNames()
{
    static const std::vector<std::string> names = {"rest", "sliding", "falling"};
    return names;
}

CompoundStand::CompoundStand(const CompoundCase& compoundCase, const std::string& narrow)
    : WorldScene("compound stand", makeNamedBroadphase({"dbvt"}), standOptions(compoundCase, narrow)),
      m_case(compoundCase),
      m_random(compoundCase.seed)
{
    btCompoundShape& shape = makeCompound();
    const int perSide = static_cast<int>(std::ceil(std::sqrt(m_case.bodies)));
    for (int i = 0; i < m_case.bodies; ++i)
        m_sites.emplace_back(btScalar(kApart * (i % perSide - 0.5 * (perSide - 1))), 0,
                             btScalar(kApart * (i / perSide - 0.5 * (perSide - 1))));
    addGround(shape);
    addBodies(shape);
}

btCollisionShape& CompoundStand::makeChild(btScalar half)
{
    if (m_case.child == "box")
        return makeShape<btBoxShape>(btVector3(half, half, half));
    if (m_case.child == "sphere")
        return makeShape<btSphereShape>(half);
    const float radius = float(half), height = 0.8f * float(half);
    btCollisionShape& hull =
        keep(makeHullShape(makeRings("part", {{-height, radius}, {height, radius}}, 1, 8)));
    hull.setMargin(btScalar(0.1) * half);
    return hull;
}

btCompoundShape& CompoundStand::makeCompound()
{
    auto& compound = makeShape<btCompoundShape>();
    const int along = m_case.children == 2 ? 2 : static_cast<int>(std::ceil(std::cbrt(m_case.children)));
    const int across = m_case.children == 2 ? 1 : along;
    const double spacing = kSize / along;
    btCollisionShape& child = makeChild(btScalar(0.475 * spacing));
    for (int i = 0; i < m_case.children; ++i)
    {
        const int x = i % along, z = i / along % across, y = i / along / across;
        const auto place = [&](int k, int count) { return btScalar(spacing * (k - 0.5 * (count - 1))); };
        compound.addChildShape(transformAt(btVector3(place(x, along), place(y, across), place(z, across))),
                               &child);
    }
    return compound;
}

btCollisionShape& CompoundStand::makeTiles()
{
    auto& tiles = makeShape<btCompoundShape>();
    auto& tile = makeShape<btBoxShape>(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
    for (int x = -20; x < 20; ++x)
    {
        for (int z = -20; z < 20; ++z)
            tiles.addChildShape(transformAt(btVector3(btScalar(x) + btScalar(0.5), btScalar(-0.5),
                                                      btScalar(z) + btScalar(0.5))),
                                &tile);
    }
    return tiles;
}

btCollisionShape& CompoundStand::makeMesh(double spacing)
{
    const int reach = static_cast<int>(std::ceil(30 / spacing));
    auto& triangles = makeShape<btTriangleMesh>();
    addLattice(triangles, {-reach, reach}, {-reach, reach},
               [&](int column, int row)
               {
                   const double x = spacing * column, z = spacing * row;
                   return btVector3(btScalar(x), btScalar(kHills * std::sin(0.25 * x) * std::cos(0.2 * z)),
                                    btScalar(z));
               });
    return makeShape<btBvhTriangleMeshShape>(&triangles, true);
}

/// A disc of 16 sides whose upper face is at the height 0.
btCollisionShape& CompoundStand::makeWideHull()
{
    return keep(makeHullShape(makeRings("disc", {{-1, 2.4f}, {0, 2.4f}}, 1, 16)));
}

/// Bodies that are at their sites lie on the ground afterwards.
void CompoundStand::addGround(const btCompoundShape& shape)
{
    btVector3 low, high;
    shape.getAabb(btTransform::getIdentity(), low, high);
    const std::string& other = m_case.other;
    double top = 0;
    if (other == "plane")
        addFloor();
    else if (other == "box")
        addStaticBox(btVector3(60, 1, 60), btVector3(0, -1, 0));
    else if (other == "tiles")
        addBody(makeTiles(), 0, btTransform::getIdentity());
    else if (other == "mesh" || other == "mesh5")
    {
        addBody(makeMesh(other == "mesh" ? 0.5 : 5.0), 0, btTransform::getIdentity());
        top = kHills;
    }
    else
    {
        const bool isHull = other == "hull";
        btCollisionShape& under = isHull ? makeWideHull() : makeCompound();
        // The margin of a hull is around it.
        const btScalar drop = isHull ? under.getMargin() : high.y();
        for (const btVector3& site : m_sites)
            addBody(under, 0, transformAt(site - btVector3(0, drop, 0)));
    }
    for (btVector3& site : m_sites)
        site.setY(btScalar(top) - low.y() + btScalar(0.01));
}

void CompoundStand::addBodies(btCompoundShape& shape)
{
    for (std::size_t i = 0; i < m_sites.size(); ++i)
    {
        btRigidBody& body = addBody(shape, 1, transformAt(m_sites[i]));
        body.getBroadphaseProxy()->m_collisionFilterMask = btBroadphaseProxy::StaticFilter;
        body.setFriction(m_case.motion == "sliding" ? btScalar(0) : btScalar(0.7));
        m_bodies.push_back(&body);
        place(i);
    }
}

void CompoundStand::place(std::size_t i)
{
    btVector3 site = m_sites[i], velocity(0, 0, 0);
    // Compounds lie on each other almost in line.
    const float turn = m_case.other == "compound" ? 0.02f : 6.2831853f;
    btQuaternion rotation(btVector3(0, 1, 0), btScalar(m_random.uniform(0, turn)));
    if (m_case.motion == "falling")
    {
        rotation = randomRotation(m_random);
        site.setY(site.y() + btScalar(m_random.uniform(0.5f, 1.5f)));
        velocity.setY(-2);
    }
    restart(*m_bodies[i], btTransform(rotation, site), velocity);
}

void CompoundStand::direct()
{
    for (std::size_t i = 0; i < m_bodies.size(); ++i)
    {
        btRigidBody& body = *m_bodies[i];
        const bool isSliding = m_case.motion == "sliding";
        if ((m_case.motion == "falling" && m_step > 0 && m_step % kFall == 0) ||
            (isSliding && body.getWorldTransform().getOrigin().x() > m_sites[i].x() + 1))
            place(i);
        if (!isSliding)
            continue;
        body.setLinearVelocity(btVector3(2, body.getLinearVelocity().y(), 0));
        body.setAngularVelocity(btVector3(0, 0, 0));
    }
    ++m_step;
}

std::vector<btTransform> CompoundStand::poses() const
{
    std::vector<btTransform> poses;
    for (const btRigidBody* body : m_bodies)
        poses.push_back(body->getWorldTransform());
    return poses;
}

double CompoundStand::dispatchAt(const std::vector<btTransform>& poses)
{
    for (std::size_t i = 0; i < m_bodies.size(); ++i)
        m_bodies[i]->setWorldTransform(poses[i]);
    world().updateAabbs();
    world().computeOverlappingPairs();
    btDispatcher& dispatcher = *world().getDispatcher();
    const double begin = threadMicroseconds();
    dispatcher.dispatchAllCollisionPairs(world().getPairCache(), world().getDispatchInfo(), &dispatcher);
    return threadMicroseconds() - begin;
}

int CompoundStand::contactCount()
{
    btDispatcher& dispatcher = *world().getDispatcher();
    int count = 0;
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        count += dispatcher.getManifoldByIndexInternal(i)->getNumContacts();
    return count;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
