// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/array.h"
#include "cullet/plugin/core/precision.h"

#include <cstdint>
#include <memory>
#include <typeinfo>

class btCollisionWorld;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Counters of the last step.
struct WorldRestStats
{
    std::uint64_t restingObjects = 0;  ///< static objects that the last search found at rest
    std::uint64_t sleepers = 0;        ///< sleeping bodies whose boxes it found unchanged
    std::uint64_t restingBoxes = 0;    ///< those of both whose boxes were compared, with forced updates
    bool leftOutPairs =
        false;  ///< no object was active: a cullet::Dispatcher had no pair to visit but new ones
    bool keptIslands = false;  ///< all bodies slept, and no island could have changed
    /// Loops over all objects: one if no code of the application can run between the first loop and the last, else up
    /// to three in a step.
    std::uint32_t passes = 0;
};

/// Finds the objects of a world at rest: static ones for which saveKinematicState(), updateAabbs() and
/// calculateSimulationIslands() would change nothing, and sleeping bodies for which the first two would. A part of
/// World<Base>. If nothing else is there, the islands are compared with those that were last found.
///
/// Bullet reports no change of an object: every object is read in every step, with its proxy and shape, and nothing is
/// remembered from one step to the next. The objects found by one loop serve the following loops of the step until code
/// of the application may run, which may change any object; then they are forgotten, and the next loop reads all objects.
/// That code is not meant which should not know of the world: profilers, allocators, log functions and backends.
class CULLET_API WorldRest
{
public:
    /// The indices of the objects that are not at rest, ascending.
    using Indices = Array<int>;

    WorldRest();
    ~WorldRest();

    /// @param threads 0: as many as the machine has
    void setThreads(int threads);

    /// Begins a step: searches all objects if their boxes can be compared, which takes a cullet::Broadphase.
    ///
    /// @param isQuiet whether nothing but Bullet's own code can run before updateAabbs(), unless forget() is called
    /// @param sleepersStay whether no loop before updateAabbs() changes a sleeping body, of whose box the predicted transform
    ///                     is a part
    /// @return null: all objects must be read
    const Indices* begin(btCollisionWorld& world, bool isQuiet, bool sleepersStay);

    /// While it lives, code of the application runs between updateAabbs() and the dispatch only where a pair comes or goes: a
    /// cullet::Dispatcher leaves out all pairs if no object is active.
    class Detection
    {
    public:
        Detection(WorldRest& rest, btCollisionWorld& world);
        ~Detection();
        Detection(const Detection&) = delete;
        Detection& operator=(const Detection&) = delete;

    private:
        WorldRest& m_rest;
        btCollisionWorld& m_world;
    };

    /// For updateAabbs(): the objects found by begin(), or those of a new search.
    ///
    /// @return null: all objects must be read
    const Indices* forBoxes(btCollisionWorld& world);

    /// For calculateSimulationIslands(): the objects of forBoxes() if no pair has come or gone since and no pair was foreign
    /// (Dispatcher::hadForeignPairs()), so that neither callbacks nor shapes of the application were called. They are forgotten
    /// then.
    ///
    /// @return null: all objects must be read
    const Indices* takeForIslands(btCollisionWorld& world);

    /// Whether takeForIslands() found that all bodies of the world sleep, and their boxes are unchanged.
    bool allSleep() const;

    /// Whether they have the islands of the last noteIslands(), with the same pairs: a search would change nothing, unless
    /// there are joints or predictive contacts. After takeForIslands().
    bool keepsIslands(btCollisionWorld& world);

    /// Notes the islands that were found while allSleep().
    void noteIslands(btCollisionWorld& world);

    /// Whether a world is exactly of a class. False if its own was compiled without RTTI.
    static bool isOfClass(const btCollisionWorld& world, const std::type_info* type);

    /// Whether a world has enough objects for a search.
    static bool serves(const btCollisionWorld& world);

    /// Whether the last search may still be true.
    bool isKnown() const;

    /// Code of the application runs, or has run.
    void forget();

    const WorldRestStats& stats() const;

private:
    struct Parts;

    std::unique_ptr<Parts> m;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
