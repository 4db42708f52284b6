// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// One sequence of what applications do to a Bullet world, on several worlds: cullet's pairs and queries are compared with
// brute force, and the worlds with each other, bit by bit, where that is promised.

#include "cullet/tests/fuzz/backend_choice.h"
#include "cullet/tests/fuzz/fuzz_target.h"
#include "cullet/tests/fuzz/worlds/world_queries.h"
#include "cullet/tests/fuzz/worlds/world_run.h"

#include <cstdint>
#include <string>

namespace cullet::test
{
const char* const kFuzzTargetName = "worlds";

namespace
{
constexpr btScalar kFrame = btScalar(1) / 60;

enum class Operation
{
    Step,
    Create,
    Destroy,
    Teleport,
    Shift,
    Scale,
    Refilter,
    Query,
    Sweep,
    TestContacts,
    TestContactsOfPair,
    QueryGhost,
    EditCompound,
    SwapShape,
    ToggleFlag,
    Activate,
    Push,
    AddJoint,
    RemoveJoint,
    Clear,
    SetForceUpdate,
    UpdateBoxes,
    SetBox,
    TeleportFar,
    CleanPairs,
    SetFilter,
    ArmFilter,
    ArmTick,
    CreateMany,
    ChangeBackend,
    kCount
};

class WorldsRun : WorldRun
{
public:
    using WorldRun::WorldRun;

    std::string run()
    {
        for (m_choices.nextOperation(); !m_choices.isEmpty() && m_fault.empty(); m_choices.nextOperation())
        {
            ++m_operations;
            const auto operation =
                static_cast<Operation>(m_choices.below(static_cast<std::uint32_t>(Operation::kCount)));
            const bool isFollowed = m_choices.chance(96);
            operate(operation);
            check();
            if (isFollowed)
                stepFrame();
        }
        for (int i = 0; i < 2 && m_fault.empty(); ++i)
            stepFrame();
        return m_fault;
    }

private:
    void operate(Operation operation)
    {
        if (operation >= Operation::SetBox)
            return operateBadly(operation);
        if (operation >= Operation::EditCompound)
            return operateOnBody(operation);
        switch (operation)
        {
            case Operation::Create:
                return createOne();
            case Operation::Destroy:
                return forSlot([](WorldTwin& twin, std::size_t slot) { twin.destroy(slot); });
            case Operation::Teleport:
                return teleport();
            case Operation::Shift:
                return shift();
            case Operation::Scale:
                return scale();
            case Operation::Refilter:
                return refilter();
            case Operation::Query:
                return query();
            case Operation::Sweep:
                return sweepShape();
            case Operation::TestContacts:
            case Operation::TestContactsOfPair:
                return testContactsOf(operation == Operation::TestContactsOfPair);
            case Operation::QueryGhost:
                return askGhost();
            default:
                return chosenStep();
        }
    }

    void operateOnBody(Operation operation)
    {
        switch (operation)
        {
            case Operation::EditCompound:
                return editCompound();
            case Operation::SwapShape:
                return swapShape();
            case Operation::ToggleFlag:
                return toggleFlag();
            case Operation::Activate:
                return activate();
            case Operation::Push:
                return push();
            case Operation::AddJoint:
                return addJoint();
            case Operation::RemoveJoint:
                return removeJoint();
            case Operation::Clear:
                return clear();
            case Operation::SetForceUpdate:
                return setForceUpdate();
            default:
                return updateBoxes();
        }
    }

    void operateBadly(Operation operation)
    {
        switch (operation)
        {
            case Operation::SetBox:
                return setBox();
            case Operation::TeleportFar:
                return teleportFar();
            case Operation::SetFilter:
                return setFilter();
            case Operation::ArmFilter:
            case Operation::ArmTick:
                return arm(operation == Operation::ArmTick);
            case Operation::CreateMany:
                return createMany();
            case Operation::ChangeBackend:
                return changeBackend();
            default:
                return forSlot(
                    [](WorldTwin& twin, std::size_t slot)
                    {
                        twin.world().getPairCache()->cleanProxyFromPairs(
                            twin.object(slot)->getBroadphaseHandle(), twin.dispatcher());
                    });
        }
    }

    void stepFrame()
    {
        step(kFrame, 1, kFrame);
        check();
    }

    void chosenStep()
    {
        const btScalar time =
            m_choices.of({kFrame, kFrame / 4, btScalar(0), 6 * kFrame, 2 * kFrame, 60 * kFrame});
        const int substeps = m_choices.of({1, 0, 3, 2});
        step(time, substeps, m_choices.of({kFrame, kFrame / 2}));
    }

    void createOne()
    {
        const BodyRecipe recipe = chosenBody(m_choices, m_worlds.settings.family);
        const std::size_t slot = first().freeSlot();
        forEach([&](WorldTwin& twin) { twin.create(slot, recipe); });
    }

    void createMany()
    {
        const std::uint32_t count = 1 + m_choices.below(12);
        const float reach = m_choices.of({2.0f, 1.0f, 0.25f, 8.0f});
        m_noise = Noise(m_choices.byte());
        createBodies(count, reach, chosenPlace(m_choices));
    }

    void place(WorldTwin& twin, std::size_t slot, const btTransform& pose, bool updatesBox)
    {
        twin.object(slot)->setWorldTransform(pose);
        twin.object(slot)->setInterpolationWorldTransform(pose);
        if (updatesBox)
            twin.world().updateSingleAabb(twin.object(slot));
    }

    void teleport()
    {
        const std::size_t slot = anySlot();
        const btVector3 to = chosenPlace(m_choices);
        const btTransform pose(chosenTurn(m_choices), to);
        const bool updatesBox = m_choices.chance(128);
        forSlot(slot, [&](WorldTwin& twin, std::size_t at) { place(twin, at, pose, updatesBox); });
    }

    void shift()
    {
        const std::size_t slot = anySlot();
        const float reach = m_choices.of({0.05f, 0.01f, 0.2f, 1.0f});
        m_noise = Noise(m_choices.byte());
        const btVector3 way = noisePlace(reach);
        const bool updatesBox = m_choices.chance(128);
        forSlot(slot,
                [&](WorldTwin& twin, std::size_t at)
                {
                    btTransform pose = twin.object(at)->getWorldTransform();
                    pose.setOrigin(pose.getOrigin() + way);
                    place(twin, at, pose, updatesBox);
                });
    }

    void scale()
    {
        const std::size_t slot = anySlot();
        const btScalar x = m_choices.of({btScalar(1), btScalar(2), btScalar(0.5), btScalar(0.25)});
        const btScalar y = m_choices.of({btScalar(1), btScalar(2), btScalar(0.5), btScalar(3)});
        const btScalar margin = m_choices.of({btScalar(-1), btScalar(-1), btScalar(0), btScalar(0.1)});
        const bool cleans = m_choices.chance(128);
        forSlot(slot,
                [&](WorldTwin& twin, std::size_t at)
                {
                    btCollisionShape& shape = twin.shape(at)->shape();
                    shape.setLocalScaling(btVector3(x, y, x));
                    if (margin >= 0)
                        shape.setMargin(margin);
                    if (cleans)
                        twin.world().getPairCache()->cleanProxyFromPairs(
                            twin.object(at)->getBroadphaseHandle(), twin.dispatcher());
                });
    }

    /// DBVT asks a filter only when it adds a pair, so that words are changed with a new proxy.
    void refilter()
    {
        const std::size_t slot = anySlot();
        const int group = chosenGroup(m_choices), mask = chosenMask(m_choices);
        const bool isDirect = m_choices.chance(128) && !m_worlds.isTame;
        forSlot(slot,
                [&](WorldTwin& twin, std::size_t at)
                {
                    if (!isDirect)
                        return twin.refresh(at, group, mask);
                    twin.object(at)->getBroadphaseHandle()->m_collisionFilterGroup = group;
                    twin.object(at)->getBroadphaseHandle()->m_collisionFilterMask = mask;
                });
    }

    void query()
    {
        const btVector3 from = chosenPlace(m_choices), to = chosenPlace(m_choices);
        const btScalar half = m_choices.of({btScalar(0), btScalar(0.5), btScalar(2)});
        forEach(
            [&](WorldTwin& twin)
            {
                castRay(twin, from, to);
                if (twin.watched() != nullptr)
                    twin.watched()->checkQueries(from, to, btVector3(half, half / 2, half));
            });
    }

    void sweepShape()
    {
        const btVector3 from = chosenPlace(m_choices), to = chosenPlace(m_choices);
        const int kind = static_cast<int>(m_choices.below(3));
        const btTransform begin(btQuaternion::getIdentity(), from), end(chosenTurn(m_choices), to);
        forEach([&](WorldTwin& twin) { sweep(twin, kind, begin, end); });
    }

    void testContactsOf(bool isPair)
    {
        const std::size_t a = anySlot(), b = anySlot();
        const btScalar distance = m_choices.of({btScalar(0), btScalar(0.25)});
        forEach([&](WorldTwin& twin)
                { isPair ? testContactsOfPair(twin, a, b, distance) : testContacts(twin, a, distance); });
    }

    void askGhost()
    {
        const std::size_t slot = anySlot();
        const btVector3 from = chosenPlace(m_choices), to = chosenPlace(m_choices);
        forEach([&](WorldTwin& twin) { queryGhost(twin, slot, from, to); });
    }

    void editCompound()
    {
        const std::size_t slot = anySlot();
        const std::uint32_t kind = m_choices.below(3);
        const std::uint8_t child = m_choices.byte();
        const btVector3 to = chosenPlace(m_choices);
        const bool updatesBox = m_choices.chance(128);
        forSlot(slot,
                [&](WorldTwin& twin, std::size_t at)
                {
                    OwnedShape& shape = *twin.shape(at);
                    if (kind == 0)
                        shape.addChild(child, to);
                    else if (kind == 1)
                        shape.removeChild(child);
                    else
                        shape.moveChild(child, to);
                    if (updatesBox)
                        twin.world().updateSingleAabb(twin.object(at));
                });
    }

    void swapShape()
    {
        const std::size_t slot = anySlot();
        const ShapeRecipe recipe = chosenShape(m_choices, m_worlds.settings.family);
        forSlot(slot, [&](WorldTwin& twin, std::size_t at) { twin.swapShape(at, recipe); });
    }

    void toggleFlag()
    {
        const std::size_t slot = anySlot();
        using Object = btCollisionObject;
        const int flag = m_choices.of(
            {int(Object::CF_NO_CONTACT_RESPONSE), int(Object::CF_KINEMATIC_OBJECT),
             int(Object::CF_STATIC_OBJECT), int(Object::CF_CUSTOM_MATERIAL_CALLBACK),
             int(Object::CF_DISABLE_SPU_COLLISION_PROCESSING), int(Object::CF_HAS_FRICTION_ANCHOR)});
        forSlot(slot,
                [&](WorldTwin& twin, std::size_t at)
                {
                    // Bullet has no algorithm for moving meshes, and moves every body that is not static.
                    if (flag == Object::CF_STATIC_OBJECT && twin.shape(at)->isConcave())
                        return;
                    twin.object(at)->setCollisionFlags(twin.object(at)->getCollisionFlags() ^ flag);
                });
    }

    void activate()
    {
        const std::size_t slot = anySlot();
        const int state = m_choices.of(
            {ACTIVE_TAG, ISLAND_SLEEPING, WANTS_DEACTIVATION, DISABLE_DEACTIVATION, DISABLE_SIMULATION});
        forSlot(slot, [&](WorldTwin& twin, std::size_t at) { twin.object(at)->forceActivationState(state); });
    }

    void push()
    {
        const std::size_t slot = anySlot();
        const btVector3 velocity = chosenPlace(m_choices);
        forSlot(slot,
                [&](WorldTwin& twin, std::size_t at)
                {
                    if (btRigidBody* body = twin.body(at))
                    {
                        body->setLinearVelocity(velocity * 4);
                        body->setAngularVelocity(velocity);
                        body->activate();
                    }
                });
    }

    void addJoint()
    {
        const std::size_t joint = m_choices.below(WorldTwin::kJoints);
        const int kind = static_cast<int>(m_choices.below(4));
        const std::size_t a = anySlot(), b = anySlot();
        const bool disables = m_choices.chance(128);
        forEach([&](WorldTwin& twin) { twin.addJoint(joint, kind, a, b, disables); });
    }

    void removeJoint()
    {
        const std::size_t joint = m_choices.below(WorldTwin::kJoints);
        forEach([&](WorldTwin& twin) { twin.removeJoint(joint); });
    }

    void clear()
    {
        const bool destroysAll = m_choices.chance(192);
        forEach(
            [&](WorldTwin& twin)
            {
                if (destroysAll)
                    twin.clear();
                twin.world().getBroadphase()->resetPool(twin.dispatcher());
            });
    }

    void setForceUpdate()
    {
        const bool isForced = !m_choices.chance(128);
        forEach([&](WorldTwin& twin) { twin.world().setForceUpdateAllAabbs(isForced); });
    }

    void updateBoxes()
    {
        const std::uint32_t kind = m_choices.below(3);
        forEach(
            [&](WorldTwin& twin)
            {
                if (kind == 0)
                    twin.world().updateAabbs();
                else if (kind == 1)
                    twin.world().computeOverlappingPairs();
                else
                    twin.world().performDiscreteCollisionDetection();
            });
    }

    /// Boxes with a NaN or min > max too, and of any size. Those with a NaN spoil DBVT's tree.
    void setBox()
    {
        const std::size_t slot = anySlot();
        const Aabb box = m_worlds.isTame ? chosenBox(m_choices) : chosenStrangeBox(m_choices);
        const btVector3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
        forSlot(slot,
                [&](WorldTwin& twin, std::size_t at)
                {
                    twin.world().getBroadphase()->setAabb(twin.object(at)->getBroadphaseHandle(), min, max,
                                                          twin.dispatcher());
                });
    }

    void teleportFar()
    {
        const std::size_t slot = anySlot();
        const bool isExtreme = !m_worlds.isTame;
        const float x = m_choices.coordinate(isExtreme), y = m_choices.coordinate(isExtreme),
                    z = m_choices.coordinate(isExtreme);
        const btTransform pose(btQuaternion::getIdentity(), btVector3(x, y, z));
        const bool updatesBox = m_choices.chance(128);
        forSlot(slot, [&](WorldTwin& twin, std::size_t at) { place(twin, at, pose, updatesBox); });
    }

    void setFilter()
    {
        const int which = static_cast<int>(m_choices.below(3));
        if (!m_worlds.isTame)
            forEach([&](WorldTwin& twin) { twin.setFilter(which); });
    }

    /// What a callback does: bodies leave and enter, and exceptions leave.
    void arm(bool isTick)
    {
        const std::uint32_t kind = m_choices.below(6);
        const std::size_t slot = anySlot();
        const int delay = static_cast<int>(m_choices.below(8));
        const bool isPreTick = m_choices.chance(128);
        const BodyRecipe recipe = chosenBody(m_choices, m_worlds.settings.family);
        if (m_worlds.isTame)
            return;
        forEach(
            [&](WorldTwin& twin)
            {
                const auto action = [this, &twin, kind, slot, recipe] { act(twin, kind, slot, recipe); };
                isTick ? twin.armTick(isPreTick, action) : twin.armFilter(delay, action);
                if (!isTick && twin.world().getPairCache()->getOverlapFilterCallback() == nullptr)
                    twin.setFilter(1);
            });
    }

    void act(WorldTwin& twin, std::uint32_t kind, std::size_t slot, const BodyRecipe& recipe)
    {
        // Bullet asks the filter also within a loop over its bodies, for those with a threshold of motion.
        if ((kind == 0 || kind == 4) && !m_worlds.settings.hasContinuous)
            twin.create(twin.freeSlot(), recipe);
        if ((kind == 1 || kind == 4 || kind == 5) && m_worlds.mayCallbacksDestroy)
            twin.destroy(slot);
        if (kind == 2)
            twin.world().computeOverlappingPairs();
        if (kind == 3 || kind == 5)
            throw CallbackFailure();
    }

    void changeBackend()
    {
        const std::size_t twin = m_choices.below(2);
        m_worlds.twins[twin]->changeBackend(chosenBackend(m_choices));
    }
};
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    return WorldsRun(data, size).run();
}
}  // namespace cullet::test
