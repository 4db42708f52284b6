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
/// Hundreds of static bodies of many shapes, some piles that fall asleep, and an application that edits everything:
/// between steps, and for a part of the time in callbacks of the world, in motion states, actions and contact callbacks.
class RestScene : public StepScene
{
public:
    static constexpr int kStatics = 700;
    static constexpr int kMovers = 60;

    /// When the application edits: Nothing is between steps.
    enum class Moment : std::uint8_t
    {
        BeforeTick,
        AfterTick,
        MotionState,
        Action,
        Contact,
        ContactEnd,
        Filter,
        Check,
        Nothing
    };

    explicit RestScene(btDiscreteDynamicsWorld& world, std::uint32_t seed);
    ~RestScene() override;

    void step(int number) override;
    /// Edits made so far.
    int events() const override { return m_edits; }
    int edits(Moment moment) const { return m_editsAt[std::size_t(moment)]; }

    /// Called by the callbacks.
    void editAt(Moment moment);

private:
    class Tide;
    class Meddler;
    class Filter;
    class Curious;

    btCollisionShape& makeStaticShape(int number);
    btRigidBody& anyStatic() { return *bodies()[m_random.below(kStatics)]; }
    btRigidBody& anyMover() { return *bodies()[kStatics + m_random.below(kMovers)]; }
    void chooseMoment(int number);
    void wakeSome();
    void editStatic();
    void editShape(btRigidBody& body);
    void editProxy(btRigidBody& body);
    void editMarks(btRigidBody& body);
    void editMover();
    void addAgain(btRigidBody& body);

    Random m_random;
    Moment m_moment = Moment::Nothing;
    std::unique_ptr<Tide> m_tide;  ///< motion state of a kinematic body
    std::unique_ptr<Meddler> m_meddler;
    std::unique_ptr<Filter> m_filter;
    std::unique_ptr<Curious> m_curious;
    std::vector<btCollisionShape*> m_sharedShapes;
    int m_edits = 0;
    std::array<int, 9> m_editsAt{};
};
}  // namespace cullet::test
