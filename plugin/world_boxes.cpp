// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_boxes.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/shapes/object_box.h"
#include "cullet/plugin/shapes/shape_boxes.h"
#include "cullet/plugin/world_rest.h"

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
constexpr std::size_t kObjectsAhead = 8;

/// Nanoseconds per resting object, and additionally per computed box; the number of boxes is that of the last update.
constexpr double kCostOfObject = 8, kCostOfSetBox = 45;

/// Transforms, handle, shape, flags and activation state are in the first cache lines of an object. Inlined, because
/// GCC removes calls of functions that do nothing but prefetch.
[[gnu::always_inline]] inline void prefetchObject(const btCollisionObject* object)
{
    constexpr std::size_t kUsed = 2 * sizeof(btTransform) + 10 * sizeof(btVector3);
    const auto* bytes = reinterpret_cast<const char*>(object);
    for (std::size_t at = 0; at < kUsed; at += 64)
        __builtin_prefetch(bytes + at);
}

/// Indices of the objects that an update visits.
class Visited
{
public:
    /// @param restless null for all objects
    Visited(const Array<int>* restless, int objects) : m_restless(restless), m_objects(objects) {}

    std::size_t size() const
    {
        return m_restless != nullptr ? m_restless->size() : static_cast<std::size_t>(m_objects);
    }
    int operator[](std::size_t i) const
    {
        return m_restless != nullptr ? (*m_restless)[i] : static_cast<int>(i);
    }
    bool areAll() const { return m_restless == nullptr; }
    /// Number of objects of the world, visited or not.
    int objects() const { return m_objects; }

private:
    const Array<int>* m_restless;
    int m_objects;
};

[[gnu::always_inline]] inline void prefetchAhead(const btCollisionObjectArray& objects,
                                                 const Visited& indices, std::size_t index)
{
    if (index + 2 * kObjectsAhead < indices.size())
        prefetchObject(objects[indices[index + 2 * kObjectsAhead]]);
    if (index + kObjectsAhead < indices.size())
        __builtin_prefetch(objects[indices[index + kObjectsAhead]]->getBroadphaseHandle(), 1);
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

    bool update(btCollisionWorld& world, BoxRule rule, WorldRest& rest);
    void compute(const Job& job, const Visited& visited);
    void finish(const Job& job, const Visited& visited);
    double workOf(const Visited& visited) const;
    bool isForOneThread(const Job& job, const Visited& visited) const;
    void runInOrder(const Job& job);
    bool isSameObject(const btCollisionObject& object, std::size_t visited) const;
    void apply(const Job& job, btCollisionObject& object, SerialWork left, const Box& box);

    std::unique_ptr<ParallelLoops> workers = std::make_unique<ParallelLoops>(0);
    // One of each per visited object.
    std::vector<Box> boxes;
    std::vector<SerialWork> serialWork;
    std::vector<btCollisionObject*> objects;  ///< callbacks may have removed some
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
          m_objectBox(ofWorld)
    {
        btBroadphaseInterface* broadphase = ofWorld.getBroadphase();
        if (!isExactly<Broadphase>(*broadphase))
            return;
        m_own = static_cast<Broadphase*>(broadphase);
        m_concurrentBroadphase = m_own->canSetAabbsConcurrently() ? m_own : nullptr;
    }

    bool setsConcurrently() const { return m_concurrentBroadphase != nullptr; }

    /// A number that changes when an object with a proxy of cullet is added; their number shows that one was removed.
    std::uint32_t upcomingUniqueId() const { return m_own != nullptr ? m_own->upcomingUniqueId() : 0; }

    /// Does the part of an object's update that is safe on any thread.
    SerialWork run(btCollisionObject& object, Box& box, ShapeBoxes& shapes) const
    {
        const SerialWork serialWork =
            m_rule == BoxRule::Simple ? computeSimple(object, box, shapes) : compute(object, box, shapes);
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

    /// Updates an object with the same calls as Bullet, if Bullet does. @return whether it does
    bool updateAsBullet(btCollisionObject& object) const
    {
        const bool isUpdated =
            m_rule == BoxRule::Collision ? m_updatesAll || object.isActive() : isUpdatedSimply(object);
        if (isUpdated)
            updateSerially(object);
        return isUpdated;
    }

    void set(btCollisionObject& object, const Box& box) const
    {
        world.getBroadphase()->setAabb(object.getBroadphaseHandle(), box.min, box.max, world.getDispatcher());
    }

    btCollisionWorld& world;
    const btCollisionObjectArray& objects;

private:
    SerialWork compute(const btCollisionObject& object, Box& box, ShapeBoxes& shapes) const
    {
        if (!m_updatesAll && !object.isActive())
            return SerialWork::Nothing;
        return m_objectBox.compute(object, shapes, box.min, box.max) ? SerialWork::Set
                                                                     : SerialWork::WholeUpdate;
    }

    /// Whether btSimpleDynamicsWorld sets the box of an object.
    static bool isUpdatedSimply(const btCollisionObject& object)
    {
        return btRigidBody::upcast(&object) != nullptr && object.isActive() && !object.isStaticObject();
    }

    static SerialWork computeSimple(const btCollisionObject& object, Box& box, ShapeBoxes& shapes)
    {
        if (!isUpdatedSimply(object))
            return SerialWork::Nothing;
        const btCollisionShape& shape = *object.getCollisionShape();
        return shapes.compute(shape, object.getWorldTransform(), box.min, box.max) ? SerialWork::Set
                                                                                   : SerialWork::WholeUpdate;
    }

    BoxRule m_rule;
    bool m_updatesAll;
    ObjectBox m_objectBox;
    Broadphase* m_own = nullptr;                   ///< null: another broad phase
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

bool WorldBoxes::update(btCollisionWorld& world, BoxRule rule, WorldRest& rest)
{
    return m->update(world, rule, rest);
}

/// Computes boxes on all threads. Throws std::bad_alloc.
void WorldBoxes::Parts::compute(const Job& job, const Visited& visited)
{
    const std::size_t count = visited.size();
    serialWork.resize(count);
    boxes.resize(count);
    objects.resize(count);
    const auto runTask = [&](unsigned task)
    {
        const std::size_t end = std::min(count, (task + 1) * kGrain);
        ShapeBoxes shapes;
        for (std::size_t i = task * kGrain; i < end; ++i)
        {
            prefetchAhead(job.objects, visited, i);
            objects[i] = job.objects[visited[i]];
            serialWork[i] = job.run(*objects[i], boxes[i], shapes);
        }
    };
    // More tasks than threads, since the cost varies between shapes.
    const auto tasks = static_cast<unsigned>((count + kGrain - 1) / kGrain);
    workers->runRegion(workOf(visited), [&] { workers->run(tasks, runTask); });
}

/// Nanoseconds.
double WorldBoxes::Parts::workOf(const Visited& visited) const
{
    return kCostOfObject * double(visited.size()) +
           kCostOfSetBox * double(stats.parallelBoxes + stats.serialBoxes);
}

/// Whether the calling thread would compute all boxes, and set them.
bool WorldBoxes::Parts::isForOneThread(const Job& job, const Visited& visited) const
{
    return !job.setsConcurrently() && visited.areAll() &&
           (workers->threads() == 1 || workOf(visited) < 2 * ParallelLoops::workPerThread);
}

bool WorldBoxes::Parts::update(btCollisionWorld& world, BoxRule rule, WorldRest& rest)
{
    if (world.getNumCollisionObjects() < kLeastObjects)
        return false;
    BT_PROFILE("updateAabbs");
    const Job job(world, rule);
    const Visited visited(rule == BoxRule::Collision ? rest.forBoxes(world) : nullptr,
                          world.getNumCollisionObjects());
    if (isForOneThread(job, visited))
    {
        runInOrder(job);
        rest.forget();
        return true;
    }
    try
    {
        compute(job, visited);
    }
    catch (const std::bad_alloc&)
    {
        // Boxes that are set already are set once more.
        rest.forget();
        return false;
    }
    finish(job, visited);
    // Shapes of the application were called, or callbacks of ghost pairs or of another broad phase.
    if (stats.serialBoxes > 0 || !job.setsConcurrently())
        rest.forget();
    if (rule == BoxRule::Collision)
        stats.parallelBoxes += rest.stats().restingBoxes;
    return true;
}

void WorldBoxes::Parts::finish(const Job& job, const Visited& visited)
{
    stats = {};
    stats.hasParallelSets = job.setsConcurrently();
    int next = 0;
    bool isUnchanged = true;
    const std::uint32_t upcomingId = job.upcomingUniqueId();
    for (std::size_t i = 0; isUnchanged && i < visited.size(); ++i)
    {
        isUnchanged = visited[i] < job.objects.size() && isSameObject(*job.objects[visited[i]], i);
        if (!isUnchanged)
            break;
        apply(job, *job.objects[visited[i]], serialWork[i], boxes[i]);
        next = visited[i] + 1;
        // A callback may have put another object in the place of one at rest.
        isUnchanged = visited.areAll() ||
                      (job.objects.size() == visited.objects() && job.upcomingUniqueId() == upcomingId);
    }
    // A callback has added or removed objects, so the computed boxes may belong to other objects.
    for (int i = isUnchanged ? visited.objects() : next; i < job.objects.size(); ++i)
    {
        btCollisionObject& object = *job.objects[i];
        Box box;
        ShapeBoxes shapes;
        const SerialWork left = job.run(object, box, shapes);
        apply(job, object, left, box);
    }
}

/// As Bullet's loop, with objects and proxies read ahead: callbacks of a broad phase may change all.
void WorldBoxes::Parts::runInOrder(const Job& job)
{
    const Visited all(nullptr, job.objects.size());
    stats = {};
    for (int i = 0; i < job.objects.size(); ++i)
    {
        if (job.objects.size() == all.objects())
            prefetchAhead(job.objects, all, std::size_t(i));
        stats.serialBoxes += job.updateAsBullet(*job.objects[i]);
    }
}

/// Whether an object is the visited one of before the callbacks. A new object may have the same address, but
/// Bullet and cullet give each proxy a new id.
bool WorldBoxes::Parts::isSameObject(const btCollisionObject& object, std::size_t visited) const
{
    return &object == objects[visited] &&
           (serialWork[visited] != SerialWork::Set ||
            object.getBroadphaseHandle()->m_uniqueId == boxes[visited].proxyId);
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
