// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/rivals/manager_rival.h"

#include <algorithm>
#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_SaP.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/broadphase/broadphase_interval_tree.h>
#include <fcl/broadphase/broadphase_spatialhash.h>
#include <fcl/geometry/shape/sphere.h>

namespace cullet
{
namespace
{
fcl::Vector3d toFcl(const float* corner)
{
    return {corner[0], corner[1], corner[2]};
}

/// In double, the scalar of the packaged library, which represents every float.
struct Fcl
{
    using Base = fcl::CollisionObjectd;
    using Manager = fcl::BroadPhaseCollisionManagerd;

    class Object : public Base
    {
    public:
        Object() : Base(sphere()) {}

        void setBox(const Aabb& box)
        {
            aabb.min_ = toFcl(box.min);
            aabb.max_ = toFcl(box.max);
        }

    private:
        static const std::shared_ptr<fcl::Sphered>& sphere()
        {
            static const auto one = std::make_shared<fcl::Sphered>(1.0);
            return one;
        }
    };

    static void collide(const Manager& manager, Pairs& pairs)
    {
        const auto collect = [](Base* a, Base* b, void* list)
        {
            if (a->getAABB().overlap(b->getAABB()))
                static_cast<Pairs*>(list)->push_back(makePair(rowOfObject(*a), rowOfObject(*b)));
            return false;
        };
        manager.collide(&pairs, collect);
    }
};

std::unique_ptr<Fcl::Manager> makeSpatialHash(const Aabb& bounds)
{
    // A twentieth of the scene's shortest side, as in FCL's own benchmarks.
    const fcl::Vector3d size = toFcl(bounds.max) - toFcl(bounds.min);
    return std::make_unique<fcl::SpatialHashingCollisionManager<double>>(
        size.minCoeff() / 20.0, toFcl(bounds.min), toFcl(bounds.max));
}

std::unique_ptr<Fcl::Manager> makeManager(const RivalRequest& request)
{
    if (request.name == "fcl-tree")
        return std::make_unique<fcl::DynamicAABBTreeCollisionManagerd>();
    if (request.name == "fcl-tree-array")
        return std::make_unique<fcl::DynamicAABBTreeCollisionManager_Arrayd>();
    if (request.name == "fcl-ssap")
        return std::make_unique<fcl::SSaPCollisionManagerd>();
    if (request.name == "fcl-sap")
        return std::make_unique<fcl::SaPCollisionManagerd>();
    if (request.name == "fcl-interval")
        return std::make_unique<fcl::IntervalTreeCollisionManagerd>();
    return makeSpatialHash(request.bounds);
}
}  // namespace

std::unique_ptr<Rival> makeFclRival(const RivalRequest& request)
{
    return std::make_unique<ManagerRival<Fcl>>(makeManager(request));
}
}  // namespace cullet
