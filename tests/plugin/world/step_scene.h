// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/support/random.h"

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace cullet::test
{
/// Bodies and joints of a world, and what happens to them between and during steps. Two worlds with the same scene take
/// the same steps.
class StepScene
{
public:
    explicit StepScene(btDiscreteDynamicsWorld& world) : m_world(world) {}
    virtual ~StepScene();
    StepScene(const StepScene&) = delete;
    StepScene& operator=(const StepScene&) = delete;

    /// Takes a step, numbered from 0.
    virtual void step(int number);

    /// Hash of all state after a step, bit by bit: of objects, of manifolds in the order of the dispatcher, of joints.
    std::uint64_t hash() const;

    /// What happened of that for which the scene exists, such as broken joints: 0 means that the scene tests nothing.
    virtual int events() const = 0;

    btDiscreteDynamicsWorld& world() const { return m_world; }

protected:
    template <class Shape, class... Args>
    Shape& makeShape(Args&&... args)
    {
        auto shape = std::make_unique<Shape>(std::forward<Args>(args)...);
        Shape& made = *shape;
        m_shapes.push_back(std::move(shape));
        return made;
    }
    btRigidBody& addBody(btCollisionShape& shape, double mass, const btVector3& at,
                         btMotionState* motionState = nullptr);
    btRigidBody& addBody(btCollisionShape& shape, double mass, const btTransform& at,
                         btMotionState* motionState = nullptr);
    btRigidBody& addFloor();
    /// By default Bullet puts islands together until they have more than 128 manifolds and joints.
    void makeGroupsSmall() { m_world.getSolverInfo().m_minimumSolverBatchSize = 4; }
    void removeBody(btRigidBody& body);
    template <class Joint, class... Args>
    Joint& addJoint(Args&&... args)
    {
        auto joint = std::make_unique<Joint>(std::forward<Args>(args)...);
        Joint& made = *joint;
        m_joints.push_back(std::move(joint));
        m_world.addConstraint(&made, true);
        return made;
    }
    void removeJoint(btTypedConstraint& joint);

    const std::vector<std::unique_ptr<btRigidBody>>& bodies() const { return m_bodies; }
    const std::vector<std::unique_ptr<btTypedConstraint>>& joints() const { return m_joints; }
    /// Movers that are awake and those that sleep.
    int countAwake(bool isAwake) const;

private:
    btDiscreteDynamicsWorld& m_world;
    std::vector<std::unique_ptr<btCollisionShape>> m_shapes;
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
    std::vector<std::unique_ptr<btTypedConstraint>> m_joints;
};

using MakeScene = std::unique_ptr<StepScene> (*)(btDiscreteDynamicsWorld&);

template <class Scene>
std::unique_ptr<StepScene> makeScene(btDiscreteDynamicsWorld& world)
{
    return std::make_unique<Scene>(world);
}

/// A scene with its name, and what is expected of World.
struct NamedScene
{
    const char* name;
    MakeScene make;
    bool hasManyIslands = true;  ///< several threads solve it
};
std::vector<NamedScene> structureScenes();
std::vector<NamedScene> jointScenes();
std::vector<NamedScene> actorScenes();
}  // namespace cullet::test
