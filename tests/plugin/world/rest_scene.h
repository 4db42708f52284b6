// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/world/step_scene.h"
#include "cullet/tests/support/random.h"

#include <btBulletDynamicsCommon.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet::test
{
/// Of which bodies a RestScene is made, and which of them the application edits.
struct RestOptions
{
    int movers = 60;
    int columns = 10;          ///< of piles of three movers
    float moverEdits = 0.03f;  ///< share of the edits that concern movers; the others concern static bodies
    bool editsInFilters =
        true;  ///< in overlap filter callbacks, which another broad phase calls during updateAabbs()
    bool editsSleepers = false;  ///< edits of movers are such that most do not wake them
};

/// Hundreds of static bodies of many shapes, piles that fall asleep, and an application that edits everything: between
/// steps, and for a part of the time in callbacks of the world, in motion states, actions and contact callbacks.
class RestScene : public StepScene
{
public:
    static constexpr int kStatics = 700;

    /// When the application edits: Nothing is between steps.
    enum class Moment : std::uint8_t
    {
        BeforeTick,
        AfterTick,
        MotionState,
        Synchronization,
        Action,
        Contact,
        ContactEnd,
        Filter,
        Check,
        Nothing
    };

    static constexpr std::size_t kMoments = std::size_t(Moment::Nothing) + 1;

    RestScene(btDiscreteDynamicsWorld& world, std::uint32_t seed, const RestOptions& options = {});
    ~RestScene() override;

    void step(int number) override;
    /// Edits made so far.
    int events() const override { return m_edits; }
    int edits(Moment moment) const { return m_editsAt[std::size_t(moment)]; }

    /// Called by the callbacks.
    void editAt(Moment moment);

private:
    class Tide;
    class Mirror;
    class Meddler;
    class Filter;
    class Curious;

    btCollisionShape& makeStaticShape(int number);
    btRigidBody& anyStatic() { return *bodies()[m_random.below(kStatics)]; }
    btRigidBody& anyMover() { return *bodies()[kStatics + m_random.below(std::uint32_t(m_options.movers))]; }
    void chooseMoment(int number);
    void letAllSleep();
    void wakeSome();
    void editStatic();
    void editShape(btRigidBody& body);
    void editProxy(btRigidBody& body);
    void editMarks(btRigidBody& body);
    void editMover();
    void editSleeper();
    void editStateOfSleeper(btRigidBody& body);
    void takeStep();
    void addAgain(btRigidBody& body);

    RestOptions m_options;
    Random m_random;
    Moment m_moment = Moment::Nothing;
    std::unique_ptr<Tide> m_tide;      ///< motion state of a kinematic body
    std::unique_ptr<Mirror> m_mirror;  ///< motion state of a mover
    std::unique_ptr<Meddler> m_meddler;
    std::unique_ptr<Filter> m_filter;
    std::unique_ptr<Curious> m_curious;
    std::vector<btCollisionShape*> m_sharedShapes;
    int m_edits = 0;
    std::array<int, kMoments> m_editsAt{};
};
}  // namespace cullet::test
