// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/determinism/saved_scenes.h"

#include <cmath>
#include <random>

namespace cullet::test
{
namespace
{
constexpr unsigned kSeed = 4;

/// Hills of 64 triangles a metre wide.
void addHills(btTriangleMesh& mesh)
{
    const auto corner = [](double x, double z) { return vec(x, 0.1 * std::sin(3 * x) * std::cos(2 * z), z); };
    for (int i = 0; i < 64; ++i)
    {
        const double x = i % 8 - 3.0, z = i / 8 - 3.0;
        mesh.addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
        mesh.addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
    }
}

std::unique_ptr<btCompoundShape> makePair(btCollisionShape& left, btCollisionShape& right, double distance)
{
    auto made = std::make_unique<btCompoundShape>();
    made->addChildShape(btTransform(btQuaternion::getIdentity(), vec(-distance / 2, 0, 0)), &left);
    made->addChildShape(btTransform(btQuaternion::getIdentity(), vec(distance / 2, 0, 0)), &right);
    return made;
}
}  // namespace

SavedScenes::SavedScenes()
    : m_ground(std::make_unique<btBoxShape>(vec(20, 1, 20))),
      m_brick(makeHullShape(boxPoints(0.4, 0.3, 0.3))),
      m_ball(makeHullShape(ballPoints(20, 0.4, 5))),
      m_cube(makeHullShape(boxPoints(0.35, 0.35, 0.35))),
      m_box(std::make_unique<btBoxShape>(vec(0.35, 0.3, 0.4))),
      m_plank(std::make_unique<btBoxShape>(vec(0.3, 0.4, 0.2))),
      m_limb(std::make_unique<btCapsuleShape>(btScalar(0.12), btScalar(0.5))),
      m_pair(makePair(*m_cube, *m_ball, 0.7)),
      m_dumbbell(makePair(*m_ball, *m_box, 2.4))
{
    addHills(m_triangles);
    m_mesh = std::make_unique<btBvhTriangleMeshShape>(&m_triangles, true);
}

void SavedScenes::build(SavedWorld& saved, SavedScene scene, bool sleeps) const
{
    if (scene == SavedScene::Mesh)
        saved.add(*m_mesh, 0, vec(0, 0, 0));
    else if (scene != SavedScene::SparseCompounds)
        saved.add(*m_ground, 0, vec(0, -1, 0));
    switch (scene)
    {
        case SavedScene::Hulls:
            addHeap(saved, {&m_brick, &m_ball, &m_cube}, 0.75);
            break;
        case SavedScene::Boxes:
            addHeap(saved, {&m_box, &m_plank}, 0.8);
            break;
        case SavedScene::Compounds:
            saved.world.sortManifolds();
            addHeap(saved, {&m_pair}, 1.1);
            break;
        case SavedScene::SparseCompounds:
            addSparseCompounds(saved);
            break;
        case SavedScene::Mesh:
            addHeap(saved, {&m_brick, &m_ball, &m_box, &m_limb}, 0.75);
            break;
        case SavedScene::Ragdolls:
            addRagdolls(saved);
            break;
        case SavedScene::Multibodies:
            addChains(saved);
            break;
    }
    for (const auto& body : saved.bodies)
        body->setActivationState(sleeps ? ACTIVE_TAG : DISABLE_DEACTIVATION);
}

void SavedScenes::addHeap(SavedWorld& saved, const std::vector<const Shape*>& kinds, double spacing) const
{
    std::mt19937 engine(kSeed);
    for (int i = 0; i < 18; ++i)
    {
        const btTransform at(randomRotation(engine),
                             vec(spacing * (i % 3), 0.5 + (spacing + 0.05) * (i / 9), spacing * (i / 3 % 3)));
        saved.add(**kinds[static_cast<std::size_t>(i) % kinds.size()], 1, at);
    }
}

void SavedScenes::addSparseCompounds(SavedWorld& saved) const
{
    // Each dumbbell reaches from one half of the ground to the other, and from one block to another.
    saved.add(*m_ground, 0, vec(-20, -1, 0));
    saved.add(*m_ground, 0, vec(20, -1, 0));
    for (int i = 0; i < 4; ++i)
    {
        const double z = 1.2 * i;
        saved.add(*m_brick, 1, vec(-1.2, 0.31, z));
        saved.add(*m_cube, 1, vec(1.2, 0.36, z));
        saved.add(*m_dumbbell, 1, btTransform(btQuaternion(vec(0, 1, 0), btScalar(0.1 * i)), vec(0, 1.2, z)));
    }
}

void SavedScenes::addRagdolls(SavedWorld& saved) const
{
    for (int i = 0; i < 4; ++i)
    {
        const btVector3 at = vec(0.5 * i, 0.9 + 0.9 * i, 0.3 * i);
        btRigidBody& chest = saved.add(*m_plank, 2, at);
        for (int k = 0; k < 4; ++k)
        {
            const double side = k % 2 == 0 ? 0.45 : -0.45, height = k < 2 ? 0.35 : -0.4;
            btRigidBody& each = saved.add(*m_limb, 1, at + vec(side, height - 0.37, 0));
            if (k < 2)
                saved.join<btPoint2PointConstraint>(chest, each, vec(side, height, 0), vec(0, 0.37, 0));
            else
                saved.join<btHingeConstraint>(chest, each, vec(side, height, 0), vec(0, 0.37, 0),
                                              vec(1, 0, 0), vec(1, 0, 0));
        }
    }
}

void SavedScenes::addChains(SavedWorld& saved) const
{
    for (int i = 0; i < 4; ++i)
        saved.addChain(
            {m_brick.get(), m_ball.get(), m_box.get(), m_brick.get()},
            btTransform(btQuaternion(vec(1, 0, 0), btScalar(0.3 + i)), vec(0.2 * i, 0.5 + 0.9 * i, 0.2 * i)));
    saved.add(*m_ball, 1, vec(1, 5.5, 0));
}
}  // namespace cullet::test
