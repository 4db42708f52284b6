// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/flying_world.h"

#include "cullet/demos/scenes/bodies/body_shapes.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
btVector3 centreOf(const Aabb& box)
{
    return btVector3(btScalar(box.min[0]) + btScalar(box.max[0]), btScalar(box.min[1]) + btScalar(box.max[1]),
                     btScalar(box.min[2]) + btScalar(box.max[2])) /
           2;
}

btVector3 halfExtentsOf(const Aabb& box)
{
    return btVector3(btScalar(box.max[0]) - btScalar(box.min[0]), btScalar(box.max[1]) - btScalar(box.min[1]),
                     btScalar(box.max[2]) - btScalar(box.min[2])) /
           2;
}

std::unique_ptr<BoxScene> makeBoxScene(const std::string& name, const WorldSceneOptions& options)
{
    BoxSceneOptions boxes;
    boxes.bodies = options.bodies;
    boxes.seed = options.seed;
    return findBoxScene(name)->make(boxes);
}
}  // namespace

FlyingWorld::FlyingWorld(std::string name, NamedBroadphase broadphase, const WorldSceneOptions& options,
                         std::unique_ptr<BoxScene> scene, std::unique_ptr<btCollisionShape> shape)
    : WorldScene(std::move(name), std::move(broadphase), options), m_scene(std::move(scene))
{
    btCollisionShape* const common = shape ? &keep(std::move(shape)) : nullptr;
    for (const Aabb& box : m_scene->boxes())
        addObject(common != nullptr ? *common : makeShape<btBoxShape>(halfExtentsOf(box)),
                  transformAt(centreOf(box)));
}

void FlyingWorld::direct()
{
    m_scene->step();
    for (const std::uint32_t row : m_scene->moved())
    {
        btCollisionObject& object = *world().getCollisionObjectArray()[static_cast<int>(row)];
        object.setWorldTransform(transformAt(centreOf(m_scene->boxes()[row])));
    }
}

std::unique_ptr<WorldScene> makeFlyingScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options)
{
    return std::make_unique<FlyingWorld>(name, std::move(broadphase), options, makeBoxScene(name, options),
                                         nullptr);
}

std::unique_ptr<WorldScene> makeThesisScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options)
{
    return std::make_unique<FlyingWorld>(
        name, std::move(broadphase), options, makeBoxScene("W1", options),
        makeHullShape(makeIcosphere(1.0f - static_cast<float>(CONVEX_DISTANCE_MARGIN))));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
