// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_boxes.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/shapes/thread_safe_aabb.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <new>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Objects between the prefetch of an object's proxy and its use; the object itself is prefetched twice as early. Cache
/// misses are a third of the time of an update on one thread.
constexpr std::size_t kPrefetchDistance = 8;

/// Nanoseconds per resting object, and additionally per computed box; the number of boxes is that of the last update.
constexpr double kCostOfObject = 8, kCostOfBox = 45;

/// Transforms, handle, shape, flags and activation state are in the first cache lines of an object. Inlined, because
/// GCC removes calls of functions that do nothing but prefetch.
[[gnu::always_inline]] inline void prefetchObject(const btCollisionObject* object)
{
    constexpr std::size_t kUsed = 2 * sizeof(btTransform) + 10 * sizeof(btVector3);
    const auto* bytes = reinterpret_cast<const char*>(object);
    for (std::size_t at = 0; at < kUsed; at += 64)
        __builtin_prefetch(bytes + at);
}

[[gnu::always_inline]] inline void prefetchAhead(const btCollisionObjectArray& objects, std::size_t index)
{
    const auto count = static_cast<std::size_t>(objects.size());
    if (index + 2 * kPrefetchDistance < count)
        prefetchObject(objects[static_cast<int>(index + 2 * kPrefetchDistance)]);
    if (index + kPrefetchDistance < count)
        __builtin_prefetch(objects[static_cast<int>(index + kPrefetchDistance)]->getBroadphaseHandle(), 1);
}
}  // namespace

struct WorldBoxes::Parts
{
    struct Box
    {
        btVector3 min, max;
        int proxyId = 0;  ///< set if the box is not in the broad phase yet
    };

    /// The remaining work for an object after the parallel loop.
    enum class SerialWork : std::uint8_t
    {
        Nothing,
        Set,          ///< setAabb() with the computed box
        WholeUpdate,  ///< the whole update, on the calling thread
        Done          ///< none: setAabb() was called in the parallel loop
    };

    bool update(btCollisionWorld& world, BoxRule rule);
    void compute(const Job& job, std::size_t count);
    void finish(const Job& job);
    bool isSameObject(const btCollisionObject& object, std::size_t index) const;
    void apply(const Job& job, btCollisionObject& object, SerialWork left, const Box& box);

    std::unique_ptr<ParallelLoops> workers = std::make_unique<ParallelLoops>(0);
    std::vector<Box> boxes;
    std::vector<SerialWork> serialWork;
    std::vector<btCollisionObject*> objects;  ///< indexed like boxes; callbacks may have removed some
    WorldBoxesStats stats;
};

/// The settings of the world during one update.
class WorldBoxes::Job
{
    using Box = Parts::Box;
    using SerialWork = Parts::SerialWork;

public:
    Job(btCollisionWorld& ofWorld, BoxRule rule)
        : world(ofWorld),
          objects(ofWorld.getCollisionObjectArray()),
          m_rule(rule),
          m_updatesAll(ofWorld.getForceUpdateAllAabbs()),
          m_continuous(ofWorld.getDispatchInfo().m_useContinuous),
          m_threshold(gContactBreakingThreshold, gContactBreakingThreshold, gContactBreakingThreshold)
    {
        btBroadphaseInterface* broadphase = ofWorld.getBroadphase();
        if (!isExactly<Broadphase>(*broadphase))
            return;
        auto* own = static_cast<Broadphase*>(broadphase);
        m_concurrentBroadphase = own->canSetAabbsConcurrently() ? own : nullptr;
    }

    bool setsConcurrently() const { return m_concurrentBroadphase != nullptr; }

    /// Does the part of an object's update that is safe on any thread.
    SerialWork run(btCollisionObject& object, Box& box) const
    {
        const SerialWork serialWork =
            m_rule == BoxRule::Simple ? computeSimple(object, box) : compute(object, box);
        if (serialWork != SerialWork::Set)
            return serialWork;
        if (m_concurrentBroadphase == nullptr)
        {
            box.proxyId = object.getBroadphaseHandle()->m_uniqueId;
            return serialWork;
        }
        m_concurrentBroadphase->setAabb(object.getBroadphaseHandle(), box.min, box.max,
                                        world.getDispatcher());
        return SerialWork::Done;
    }

    /// Updates an object on the calling thread, with the same calls as Bullet.
    void updateSerially(btCollisionObject& object) const
    {
        if (m_rule == BoxRule::Collision)
        {
            world.updateSingleAabb(&object);
            return;
        }
        Box box;
        object.getCollisionShape()->getAabb(object.getWorldTransform(), box.min, box.max);
        set(object, box);
    }

    void set(btCollisionObject& object, const Box& box) const
    {
        world.getBroadphase()->setAabb(object.getBroadphaseHandle(), box.min, box.max, world.getDispatcher());
    }

    btCollisionWorld& world;
    const btCollisionObjectArray& objects;

private:
    /// btCollisionWorld::updateSingleAabb() up to the computed box. Oversized boxes are left to that function, since it
    /// deactivates the body and prints a warning.
    SerialWork compute(const btCollisionObject& object, Box& box) const
    {
        if (!m_updatesAll && !object.isActive())
            return SerialWork::Nothing;
        const btCollisionShape& shape = *object.getCollisionShape();
        if (!hasThreadSafeAabb(shape))
            return SerialWork::WholeUpdate;
        addBox(shape, object.getWorldTransform(), box);
        if (m_continuous && object.getInternalType() == btCollisionObject::CO_RIGID_BODY &&
            !object.isStaticOrKinematicObject())
        {
            Box predicted;
            addBox(shape, object.getInterpolationWorldTransform(), predicted);
            box.min.setMin(predicted.min);
            box.max.setMax(predicted.max);
        }
        const bool isUsual = object.isStaticObject() || (box.max - box.min).length2() < btScalar(1e12);
        return isUsual ? SerialWork::Set : SerialWork::WholeUpdate;
    }

    SerialWork computeSimple(const btCollisionObject& object, Box& box) const
    {
        if (btRigidBody::upcast(&object) == nullptr || !object.isActive() || object.isStaticObject())
            return SerialWork::Nothing;
        const btCollisionShape& shape = *object.getCollisionShape();
        if (!hasThreadSafeAabb(shape))
            return SerialWork::WholeUpdate;
        shape.getAabb(object.getWorldTransform(), box.min, box.max);
        return SerialWork::Set;
    }

    void addBox(const btCollisionShape& shape, const btTransform& transform, Box& box) const
    {
        shape.getAabb(transform, box.min, box.max);
        box.min -= m_threshold;
        box.max += m_threshold;
    }

    BoxRule m_rule;
    bool m_updatesAll;
    bool m_continuous;
    btVector3 m_threshold;
    Broadphase* m_concurrentBroadphase = nullptr;  ///< null: the calling thread sets the boxes
};

WorldBoxes::WorldBoxes() : m(std::make_unique<Parts>()) {}

WorldBoxes::~WorldBoxes() = default;

void WorldBoxes::setThreads(int threads)
{
    m->workers = std::make_unique<ParallelLoops>(threads);
}

const WorldBoxesStats& WorldBoxes::stats() const
{
    return m->stats;
}

bool WorldBoxes::update(btCollisionWorld& world, BoxRule rule)
{
    return m->update(world, rule);
}

/// Computes boxes on all threads. Throws std::bad_alloc.
void WorldBoxes::Parts::compute(const Job& job, std::size_t count)
{
    serialWork.resize(count);
    boxes.resize(count);
    objects.resize(count);
    const auto runTask = [&](unsigned task)
    {
        const std::size_t end = std::min(count, (task + 1) * kGrain);
        for (std::size_t i = task * kGrain; i < end; ++i)
        {
            prefetchAhead(job.objects, i);
            objects[i] = job.objects[static_cast<int>(i)];
            serialWork[i] = job.run(*objects[i], boxes[i]);
        }
    };
    // More tasks than threads, since the cost varies between shapes.
    const auto tasks = static_cast<unsigned>((count + kGrain - 1) / kGrain);
    const double work = kCostOfObject * double(count) + kCostOfBox * double(stats.parallelBoxes);
    workers->runRegion(work, [&] { workers->run(tasks, runTask); });
}

bool WorldBoxes::Parts::update(btCollisionWorld& world, BoxRule rule)
{
    const auto count = static_cast<std::size_t>(world.getNumCollisionObjects());
    if (count < 2 * kGrain)
        return false;
    BT_PROFILE("updateAabbs");
    const Job job(world, rule);
    try
    {
        compute(job, count);
    }
    catch (const std::bad_alloc&)
    {
        // Boxes that are set already are set once more.
        return false;
    }
    finish(job);
    return true;
}

void WorldBoxes::Parts::finish(const Job& job)
{
    stats = {};
    stats.hasParallelSets = job.setsConcurrently();
    const auto sizeNow = [&] { return static_cast<std::size_t>(job.objects.size()); };
    std::size_t i = 0;
    for (; i < objects.size() && i < sizeNow(); ++i)
    {
        btCollisionObject& object = *job.objects[static_cast<int>(i)];
        if (!isSameObject(object, i))
            break;
        apply(job, object, serialWork[i], boxes[i]);
    }
    // A callback of the broad phase has added or removed objects, so the computed boxes may belong to other objects.
    for (; i < sizeNow(); ++i)
    {
        btCollisionObject& object = *job.objects[static_cast<int>(i)];
        Box box;
        const SerialWork left = job.run(object, box);
        apply(job, object, left, box);
    }
}

/// Whether an index still holds the same object as before the callbacks. A new object may have the same address, but
/// Bullet and cullet give each proxy a new id.
bool WorldBoxes::Parts::isSameObject(const btCollisionObject& object, std::size_t index) const
{
    return &object == objects[index] && (serialWork[index] != SerialWork::Set ||
                                         object.getBroadphaseHandle()->m_uniqueId == boxes[index].proxyId);
}

/// Does the remaining work for an object. Its callbacks may destroy the object.
void WorldBoxes::Parts::apply(const Job& job, btCollisionObject& object, SerialWork left, const Box& box)
{
    stats.parallelBoxes += left == SerialWork::Set || left == SerialWork::Done;
    stats.serialBoxes += left == SerialWork::WholeUpdate;
    if (left == SerialWork::Set)
        job.set(object, box);
    else if (left == SerialWork::WholeUpdate)
        job.updateSerially(object);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
