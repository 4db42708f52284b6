// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/world_quality.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
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

void setDepths(std::vector<double> depths, WorldQuality& quality)
{
    if (depths.empty())
        return;
    std::sort(depths.begin(), depths.end());
    quality.meanDepth = std::accumulate(depths.begin(), depths.end(), 0.0) / double(depths.size());
    quality.p99Depth = depths[(depths.size() - 1) * 99 / 100];
    quality.maxDepth = depths.back();
}

double kineticEnergy(const btRigidBody& body)
{
    const btVector3 spin = body.getAngularVelocity() * body.getWorldTransform().getBasis();
    return 0.5 * double(body.getLinearVelocity().length2()) / double(body.getInvMass()) +
           0.5 * double((spin * spin).dot(body.getLocalInertia()));
}
}  // namespace

WorldQuality qualityOf(btDynamicsWorld& world)
{
    WorldQuality quality;
    setDepths(depthsOf(*world.getDispatcher()), quality);
    std::uint64_t bodies = 0;
    double energy = 0;
    for (int i = 0; i < world.getNumCollisionObjects(); ++i)
    {
        const btRigidBody* body = btRigidBody::upcast(world.getCollisionObjectArray()[i]);
        if (body == nullptr || body->isStaticOrKinematicObject())
            continue;
        ++bodies;
        if (body->getActivationState() == ISLAND_SLEEPING)
            ++quality.sleepers;
        else
            energy += kineticEnergy(*body);
    }
    quality.energy = bodies != 0 ? energy / double(bodies) : 0;
    return quality;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
