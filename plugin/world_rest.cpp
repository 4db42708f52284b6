// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_rest.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/plugin/proxies/proxy_pool.h"
#include "cullet/plugin/shapes/object_box.h"
#include "cullet/plugin/shapes/shape_boxes.h"
#include "cullet/plugin/step/prefetch_step.h"
#include "cullet/plugin/step/static_mark.h"
#include "cullet/plugin/world_boxes.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

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

/// Whether an object needs a visit.
enum class Visit : std::uint8_t
{
    Needed,
    Asleep,  ///< a sleeping body: not for its box, but it has an island
    Static   ///< none
};

/// Whether pairs of an object unite islands, and with which island.
struct IslandMark
{
    explicit IslandMark(const btCollisionObject& of)
        : object(&of), island(of.getIslandTag()), merges(of.mergesSimulationIslands())
    {
    }
    IslandMark() = default;
    bool operator==(const IslandMark& other) const
    {
        return object == other.object && island == other.island && merges == other.merges;
    }

    const btCollisionObject* object = nullptr;  ///< null: no body that sleeps
    int island = 0;
    bool merges = false;
};

/// What a search needs to know of its world.
struct Search
{
    Search(btCollisionWorld& world, bool sleepersDoStay, const Array<IslandMark>& itsMarks)
        : objects(world.getCollisionObjectArray()),
          updatesAll(world.getForceUpdateAllAabbs()),
          sleepersStay(sleepersDoStay),
          objectBox(world),
          marks(itsMarks.size() == static_cast<std::size_t>(objects.size()) ? itsMarks.data() : nullptr)
    {
    }

    /// Which loops of a step would leave an object as it is.
    [[gnu::always_inline]] inline Visit visitOf(const btCollisionObject& object, ShapeBoxes& shapes) const
    {
        constexpr int kMobility =
            btCollisionObject::CF_STATIC_OBJECT | btCollisionObject::CF_KINEMATIC_OBJECT;
        const int mobility = object.getCollisionFlags() & kMobility;
        if (mobility == btCollisionObject::CF_STATIC_OBJECT)
            return isMarkedAsStatic(object) && keepsBox(object, shapes) ? Visit::Static : Visit::Needed;
        const bool sleeps = sleepersStay && mobility == 0 && object.getActivationState() == ISLAND_SLEEPING &&
                            object.getInternalType() == btCollisionObject::CO_RIGID_BODY;
        return sleeps && keepsBox(object, shapes) ? Visit::Asleep : Visit::Needed;
    }

    /// Whether an object that needs no visit has the marks of the islands that were noted.
    bool isMarked(std::size_t index, Visit visit) const
    {
        const btCollisionObject& object = *objects[static_cast<int>(index)];
        if (marks == nullptr || visit == Visit::Needed)
            return false;
        if (visit == Visit::Static)
            return marks[index].object == nullptr;
        return marks[index] == IslandMark(object) && object.getCompanionId() == -1 &&
               object.getHitFraction() == btScalar(1);
    }

    const btCollisionObjectArray& objects;
    bool updatesAll;
    bool sleepersStay;
    ObjectBox objectBox;
    const IslandMark* marks;  ///< [object] null: none

private:
    [[gnu::always_inline]] inline bool keepsBox(const btCollisionObject& object, ShapeBoxes& shapes) const
    {
        if (!updatesAll && !object.isActive())
            return true;
        btVector3 min, max;
        return objectBox.compute(object, shapes, min, max) &&
               static_cast<const Proxy*>(object.getBroadphaseHandle())->isUpToDate(min, max);
    }
};

/// What the search of a task has found.
struct TaskResult
{
    std::size_t end = 0;       ///< of its part of the indices
    bool areMarked = false;    ///< all of its objects
    bool areInactive = false;  ///< all of its objects, and none needs a visit
};

/// The dispatcher of a world, if it is exactly cullet's.
Dispatcher* ownDispatcher(btCollisionWorld& world)
{
    btDispatcher* const dispatcher = world.getDispatcher();
    return dispatcher != nullptr && isExactly<Dispatcher>(*dispatcher) ? static_cast<Dispatcher*>(dispatcher)
                                                                       : nullptr;
}
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

    bool find(btCollisionWorld& world, bool sleepersStay);
    void search(const Search& search);
    void collect();
    void chooseExamination(btCollisionWorld& world, std::size_t pairs);
    bool isQuietSinceBoxes(btCollisionWorld& world) const;

    std::unique_ptr<ParallelLoops> workers = std::make_unique<ParallelLoops>(0);
    Known known = Known::No;
    Indices restless;      ///< objects to visit for their boxes
    Indices withSleepers;  ///< and those that sleep; empty if none does
    Indices found;  ///< those of each task, from where its objects begin: twice an index, plus 1 if asleep
    std::vector<TaskResult> tasks;
    std::size_t objects = 0;          ///< of the world when it was searched
    std::uint64_t pairVersion = 0;    ///< of the pair cache, when the boxes were set
    Array<IslandMark> marks;          ///< [object] as the islands were found when all slept
    std::uint64_t markedVersion = 0;  ///< of the pair cache then
    const btOverlappingPairCache* markedCache = nullptr;
    bool areMarked = false;    ///< all objects have these marks
    bool areInactive = false;  ///< all objects, and none needs a visit
    bool isDetecting = false;  ///< there is a Detection
    bool allSleep = false;     ///< when the islands were last to be found
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

const WorldRest::Indices* WorldRest::begin(btCollisionWorld& world, bool isQuiet, bool sleepersStay)
{
    forget();
    m->stats = {};
    if (!isQuiet || !m->find(world, sleepersStay))
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
    if (!isKnown && !m->find(world, true))
    {
        ++m->stats.passes;
        return nullptr;
    }
    if (const auto* cache = dynamicCast<const PairCache>(world.getPairCache()))
    {
        m->pairVersion = cache->version();
        m->known = Parts::Known::ForIslands;
        m->chooseExamination(world, static_cast<std::size_t>(cache->getNumOverlappingPairs()));
        Dispatcher* const dispatcher = ownDispatcher(world);
        m->stats.leftOutPairs = dispatcher != nullptr && m->isDetecting && m->areInactive &&
                                isExactly<PairCache>(*cache) &&
                                world.getPairCache()->getOverlapFilterCallback() == nullptr;
        if (m->stats.leftOutPairs)
            dispatcher->expectSleep(cache);
    }
    return &m->restless;
}

const WorldRest::Indices* WorldRest::takeForIslands(btCollisionWorld& world)
{
    const bool isKnown = m->known == Parts::Known::ForIslands && m->isQuietSinceBoxes(world);
    forget();
    m->allSleep = isKnown && m->restless.empty();
    m->stats.passes += !isKnown;
    const Indices& visited = m->withSleepers.empty() ? m->restless : m->withSleepers;
    return isKnown ? &visited : nullptr;
}

bool WorldRest::allSleep() const
{
    return m->allSleep;
}

bool WorldRest::keepsIslands(btCollisionWorld& world)
{
    m->stats.keptIslands = m->allSleep && m->areMarked && m->markedVersion == m->pairVersion &&
                           m->markedCache == world.getPairCache();
    return m->stats.keptIslands;
}

void WorldRest::noteIslands(btCollisionWorld& world)
{
    const btCollisionObjectArray& objects = world.getCollisionObjectArray();
    m->marks.clear();
    try
    {
        m->marks.resize(static_cast<std::size_t>(objects.size()));
    }
    catch (const std::bad_alloc&)
    {
        return;
    }
    for (int i = 0; i < objects.size(); ++i)
    {
        if (!objects[i]->isStaticOrKinematicObject())
            m->marks[static_cast<std::size_t>(i)] = IslandMark(*objects[i]);
    }
    m->markedVersion = m->pairVersion;
    m->markedCache = world.getPairCache();
}

/// The examination of a pair costs less than the visits of some objects at rest that it may spare.
void WorldRest::Parts::chooseExamination(btCollisionWorld& world, std::size_t pairs)
{
    constexpr std::size_t kObjectsPerPair = 4;
    if (Dispatcher* const dispatcher = ownDispatcher(world))
        dispatcher->setFindsForeignPairs(stats.restingObjects >= kObjectsPerPair * pairs);
}

WorldRest::Detection::Detection(WorldRest& rest, btCollisionWorld& world) : m_rest(rest), m_world(world)
{
    m_rest.m->isDetecting = true;
}

WorldRest::Detection::~Detection()
{
    m_rest.m->isDetecting = false;
    if (Dispatcher* const dispatcher = ownDispatcher(m_world))
        dispatcher->expectSleep(nullptr);
}

bool WorldRest::Parts::isQuietSinceBoxes(btCollisionWorld& world) const
{
    const Dispatcher* const dispatcher = ownDispatcher(world);
    auto* const cache = dynamicCast<PairCache>(world.getPairCache());
    return objects == static_cast<std::size_t>(world.getNumCollisionObjects()) && dispatcher != nullptr &&
           !dispatcher->hadForeignPairs() && cache != nullptr && cache->version() == pairVersion &&
           cache->getOverlapFilterCallback() == nullptr;
}

/// @return false: the boxes cannot be compared, the objects are too few, or there is no memory
bool WorldRest::Parts::find(btCollisionWorld& world, bool sleepersStay)
{
    objects = static_cast<std::size_t>(world.getNumCollisionObjects());
    stats.restingObjects = stats.sleepers = stats.restingBoxes = 0;
    stats.leftOutPairs = stats.keptIslands = areMarked = areInactive = allSleep = false;
    if (!serves(world) || !keepsEqualBoxes(world))
        return false;
    try
    {
        search(Search(world, sleepersStay, marks));
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
    ++stats.passes;
    stats.sleepers = withSleepers.empty() ? 0 : withSleepers.size() - restless.size();
    stats.restingObjects = objects - restless.size() - stats.sleepers;
    stats.restingBoxes = world.getForceUpdateAllAabbs() ? stats.restingObjects + stats.sleepers : 0;
    return true;
}

/// Each task writes to its own part of a list. Throws std::bad_alloc.
void WorldRest::Parts::search(const Search& search)
{
    tasks.resize((objects + kRestGrain - 1) / kRestGrain);
    if (found.size() < objects)
        found.resize(objects);
    restless.reserve(objects);
    const auto runTask = [&](unsigned task)
    {
        ShapeBoxes shapes;
        TaskResult result{task * kRestGrain, true, true};
        for (std::size_t i = task * kRestGrain; i < std::min(objects, (task + 1) * kRestGrain); ++i)
        {
            prefetchAhead(search.objects, i, search.updatesAll);
            const Visit visit = search.visitOf(*search.objects[static_cast<int>(i)], shapes);
            found[result.end] = 2 * static_cast<int>(i) + (visit == Visit::Asleep);
            result.end += visit != Visit::Static;
            result.areMarked = result.areMarked && search.isMarked(i, visit);
            result.areInactive = result.areInactive && visit != Visit::Needed &&
                                 !search.objects[static_cast<int>(i)]->isActive();
        }
        tasks[task] = result;
    };
    const double costOfObject = kCostOfMarks + (search.updatesAll ? kCostOfComparison : 0.0);
    workers->runRegion(costOfObject * double(objects),
                       [&] { workers->run(static_cast<unsigned>(tasks.size()), runTask); });
    collect();
}

/// Puts the parts of all tasks together. Throws std::bad_alloc.
void WorldRest::Parts::collect()
{
    restless.clear();
    withSleepers.clear();
    areMarked = areInactive = true;
    for (std::size_t task = 0; task < tasks.size(); ++task)
    {
        areMarked = areMarked && tasks[task].areMarked;
        areInactive = areInactive && tasks[task].areInactive;
        for (std::size_t i = task * kRestGrain; i < tasks[task].end; ++i)
        {
            const int object = found[i] / 2;
            const bool isAsleep = found[i] % 2 != 0;
            // Most worlds have none that sleeps, and need no second list.
            if (isAsleep && withSleepers.empty())
                withSleepers = restless;
            if (isAsleep || !withSleepers.empty())
                withSleepers.push_back(object);
            if (!isAsleep)
                restless.push_back(object);
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
