// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Boxes, balls and cylinders that fall onto a floor in a world of DART with its Bullet collision detector.

#include "falling_things.h"
#include <dart/collision/bullet/bullet.hpp>
#include <dart/dart.hpp>
#include <memory>
#include <string>

namespace
{
using namespace dart::dynamics;

ShapePtr shapeOf(int i)
{
    if (i % 3 == 1)
        return std::make_shared<SphereShape>(0.25);
    if (i % 3 == 2)
        return std::make_shared<CylinderShape>(0.25, 0.5);
    return std::make_shared<BoxShape>(Eigen::Vector3d::Constant(0.5));
}

SkeletonPtr makeThing(int i)
{
    SkeletonPtr thing = Skeleton::create("thing" + std::to_string(i));
    BodyNode* body = thing->createJointAndBodyNodePair<FreeJoint>().second;
    const ShapePtr shape = shapeOf(i);
    body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(shape);
    Inertia inertia;
    inertia.setMass(1);
    inertia.setMoment(shape->computeInertia(1));
    body->setInertia(inertia);
    const Place place(i);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(place.x, place.y, place.z);
    FreeJoint::setTransform(body, pose);
    return thing;
}

SkeletonPtr makeFloor()
{
    SkeletonPtr floor = Skeleton::create("floor");
    BodyNode* body = floor->createJointAndBodyNodePair<WeldJoint>().second;
    body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(
        std::make_shared<BoxShape>(Eigen::Vector3d(50, 50, 1)));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation().z() = -0.5;
    body->getParentJoint()->setTransformFromParentBodyNode(pose);
    return floor;
}
}  // namespace

int main()
{
    auto world = dart::simulation::World::create();
    world->setTimeStep(0.002);
    world->getConstraintSolver()->setCollisionDetector(dart::collision::BulletCollisionDetector::create());
    world->addSkeleton(makeFloor());
    for (int i = 0; i < 128; ++i)
        world->addSkeleton(makeThing(i));
    std::size_t contacts = 0;
    for (int i = 0; i < 600; ++i)
    {
        world->step();
        contacts += world->getLastCollisionResult().getNumContacts();
    }
    Result result;
    for (std::size_t i = 1; i < world->getNumSkeletons(); ++i)
    {
        const Eigen::Vector3d at = world->getSkeleton(i)->getBodyNode(0)->getWorldTransform().translation();
        result.add(at.x(), at.y(), at.z());
    }
    std::printf("contacts %zu\n", contacts);
    result.print();
}
