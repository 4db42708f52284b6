// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/world_quality.h"

#include "cullet/demos/scenes/bodies/exact_depth.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletDynamics/ConstraintSolver/btConeTwistConstraint.h>
#include <BulletDynamics/ConstraintSolver/btHingeConstraint.h>
#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::vector<double> depthsOf(btDispatcher& dispatcher)
{
    std::vector<double> depths;
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
    {
        const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
        for (int k = 0; k < manifold.getNumContacts(); ++k)
        {
            const double depth = -double(manifold.getContactPoint(k).getDistance());
            if (depth > 0)
                depths.push_back(depth);
        }
    }
    return depths;
}

DepthSummary depthSummaryOf(std::vector<double> depths)
{
    if (depths.empty())
        return {};
    std::sort(depths.begin(), depths.end());
    return {std::accumulate(depths.begin(), depths.end(), 0.0) / double(depths.size()),
            depths[(depths.size() - 1) * 99 / 100], depths.back()};
}

double kineticEnergy(const btRigidBody& body)
{
    const btVector3 spin = body.getAngularVelocity() * body.getWorldTransform().getBasis();
    return 0.5 * double(body.getLinearVelocity().length2()) / double(body.getInvMass()) +
           0.5 * double((spin * spin).dot(body.getLocalInertia()));
}
/// Distance of the pivot's places in both bodies; negative for a joint without a pivot.
double errorOf(const btTypedConstraint& joint)
{
    const auto distance = [&](const btVector3& inA, const btVector3& inB)
    {
        const btVector3 onA = joint.getRigidBodyA().getWorldTransform() * inA;
        return double(onA.distance(joint.getRigidBodyB().getWorldTransform() * inB));
    };
    if (const auto* ball = dynamic_cast<const btPoint2PointConstraint*>(&joint))
        return distance(ball->getPivotInA(), ball->getPivotInB());
    if (const auto* hinge = dynamic_cast<const btHingeConstraint*>(&joint))
        return distance(hinge->getAFrame().getOrigin(), hinge->getBFrame().getOrigin());
    if (const auto* cone = dynamic_cast<const btConeTwistConstraint*>(&joint))
        return distance(cone->getAFrame().getOrigin(), cone->getBFrame().getOrigin());
    return -1;
}

void setJointErrors(btDynamicsWorld& world, WorldQuality& quality)
{
    int pivots = 0;
    for (int i = 0; i < world.getNumConstraints(); ++i)
    {
        const double error = world.getConstraint(i)->isEnabled() ? errorOf(*world.getConstraint(i)) : -1;
        if (error < 0)
            continue;
        ++pivots;
        quality.meanJointError += error;
        quality.maxJointError = std::max(quality.maxJointError, error);
    }
    if (pivots > 0)
        quality.meanJointError /= pivots;
}

/// Calls function(body) for the rigid bodies that can move.
template <class Function>
void forEachMovable(const btDynamicsWorld& world, const Function& function)
{
    for (int i = 0; i < world.getNumCollisionObjects(); ++i)
    {
        const btRigidBody* body = btRigidBody::upcast(world.getCollisionObjectArray()[i]);
        if (body != nullptr && !body->isStaticOrKinematicObject())
            function(*body);
    }
}

bool sleeps(const btRigidBody& body)
{
    return body.getActivationState() == ISLAND_SLEEPING;
}
}  // namespace

WorldQuality qualityOf(btDynamicsWorld& world)
{
    WorldQuality quality;
    quality.points = depthSummaryOf(depthsOf(*world.getDispatcher()));
    quality.pairs = depthSummaryOf(exactDepths(world));
    setJointErrors(world, quality);
    double energy = 0;
    forEachMovable(world, [&](const btRigidBody& body) { energy += sleeps(body) ? 0 : kineticEnergy(body); });
    const Sleepers counted = sleepersOf(world);
    quality.sleepers = counted.sleepers;
    quality.energy = counted.bodies != 0 ? energy / double(counted.bodies) : 0;
    return quality;
}

Sleepers sleepersOf(const btDynamicsWorld& world)
{
    Sleepers counted;
    forEachMovable(world,
                   [&](const btRigidBody& body)
                   {
                       ++counted.bodies;
                       counted.sleepers += sleeps(body) ? 1 : 0;
                   });
    return counted;
}

std::vector<btVector3> placesOf(const btDynamicsWorld& world)
{
    std::vector<btVector3> places;
    forEachMovable(world, [&](const btRigidBody& body) { places.push_back(body.getCenterOfMassPosition()); });
    return places;
}

double meanWay(const std::vector<btVector3>& from, const std::vector<btVector3>& to)
{
    double sum = 0;
    for (std::size_t i = 0; i < from.size(); ++i)
        sum += double(from[i].distance(to[i]));
    return from.empty() ? 0 : sum / double(from.size());
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
