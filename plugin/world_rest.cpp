// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_rest.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/plugin/proxies/proxy_pool.h"
#include "cullet/plugin/shapes/shape_boxes.h"
#include "cullet/plugin/step/prefetch_step.h"
#include "cullet/plugin/step/static_mark.h"
#include "cullet/plugin/world_boxes.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <algorithm>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Objects per task.
constexpr std::size_t kRestGrain = 1024;

/// Nanoseconds per object whose marks are read, and additionally per box that is compared: both wait for memory.
constexpr double kCostOfMarks = 12, kCostOfComparison = 20;

/// Objects between the prefetch of an object and that of its proxy, and between the latter and its use.
constexpr std::size_t kAhead = 12;

[[gnu::always_inline]] inline void prefetchAhead(const btCollisionObjectArray& objects, std::size_t index,
                                                 bool hasBoxes)
{
    const auto count = static_cast<std::size_t>(objects.size());
    if (index + 2 * kAhead < count)
        prefetchResting(objects[static_cast<int>(index + 2 * kAhead)], hasBoxes);
    if (hasBoxes && index + kAhead < count)
        __builtin_prefetch(objects[static_cast<int>(index + kAhead)]->getBroadphaseHandle());
}

/// Whether the broad phase of a world does nothing for a box that it has already.
bool keepsEqualBoxes(btCollisionWorld& world)
{
    const btBroadphaseInterface* const broadphase = world.getBroadphase();
    return broadphase != nullptr && isExactly<Broadphase>(*broadphase);
}

/// What a search needs to know of its world.
struct Search
{
    explicit Search(btCollisionWorld& world)
        : objects(world.getCollisionObjectArray()),
          updatesAll(world.getForceUpdateAllAabbs()),
          threshold(gContactBreakingThreshold, gContactBreakingThreshold, gContactBreakingThreshold)
    {
    }

    /// Whether the loops of a step would leave an object as it is.
    [[gnu::always_inline]] inline bool isAtRest(const btCollisionObject& object, ShapeBoxes& shapes) const
    {
        constexpr int kMobility =
            btCollisionObject::CF_STATIC_OBJECT | btCollisionObject::CF_KINEMATIC_OBJECT;
        if ((object.getCollisionFlags() & kMobility) != btCollisionObject::CF_STATIC_OBJECT ||
            !isMarkedAsStatic(object))
            return false;
        if (!updatesAll && !object.isActive())
            return true;
        btVector3 min, max;
        if (!shapes.compute(*object.getCollisionShape(), object.getWorldTransform(), min, max))
            return false;
        return static_cast<const Proxy*>(object.getBroadphaseHandle())
            ->isUpToDate(min - threshold, max + threshold);
    }

    const btCollisionObjectArray& objects;
    bool updatesAll;
    btVector3 threshold;
};
}  // namespace

struct WorldRest::Parts
{
    /// For which loop of the step the indices are known.
    enum class Known : std::uint8_t
    {
        No,
        ForBoxes,
        ForIslands
    };

    bool find(btCollisionWorld& world);
    void search(const Search& search);
    void chooseExamination(btCollisionWorld& world, std::size_t pairs);
    bool isQuietSinceBoxes(btCollisionWorld& world) const;

    std::unique_ptr<ParallelLoops> workers = std::make_unique<ParallelLoops>(0);
    Known known = Known::No;
    Indices restless;
    Indices found;                  ///< those of each task, from where its objects begin
    std::vector<std::size_t> ends;  ///< [task] end of its part of what was found
    std::size_t objects = 0;        ///< of the world when it was searched
    std::uint64_t pairVersion = 0;  ///< of the pair cache, when the boxes were set
    WorldRestStats stats;
};

WorldRest::WorldRest() : m(std::make_unique<Parts>()) {}

WorldRest::~WorldRest() = default;

void WorldRest::setThreads(int threads)
{
    m->workers = std::make_unique<ParallelLoops>(threads);
}

const WorldRestStats& WorldRest::stats() const
{
    return m->stats;
}

bool WorldRest::isKnown() const
{
    return m->known != Parts::Known::No;
}

bool WorldRest::serves(const btCollisionWorld& world)
{
    return world.getNumCollisionObjects() >= WorldBoxes::kLeastObjects;
}

void WorldRest::forget()
{
    m->known = Parts::Known::No;
}

bool WorldRest::isOfClass(const btCollisionWorld& world, const std::type_info* type)
{
    const std::type_info* const own = dynamicType(world);
    return own != nullptr && *own == *type;
}

const WorldRest::Indices* WorldRest::begin(btCollisionWorld& world, bool isQuiet)
{
    forget();
    m->stats = {};
    if (!isQuiet || !m->find(world))
    {
        ++m->stats.passes;
        return nullptr;
    }
    m->known = Parts::Known::ForBoxes;
    return &m->restless;
}

const WorldRest::Indices* WorldRest::forBoxes(btCollisionWorld& world)
{
    const auto count = static_cast<std::size_t>(world.getNumCollisionObjects());
    const bool isKnown = m->known == Parts::Known::ForBoxes && m->objects == count;
    forget();
    if (!isKnown && !m->find(world))
    {
        ++m->stats.passes;
        return nullptr;
    }
    if (const auto* cache = dynamicCast<const PairCache>(world.getPairCache()))
    {
        m->pairVersion = cache->version();
        m->known = Parts::Known::ForIslands;
        m->chooseExamination(world, static_cast<std::size_t>(cache->getNumOverlappingPairs()));
    }
    return &m->restless;
}

const WorldRest::Indices* WorldRest::takeForIslands(btCollisionWorld& world)
{
    const bool isKnown = m->known == Parts::Known::ForIslands && m->isQuietSinceBoxes(world);
    forget();
    m->stats.passes += !isKnown;
    return isKnown ? &m->restless : nullptr;
}

/// The examination of a pair costs less than the visits of some objects at rest that it may spare.
void WorldRest::Parts::chooseExamination(btCollisionWorld& world, std::size_t pairs)
{
    constexpr std::size_t kObjectsPerPair = 4;
    btDispatcher* const dispatcher = world.getDispatcher();
    if (dispatcher != nullptr && isExactly<Dispatcher>(*dispatcher))
        static_cast<Dispatcher*>(dispatcher)
            ->setFindsForeignPairs(stats.restingObjects >= kObjectsPerPair * pairs);
}

bool WorldRest::Parts::isQuietSinceBoxes(btCollisionWorld& world) const
{
    btDispatcher* const dispatcher = world.getDispatcher();
    auto* const cache = dynamicCast<PairCache>(world.getPairCache());
    return objects == static_cast<std::size_t>(world.getNumCollisionObjects()) && dispatcher != nullptr &&
           isExactly<Dispatcher>(*dispatcher) && !static_cast<Dispatcher*>(dispatcher)->hadForeignPairs() &&
           cache != nullptr && cache->version() == pairVersion &&
           cache->getOverlapFilterCallback() == nullptr;
}

/// @return false: the boxes cannot be compared, the objects are too few, or there is no memory
bool WorldRest::Parts::find(btCollisionWorld& world)
{
    objects = static_cast<std::size_t>(world.getNumCollisionObjects());
    stats.restingObjects = stats.restingBoxes = 0;
    if (!serves(world) || !keepsEqualBoxes(world))
        return false;
    try
    {
        search(Search(world));
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
    ++stats.passes;
    stats.restingObjects = objects - restless.size();
    stats.restingBoxes = world.getForceUpdateAllAabbs() ? stats.restingObjects : 0;
    return true;
}

/// Each task writes to its own part of a list. Throws std::bad_alloc.
void WorldRest::Parts::search(const Search& search)
{
    const auto tasks = static_cast<unsigned>((objects + kRestGrain - 1) / kRestGrain);
    if (found.size() < objects)
        found.resize(objects);
    restless.reserve(objects);
    ends.resize(tasks);
    const auto runTask = [&](unsigned task)
    {
        ShapeBoxes shapes;
        std::size_t end = task * kRestGrain;
        for (std::size_t i = task * kRestGrain; i < std::min(objects, (task + 1) * kRestGrain); ++i)
        {
            prefetchAhead(search.objects, i, search.updatesAll);
            found[end] = static_cast<int>(i);
            end += !search.isAtRest(*search.objects[static_cast<int>(i)], shapes);
        }
        ends[task] = end;
    };
    const double costOfObject = kCostOfMarks + (search.updatesAll ? kCostOfComparison : 0.0);
    workers->runRegion(costOfObject * double(objects), [&] { workers->run(tasks, runTask); });
    restless.clear();
    for (std::size_t task = 0; task < tasks; ++task)
        restless.insert(restless.end(), found.begin() + std::ptrdiff_t(task * kRestGrain),
                        found.begin() + std::ptrdiff_t(ends[task]));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
