// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/rivals/manager_rival.h"

#include <coal/broadphase/broadphase_callbacks.h>
#include <coal/broadphase/broadphase_dynamic_AABB_tree.h>
#include <coal/collision_object.h>
#include <coal/shape/geometric_shapes.h>

namespace cullet
{
namespace
{
struct Coal
{
    using Base = coal::CollisionObject;
    using Manager = coal::BroadPhaseCollisionManager;

    class Object : public Base
    {
    public:
        Object() : Base(sphere(), false) {}

        void setBox(const Aabb& box)
        {
            getAABB().min_ = coal::Vec3s(box.min[0], box.min[1], box.min[2]);
            getAABB().max_ = coal::Vec3s(box.max[0], box.max[1], box.max[2]);
        }

    private:
        static const std::shared_ptr<coal::Sphere>& sphere()
        {
            static const auto one = std::make_shared<coal::Sphere>(1.0);
            return one;
        }
    };

    class Collector : public coal::CollisionCallBackBase
    {
    public:
        explicit Collector(Pairs& pairs) : m_pairs(pairs) {}

        bool collide(Base* a, Base* b) override
        {
            if (a->getAABB().overlap(b->getAABB()))
                m_pairs.push_back(makePair(rowOfObject(*a), rowOfObject(*b)));
            return false;
        }

    private:
        Pairs& m_pairs;
    };

    static void collide(const Manager& manager, Pairs& pairs)
    {
        Collector collector(pairs);
        manager.collide(&collector);
    }
};
}  // namespace

std::unique_ptr<Rival> makeCoalRival(const RivalRequest&)
{
    return std::make_unique<ManagerRival<Coal>>(std::make_unique<coal::DynamicAABBTreeCollisionManager>());
}
}  // namespace cullet
