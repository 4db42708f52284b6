// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/tests/fuzz/worlds/pair_filter.h"
#include "cullet/tests/fuzz/worlds/shape_maker.h"
#include "cullet/tests/fuzz/worlds/watched_broadphase.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <btBulletDynamicsCommon.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class Broadphase;
}
}  // namespace cullet

namespace cullet::test
{
enum class NarrowPhase : std::uint8_t
{
    Bullet,
    Registered,  ///< Bullet's dispatcher with registerIsaGjk()
    Dispatcher1,
    Dispatcher2  ///< cullet::Dispatcher on two threads
};

enum class SolverChoice : std::uint8_t
{
    Bullet,
    Own,     ///< cullet::Solver
    OwnSoft  ///< with SolverModel::Soft
};

/// What all twins of a run have in common.
struct WorldSettings
{
    SolverChoice solver = SolverChoice::Bullet;
    bool hasShortLoops =
        false;  ///< loops over any number of bodies, islands and contacts run on the twin's threads
    ShapeFamily family = ShapeFamily::All;
    btScalar margin = -1;
    bool hasGhosts = true;
    bool hasContinuous = false;  ///< bodies with a threshold of motion
    bool isOrdered = false;      ///< m_deterministicOverlappingPairs
    bool hasBoxBox = false;
};

struct TwinRecipe
{
    std::string name;
    std::string group;  ///< twins of one group have the same bits
    NarrowPhase narrow = NarrowPhase::Bullet;
    bool hasStockCache = false;
    bool hasParallelWorld = false;  ///< cullet::World
    bool isWatched = true;
    bool isDbvt = false;
    std::unique_ptr<Backend> backend;  ///< null: by the options
    int threads = 1;                   ///< of cullet's parts
};

struct BodyRecipe
{
    enum class Kind : std::uint8_t
    {
        Dynamic,
        Static,
        Kinematic,
        Ghost,
        PairGhost,
        Plain  ///< btCollisionObject
    };

    Kind kind = Kind::Dynamic;
    ShapeRecipe shape;
    btTransform pose = btTransform::getIdentity();
    btVector3 velocity{0, 0, 0};
    int group = 1;
    int mask = -1;
};

/// One world with its bodies, by slots that are the same in all twins.
///
/// A slot or joint that is not there is left alone, as twins of different pairs may differ in what their callbacks did.
class WorldTwin
{
public:
    static constexpr std::size_t kSlots = 40;
    static constexpr std::size_t kJoints = 8;

    WorldTwin(TwinRecipe recipe, const WorldSettings& settings);
    ~WorldTwin();
    WorldTwin(const WorldTwin&) = delete;
    WorldTwin& operator=(const WorldTwin&) = delete;

    const TwinRecipe& recipe() const { return m_recipe; }
    btDiscreteDynamicsWorld& world() { return *m_world; }
    WatchedBroadphase* watched() { return m_watched; }
    /// Gives cullet's broad phase another backend; its pairs stay.
    void changeBackend(std::unique_ptr<Backend> backend);
    btDispatcher* dispatcher() { return m_dispatcher.get(); }
    btCollisionObject* object(std::size_t slot) { return m_slots[slot].object.get(); }
    btRigidBody* body(std::size_t slot);
    OwnedShape* shape(std::size_t slot) { return m_slots[slot].shape.get(); }
    /// The first free slot; slot 0 if there is none, which then stays as it is.
    std::size_t freeSlot() const;
    bool isFree(std::size_t slot) const { return m_slots[slot].object == nullptr; }

    void create(std::size_t slot, const BodyRecipe& recipe);
    void destroy(std::size_t slot);
    void clear();
    void refresh(std::size_t slot, int group, int mask);
    void swapShape(std::size_t slot, const ShapeRecipe& recipe);
    void addJoint(std::size_t joint, int kind, std::size_t a, std::size_t b, bool disablesCollisions);
    void removeJoint(std::size_t joint);
    /// Static spheres or boxes in the distance, so that cullet::World has enough objects for its threads.
    void addCrowd();

    /// Null, or one of two filters.
    void setFilter(int which);
    /// Runs `action` in the filter's call after `delay` others.
    void armFilter(int delay, std::function<void()> action);
    /// Runs `action` in the next tick.
    void armTick(bool isPreTick, std::function<void()> action);
    void disarm();

    /// Runs something whose callbacks may throw.
    template <class Action>
    void guarded(const Action& action)
    {
        try
        {
            action();
        }
        catch (const CallbackFailure&)
        {
            answer(~std::uint64_t(0));
        }
    }

    /// Adds to what twins of a group must answer alike.
    void answer(std::uint64_t bits) { m_answers.push_back(bits); }
    void answer(btScalar value);
    void answer(const btVector3& value);
    void answer(const btCollisionObject* object);

    /// What twins of a group must have alike, and what each number is.
    struct State
    {
        std::vector<std::uint64_t> words;
        std::vector<std::string> names;
        void add(const std::string& name, std::uint64_t word)
        {
            names.push_back(name);
            words.push_back(word);
        }
    };
    State takeState();

    /// What is wrong in this twin alone, or empty.
    std::string check();

private:
    struct Slot
    {
        std::unique_ptr<OwnedShape> shape;
        std::unique_ptr<btCollisionObject> object;
        bool isBusy = false;  ///< a call of Bullet's is about to change its handle
    };
    struct Joint
    {
        std::unique_ptr<btTypedConstraint> joint;
        std::size_t a = 0, b = 0;
    };

    static void tick(btDynamicsWorld* world, btScalar time);
    void makeDispatcher();
    void makeBroadphase();
    void makeSolver();
    void makeWorld();
    std::unique_ptr<btCollisionObject> makeObject(const BodyRecipe& recipe, OwnedShape& shape) const;
    void addObject(btCollisionObject& object, int group, int mask);
    void removeObject(btCollisionObject& object);
    void forget(Slot& slot);
    void callFilterAction();
    std::uint64_t slotBits(std::size_t slot);
    void addPairs(State& state);
    void addManifolds(State& state);
    std::string checkGhost(const btGhostObject& ghost, std::size_t slot);

    TwinRecipe m_recipe;
    WorldSettings m_settings;
    PairFilter m_filters[2] = {PairFilter(1, false), PairFilter(77, true)};
    btGhostPairCallback m_ghostPairs;
    std::unique_ptr<btDefaultCollisionConfiguration> m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    std::unique_ptr<btOverlappingPairCache> m_stockCache;
    std::unique_ptr<btBroadphaseInterface> m_broadphase;
    WatchedBroadphase* m_watched = nullptr;
    Broadphase* m_own = nullptr;  ///< null with DBVT
    std::unique_ptr<btSequentialImpulseConstraintSolver> m_solver;
    std::unique_ptr<btDiscreteDynamicsWorld> m_world;
    std::vector<Slot> m_slots{kSlots};
    std::vector<Joint> m_joints{kJoints};
    std::vector<std::unique_ptr<btCollisionObject>> m_crowd;
    std::unique_ptr<OwnedShape> m_crowdShape;
    std::function<void()> m_filterAction, m_tickAction;
    int m_filterDelay = 0;
    std::vector<std::uint64_t> m_answers;
};
}  // namespace cullet::test
